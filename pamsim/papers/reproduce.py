"""The main job: every printed MAS-20 experiment in the engine, against what the paper measured."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.core.computation import Progress, versions
from pamsim.core.encoding import to_dict, write_json
from pamsim.core.errors import InputError
from pamsim.core.units import DEG_PER_RAD
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.simulate import simulate
from pamsim.identification.step_response import StepIdentification, identify_step, step_of_lags
from pamsim.papers.calibration_record import (
    CalibrationRecord,
    calibration_record,
    stated_parameters,
)
from pamsim.papers.matiskova2021.statics import static_characteristic
from pamsim.papers.printed_steps import (
    IDENTIFIED_ROW,
    Row,
    Start,
    find_start,
    printed_experiment,
    rms_error_deg,
    start_pressures,
)
from pamsim.papers.reproduce_checks import Check, checks
from pamsim.papers.torque_law import best_torque_laws, torque_laws
from pamsim.physics.record import parameters
from pamsim.physics.static_muscle import work_ratio
from pamsim.recordings.printed import mas20_models, mas20_steps
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.sensors import measured
from pamsim.recordings.step_metrics import step_metrics

SCHEMA = "pamsim-reproduce/1"

_CURVE_POINTS = 301

CALIBRATED_START = "vent"
"""The assumption under which the rig was calibrated."""

_PRESSURE, _CONTRACTION = 487e3, 0.0316  # of row 1: gauge [Pa]; what 36.4 deg are, either way [-]


@dataclass(frozen=True, kw_only=True)
class Reproduction:
    """All printed experiments, simulated.

    Attributes:
        rig: that was simulated.
        start: assumption on where the steps started.
        rows: the 24 rows; repeats share their original's recording.
        identified: G1 and G2 of the large step without load; None if it did not complete.
        record: how the rig's static model was chosen; None if its folder has no record.
        checks: what holds and what does not.
        seconds: wall time.
        sensors: whether the signals passed the rig's encoder and converter.
    """

    rig: Rig
    start: Start
    rows: tuple[Row, ...]
    identified: StepIdentification | None
    record: CalibrationRecord | None
    checks: tuple[Check, ...]
    seconds: float
    sensors: bool

    @property
    def distinct(self) -> tuple[Row, ...]:
        """The rows that are not copies of others."""
        return tuple(row for row in self.rows if row.step.repeats is None)

    @property
    def recordings(self) -> Mapping[int, Recording]:
        """Row number -> recording, of the distinct rows."""
        return {row.step.row: row.recording for row in self.distinct}

    @property
    def rms_deg(self) -> float:
        """RMS error of the distinct end positions, which the calibration has seen [deg]."""
        return rms_error_deg(self.distinct)

    @property
    def held_out(self) -> CalibrationRecord | None:
        """The record, if its held-out errors are those of the arm that was simulated."""
        if self.record is None or self.start.name != CALIBRATED_START:
            return None
        return self.record if self.record.belongs(self.rms_deg) else None

    def summary(self) -> str:
        """How close the end positions come and whether the checks hold, in a sentence."""
        passed = sum(check.ok for check in self.checks)
        errors = f"{self.rms_deg:.2f} deg RMS"
        if self.held_out:
            errors = (
                f"{self.held_out.nested.rms_deg:.2f} deg RMS held out (nested leave-one-out),"
                f" {errors} in sample"
            )
        return (
            f"{len(self.distinct)} distinct end positions with {errors};"
            f" {passed} of {len(self.checks)} checks pass"
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything but the recordings, JSON-safe, units in the key names."""
        printed = mas20_models()
        large = self.recordings[IDENTIFIED_ROW]
        models = to_dict(self.identified) if self.identified else {"g1": None, "g2": None}
        fit = self.identified.g2.output_error.fit_percent if self.identified else None
        errors = {row.step.row: row.error * DEG_PER_RAD for row in self.distinct if row.metrics}
        worst = max(errors, key=lambda row: abs(errors[row]), default=None)
        return to_dict(
            {
                "schema": SCHEMA,
                "rig": self.rig.name,
                "start": self.start.name,
                "start_meaning": self.start.meaning,
                "timestep_s": large.meta["timestep_s"],
                "sample_hz": large.meta["sample_hz"],
                "sensors": self.sensors,
                "rows": self.rows,
                "rms_deg": self.rms_deg,
                "worst": {"row": worst, "error_deg": errors[worst]} if worst else None,
                "checks": self.checks,
                "g1": models.pop("g1"),
                "g2": models.pop("g2"),
                "identification": {"row": IDENTIFIED_ROW, **models},
                "fit_percent": fit,
                "figure6": static_characteristic(),
                "figure9": _model_responses(large, self.identified) if self.identified else None,
                "paper": {
                    "source": printed["source"],
                    "g1": printed["g1"],
                    "g2": printed["g2"],
                    "static": printed["static"],
                    "notes": [f"{slip['where']}: {slip['what']}" for slip in printed["slip"]],
                },
                "parameters": stated_parameters(self.rig.file),
                "calibration": self._calibration(),
                "static_models": self.record.static_models if self.record else None,
                "versions": versions(),
                "wall_s": self.seconds,
            }
        )

    def save(self, folder: Path) -> None:
        """Write ``reproduction.json`` and the recordings of the distinct rows into a folder."""
        write_json(folder / "reproduction.json", self.to_dict())
        for number, recording in self.recordings.items():
            recording.save(folder / f"row_{number:02d}")

    def _calibration(self) -> dict[str, Any] | None:
        if self.record is None:
            return None
        used, stated = self.record.used, stated_parameters(self.rig.file)
        return {
            "applies": self.held_out is not None,
            "rms_deg": self.rms_deg,
            "leave_one_out_rms_deg": used["leave_one_out_rms_deg"],
            "nested_leave_one_out": self.record.nested,
            "small_steps_rms_deg": self.record.small_steps_rms_deg,
            "torque_laws": torque_laws(),
            "best_torque_laws": best_torque_laws(),
            "recorded_rms_deg": used["rms_deg"],
            "model": used["name"],
            "parameters": [one for one in stated if one["source"].startswith("identified")],
            "command": self.record.command,
        }


