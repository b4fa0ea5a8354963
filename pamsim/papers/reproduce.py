"""The main job: every printed MAS-20 experiment in the engine, against what the paper measured."""

from __future__ import annotations

import math
import os
import time

from pamsim.core.errors import InputError
from pamsim.core.progress import Progress
from pamsim.core.recording import Outcome, Recording
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.linear.step_identification import identify_step
from pamsim.papers.ladder_record import calibration_record
from pamsim.papers.printed_steps import (
    Start,
    find_start,
    printed_experiment,
    start_pressures,
)
from pamsim.papers.reproduce_checks import checks
from pamsim.papers.reproduction import IDENTIFIED_ROW, Reproduction, Row
from pamsim.signals.sensors import measured
from pamsim.signals.step_metrics import step_metrics
from pamsim.store.printed import PrintedStep, mas20_steps

CALIBRATED_START = "vent"
"""The assumption under which the rig was calibrated."""


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
        progress: called before each simulation.

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
    record = calibration_record(loaded)
    applies = assumed.name == CALIBRATED_START
    return Reproduction(
        rig=loaded,
        start=assumed,
        rows=ordered,
        identified=identified,
        record=record,
        checks=checks(ordered, identified, record if applies else None),
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
