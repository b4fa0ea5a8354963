"""``pamsim step``: one step response of any rig."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, save_json, show_page


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
    help="Pressures before the step, such as 300,300; with --pressure the highest set point if left"
    " out, for one muscle 0.",
)
@options.load("Mass on the arm: 1.2 or 1200g.", default="0")
@click.option(
    "--duration",
    type=options.SECONDS,
    default="6",
    help="Length of the record: 6 or 800ms.",
)
@click.option("--sample-hz", type=float, default=500.0, help="Sampling rate.")
@options.timestep
@click.option("--integrator", help="Euler, implicit or implicitfast; the rig's own if left out.")
@click.option(
    "--backend",
    default="compiled",
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
) -> None:
    """Step the pressures or the valves of a rig and record what the arm does.

    Numbers may carry a unit; bare pressures are kPa (gauge), angles deg.
    """
    import numpy as np

    from pamsim.core.encoding import to_dict
    from pamsim.core.errors import InputError
    from pamsim.core.units import PA_PER_KPA
    from pamsim.engine.rig import load_rig
    from pamsim.engine.simulate import simulate
    from pamsim.recordings.experiment import Experiment
    from pamsim.recordings.sensors import measured
    from pamsim.recordings.signals import KINDS
    from pamsim.recordings.step_metrics import joint_figures, step_metrics

    if (pressure is None) == (valve is None):
        raise InputError(
            "give either --pressure or --valve: what the step changes, such as --pressure 487,0"
        )
    kind, value = ("valve", valve or []) if pressure is None else ("pressure_set", pressure)
    if start is None and kind == "valve":
        raise InputError("--valve needs --start: the pressures the muscles hold before the step")
    began = start or ([max(value)] * len(value) if len(value) > 1 else [0.0])
    if kind == "pressure_set" and began == value:
        raise InputError("nothing changes: give the pressures before the step, by `start`")
    if len(began) != len(value):
        raise InputError(
            f"`start` has {len(began)} pressures for {len(value)} muscles; give one for each"
        )
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
    joints = {
        name: joint_figures(step_metrics(recording.time, position), KINDS[kind])
        for (name, kind), position in zip(
            recording.joints.items(), recording.positions.T, strict=True
        )
    }
    short = recording.names.short
    reached, tension = recording.pressure[-1] / PA_PER_KPA, recording.tension[-1]
    result = to_dict(
        {
            "schema": "pamsim-step/1",
            "rig": loaded.name,
            "drive": experiment.drive,
            "start_pressure_kpa": experiment.start_pressure / PA_PER_KPA,
            "load_kg": experiment.load,
            **(next(iter(joints.values())) if short else {"joints": joints}),
            "final_pressure_kpa": reached,
            "final_tension_n": tension,
            "outcome": recording.outcome,
            **{key: recording.meta[key] for key in ("timestep_s", "sample_hz", "mujoco")},
        }
    )
    save_json(json_file, result)
    for muscle, p, f in zip(loaded.muscles, reached, tension, strict=True):
        click.echo(f"{muscle}: {p:.1f} kPa, {f:.1f} N at the end")
    if out is not None:
        from pamsim.report.step_figure import write_step

        show_page(write_step(result, recording, out))
    for name, figures in joints.items():
        first, final, settling, overshoot = figures.values()
        unit = KINDS[recording.joints[name]].shown
        ends = f"settles in {settling:.3f} s"
        if not math.isfinite(settling):
            ends = "not settled when the recording ended"
        shown = "angle" if short else name
        answer(f"{shown} {first:.2f} -> {final:.2f} {unit}, overshoot {overshoot:.1f} %, {ends}")