def _model_responses(
    recording: Recording, identified: StepIdentification
) -> Mapping[str, list[float] | None]:
    """Unit steps of every model beside the simulated large step that was identified (Figure 9).

    None stands where an ARX fit has no real time constants.
    """
    keep = slice(None, None, max(1, len(recording.time) // _CURVE_POINTS))
    time = recording.time[keep]
    travelled = recording.angle - recording.angle[0]
    printed = mas20_models()
    lags = {
        "g1_paper": [printed["g1"]["T_s"]],
        "g2_paper": [printed["g2"]["T1_s"], printed["g2"]["T2_s"]],
    }
    for name, model in (("g1", identified.g1), ("g2", identified.g2)):
        lags[f"{name}_output_error"] = [*model.output_error.time_constants]
        lags[f"{name}_arx"] = [*model.arx_unit_gain.time_constants]
    return {
        "time_s": time.tolist(),
        "simulated": (travelled[keep] / identified.final_value).tolist(),
        **{k: step_of_lags(time, *own).tolist() if own else None for k, own in lags.items()},
    }


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
        InputError: for an unknown rig or start, or a rig that has not two muscles or
            not one joint that turns.
    """
    began = time.perf_counter()
    assumed = find_start(start)
    loaded = rig if isinstance(rig, Rig) else load_rig(rig)
    if len(loaded.muscles) != 2:
        raise InputError(
            f"rig {loaded.name!r} has {len(loaded.muscles)} muscles; the printed experiments need"
            " an antagonistic pair"
        )
    if loaded.joints[loaded.only_joint] != "angle":
        raise InputError(
            f"the joint of rig {loaded.name!r} slides; the printed experiments need one that turns"
        )
    report: Progress = progress or (lambda done, total, what: None)
    steps = mas20_steps()
    increments = (loaded.sensor and loaded.sensor.encoder_increments) or 2500.0
    rows: dict[int, Row] = {}
    for step in steps:
        report(step.row - 1, len(steps), f"row {step.row}, {step.size} step")
        if step.repeats is None:
            recording = simulate(loaded, printed_experiment(step, assumed), timestep=timestep)
            if sensors:
                recording = measured(recording, loaded.sensor)
        else:
            recording = rows[step.repeats].recording
        completed = recording.outcome is Outcome.COMPLETED
        rows[step.row] = Row(
            step=step,
            start=start_pressures(step, assumed),
            recording=recording,
            metrics=step_metrics(recording.time, recording.angle) if completed else None,
            increment=2.0 * math.pi / increments,
        )
    report(len(steps), len(steps), "identify G1 and G2")
    large, ordered = rows[IDENTIFIED_ROW], tuple(rows.values())
    recording = large.recording
    identified = identify_step(recording.time, recording.angle) if large.metrics else None
    record = calibration_record(loaded)
    judged = record if assumed.name == CALIBRATED_START else None
    work = [work_ratio(parameters(m), _PRESSURE, _CONTRACTION) for m in loaded.muscles.values()]
    return Reproduction(
        rig=loaded,
        start=assumed,
        rows=ordered,
        identified=identified,
        record=record,
        checks=checks(ordered, identified, judged, max(work, key=lambda ratio: abs(ratio - 1.0))),
        seconds=time.perf_counter() - began,
        sensors=sensors,
    )
