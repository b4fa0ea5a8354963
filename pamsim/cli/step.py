"""``pamsim step``: one step response of any rig."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer
from pamsim.cli.main import OK
from pamsim.cli.output import save_json, show_page

if TYPE_CHECKING:
    from pamsim.recordings.recording import Recording
    from pamsim.recordings.step_metrics import StepMetrics


@click.command(name="step", cls=Command)
@options.rig
@click.option(
    "--pressure",
    type=options.PRESSURES,
    help="Set points after the step, one per muscle: 487,0 (kPa).",
)
@click.option(
    "--valve",
    type=options.Quantities("1", "1"),
    help="Valve openings after the step instead: 1,-1 (+1 fill, -1 exhaust).",
)
@click.option(
    "--start",
    type=options.PRESSURES,
    help="Pressures before the step, such as 300,300; with --pressure the higher set point if left"
    " out.",
)
@options.load("Mass on the arm: 1.2 or 1200g.", default="0", show_default=True)
@click.option(
    "--duration",
    type=options.SECONDS,
    default="6",
    show_default=True,
    help="Length of the record: 6 or 800ms.",
)
@click.option("--sample-hz", type=float, default=500.0, show_default=True, help="Sampling rate.")
@options.timestep
@click.option("--integrator", help="Euler, implicit or implicitfast; the rig's own if left out.")
@click.option(
    "--backend",
    default="compiled",
    show_default=True,
    shell_complete=options.listed("pamsim.engine.stepping", "BACKENDS"),
    help="compiled, or python for debugging.",
)
@click.option("--sensors", is_flag=True, help="Record through the rig's encoder and converter.")
@options.page("Folder for recording and page.")
def command(
    rig: str,
    pressure: list[float] | None,
    valve: list[float] | None,
    start: list[float] | None,
    load: float,
    duration: float,
    sample_hz: float,
    sensors: bool,
    out: Path | None,
    json_file: Path | None,
    **choices: Any,
) -> int:
    """Step the pressures or the valves of a rig and record what the arm does.

    Numbers may carry a unit; bare pressures are kPa (gauge), angles deg.
    """
    import numpy as np

    from pamsim.core.errors import InputError
    from pamsim.core.units import PA_PER_KPA
    from pamsim.engine.rig import load_rig
    from pamsim.engine.simulate import simulate
    from pamsim.recordings.experiment import Experiment
    from pamsim.recordings.sensors import measured
    from pamsim.recordings.signals import KINDS
    from pamsim.recordings.step_metrics import step_metrics

    if pressure is not None and valve is None:
        kind, value, began = "pressure_set", pressure, start or [max(pressure)] * len(pressure)
    elif valve is None or pressure is not None:
        raise InputError("give either --pressure or --valve: what the step changes")
    elif start is None:
        raise InputError("--valve needs --start: the pressures the muscles hold before the step")
    else:
        kind, value, began = "valve", valve, start
    experiment = Experiment(
        drive=kind,
        command_time=np.zeros(1),
        command_value=np.array([value]),
        start_pressure=np.array(began),
        duration=duration,
        sample_rate=sample_hz,
        load=load,
        name="step",
    )
    loaded = load_rig(rig)
    recording = simulate(loaded, experiment, **choices)
    if sensors:
        recording = measured(recording, loaded.sensor)
    if out is not None:  # before anything can fail: a broken run is worth looking at
        from pamsim.recordings.recording import write_recording

        for path in write_recording(out, rig, {"step": recording}):
            click.echo(f"wrote {path}")
    recording.completed()
    metrics = {
        name: step_metrics(recording.time, position)
        for name, position in zip(recording.joints, recording.positions.T, strict=True)
    }
    result = _result(loaded.name, experiment, recording, metrics)
    save_json(json_file, result)
    muscles = recording.names.named_muscles or [
        f"muscle {i + 1}" for i in range(len(recording.muscles))
    ]
    ends = zip(muscles, recording.pressure[-1] / PA_PER_KPA, recording.tension[-1], strict=True)
    for muscle, p, f in ends:
        click.echo(f"{muscle}: {p:.1f} kPa, {f:.1f} N at the end")
    if out is not None:
        from pamsim.report.step_figure import write_step

        show_page(write_step(result, recording, out))
    for name, found in metrics.items():
        kind = KINDS[recording.joints[name]]
        settling = found.settling_time
        answer(
            f"{'angle' if recording.names.short else name} {found.start * kind.scale:.2f} ->"
            f" {found.final * kind.scale:.2f} {kind.shown},"
            f" overshoot {100.0 * found.overshoot:.1f} %, "
            + (
                "not settled when the recording ended"
                if not math.isfinite(settling)
                else f"settles in {settling:.3f} s"
            )
        )
    return OK


def _result(
    rig: str, experiment: Any, recording: Recording, metrics: Mapping[str, StepMetrics]
) -> dict[str, Any]:
    from pamsim.core.encoding import to_dict
    from pamsim.core.units import PA_PER_KPA
    from pamsim.recordings.signals import KINDS
    from pamsim.recordings.step_metrics import joint_figures

    joints = {
        name: joint_figures(found, KINDS[recording.joints[name]]) for name, found in metrics.items()
    }
    return to_dict(
        {
            "schema": "pamsim-step/1",
            "rig": rig,
            "drive": experiment.drive,
            "start_pressure_kpa": experiment.start_pressure / PA_PER_KPA,
            "load_kg": experiment.load,
            **(next(iter(joints.values())) if recording.names.short else {"joints": joints}),
            "final_pressure_kpa": recording.pressure[-1] / PA_PER_KPA,
            "final_tension_n": recording.tension[-1],
            "outcome": recording.outcome,
            **{key: recording.meta[key] for key in ("timestep_s", "sample_hz", "mujoco")},
        }
    )
