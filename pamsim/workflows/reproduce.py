"""The main job: every printed MAS-20 experiment in the engine, against what the paper measured."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable

from pamsim.core.errors import InputError
from pamsim.core.recording import Outcome, Recording
from pamsim.core.units import DEG_PER_RAD
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.signals.sensors import measured
from pamsim.signals.step_metrics import step_metrics
from pamsim.store.printed import PrintedStep, mas20_models, mas20_steps
from pamsim.sysid.step_identification import StepIdentification, identify_step
from pamsim.workflows.printed_steps import (
    Start,
    find_start,
    printed_experiment,
    start_pressures,
)
from pamsim.workflows.reproduction import IDENTIFIED_ROW, Check, Reproduction, Row, rms_error

RMS_LIMIT_DEG = 2.0
"""Largest RMS error of the final angle that still counts as this rig."""

TIME_CONSTANT_LIMIT = 0.10
"""Largest relative difference of T from the printed one."""

Progress = Callable[[int, int, str], None]
"""Called as ``progress(done, total, what)`` before each simulation."""


def reproduce(
    rig: str | os.PathLike[str] | Rig = "mas20_arm",
    *,
    start: str = "vent",
    timestep: float | None = None,
    sensors: bool = False,
    progress: Progress | None = None,
) -> Reproduction:
    """Simulate every printed experiment and identify G1 and G2 from the large step.

    A run that breaks down keeps its row, with the outcome; the others go on.

    Args:
        rig: name or folder of a rig, or a loaded one. It needs two muscles.
        start: assumption on where the steps started, see `printed_steps.STARTS`.
        timestep: [s]; the rig's own if left out.
        sensors: pass the signals through the rig's encoder and pressure converter.
        progress: see `Progress`.

    Raises:
        InputError: for an unknown rig or start, or a rig that has not two muscles.
    """
    began = time.perf_counter()
    assumed = find_start(start)
    loaded = rig if isinstance(rig, Rig) else load_rig(rig)
    if len(loaded.muscles) != 2:
        raise InputError(
            f"rig {loaded.name!r} has {len(loaded.muscles)} muscles; the printed experiments need"
            " an antagonistic pair"
        )
    report: Progress = progress or (lambda done, total, what: None)
    steps = mas20_steps()
    rows: dict[int, Row] = {}
    for step in steps:
        report(step.row - 1, len(steps), f"row {step.row}, {step.size} step")
        if step.repeats is None:
            recording = simulate(loaded, printed_experiment(step, assumed), timestep=timestep)
            if sensors:
                recording = measured(recording, loaded.sensor)
        else:
            recording = rows[step.repeats].recording
        rows[step.row] = _row(loaded, step, assumed, recording)
    report(len(steps), len(steps), "identify G1 and G2")
    large = rows[IDENTIFIED_ROW].recording
    identified = identify_step(large.time, large.angle) if _completed(large) else None
    ordered = tuple(rows.values())
    return Reproduction(
        rig=loaded,
        start=assumed,
        rows=ordered,
        identified=identified,
        checks=_checks(ordered, identified),
        seconds=time.perf_counter() - began,
        sensors=sensors,
    )


def _completed(recording: Recording) -> bool:
    return recording.outcome is Outcome.COMPLETED


def _row(rig: Rig, step: PrintedStep, start: Start, recording: Recording) -> Row:
    increments = rig.sensor.encoder_increments if rig.sensor else 2500.0
    return Row(
        step=step,
        start=start_pressures(step, start),
        recording=recording,
        metrics=step_metrics(recording.time, recording.angle) if _completed(recording) else None,
        increment=2.0 * math.pi / increments,
    )


def _checks(rows: tuple[Row, ...], identified: StepIdentification | None) -> tuple[Check, ...]:
    distinct = tuple(row for row in rows if row.step.repeats is None)
    rms = rms_error(distinct) * DEG_PER_RAD
    broken = [row.step.row for row in distinct if row.metrics is None]
    wrong = [
        row.step.row
        for row in distinct
        if row.metrics is None or row.metrics.final * row.step.angle <= 0.0
    ]
    turning = [row.step.row for row in distinct if row.step.size != "small" and not row.monotonic]
    swinging = [
        row.step.row
        for row in distinct
        if row.step.size == "small" and row.step.load > 0.0 and not row.monotonic
    ]
    checks = [
        Check(
            name="completed",
            ok=not broken,
            sentence="every simulation ran to its end"
            if not broken
            else f"{_rows(broken)} broke down",
        ),
        Check(
            name="rms",
            ok=rms <= RMS_LIMIT_DEG,
            sentence=f"RMS error of the {len(distinct)} distinct end positions is {rms:.2f} deg"
            f" (limit {RMS_LIMIT_DEG:g} deg)",
        ),
        Check(
            name="signs",
            ok=not wrong,
            sentence="the arm turns the measured way in every row"
            if not wrong
            else f"{_rows(wrong)} end on the wrong side",
        ),
        Check(
            name="monotonic",
            ok=not turning,
            sentence="no response to a large or medium step turns back by an encoder increment,"
            " as the paper says"
            if not turning
            else f"large or medium {_rows(turning)} turn back, against the paper's words",
        ),
        Check(
            name="oscillation",
            ok=bool(swinging),
            sentence=f"small steps with load swing before they settle ({_rows(swinging)}), as the"
            " paper says"
            if swinging
            else "no small step with load swings, against the paper's words",
        ),
    ]
    if identified is not None:
        printed = float(mas20_models()["g1"]["T_s"])
        found = identified.g1.output_error.time_constants[0]
        off = found / printed - 1.0
        checks.append(
            Check(
                name="time_constant",
                ok=abs(off) <= TIME_CONSTANT_LIMIT,
                sentence=f"T of G1 by output error is {found:.3f} s, printed {printed:.3f} s"
                f" ({100.0 * off:+.1f} %, limit {100.0 * TIME_CONSTANT_LIMIT:.0f} %)",
            )
        )
    return tuple(checks)


def _rows(numbers: list[int]) -> str:
    return f"rows {', '.join(map(str, numbers))}"
