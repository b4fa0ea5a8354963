"""The result of reproducing the paper: rows, models, checks, and all of it as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pamsim.core.encoding import to_dict
from pamsim.core.recording import Recording
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.core.versions import versions
from pamsim.engine.rig import Rig
from pamsim.linear.step_identification import StepIdentification
from pamsim.papers.ladder_record import (
    CalibrationRecord,
    identified_parameters,
    stated_parameters,
)
from pamsim.papers.paper_models import model_responses, static_characteristic
from pamsim.papers.printed_steps import Start
from pamsim.signals.step_metrics import StepMetrics
from pamsim.store.printed import PrintedStep, mas20_models

SCHEMA = "pamsim-reproduce/1"

IDENTIFIED_ROW = 1
"""Large step without load, the kind the paper identified G1 and G2 from."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One printed row and its simulation.

    Attributes:
        step: as printed.
        start: gauge pressures the step was assumed to start from [Pa].
        recording: of the simulation.
        metrics: of its angle [rad]; None if it did not complete.
        increment: smallest angle the rig's encoder tells apart [rad].
    """

    step: PrintedStep
    start: tuple[float, float]
    recording: Recording
    metrics: StepMetrics | None
    increment: float

    @property
    def error(self) -> float:
        """Simulated minus measured final angle [rad]; NaN if the run did not complete."""
        return self.metrics.final - self.step.angle if self.metrics else math.nan

    @property
    def monotonic(self) -> bool:
        """Whether the angle never turns back by more than one encoder increment."""
        return self.metrics is not None and self.metrics.monotonic(self.increment)

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe, units in the key names."""
        step, metrics = self.step, self.metrics
        return {
            "row": step.row,
            "table": step.table,
            "size": step.size,
            "p1_kpa": step.pressure[0] / PA_PER_KPA,
            "p2_kpa": step.pressure[1] / PA_PER_KPA,
            "load_kg": step.load,
            "measured_deg": step.angle * DEG_PER_RAD,
            "simulated_deg": metrics.final * DEG_PER_RAD if metrics else None,
            "error_deg": json_number(self.error * DEG_PER_RAD),
            "start_p1_kpa": self.start[0] / PA_PER_KPA,
            "start_p2_kpa": self.start[1] / PA_PER_KPA,
            "repeats": step.repeats,
            "slip": step.slip,
            "settling_s": json_number(metrics.settling_time) if metrics else None,
            "overshoot_percent": 100.0 * metrics.overshoot if metrics else None,
            "monotonic": self.monotonic,
            "outcome": self.recording.outcome.value,
            "message": self.recording.message,
        }


@dataclass(frozen=True, kw_only=True)
class Check:
    """A statement about the reproduction that holds or does not."""

    name: str
    ok: bool
    sentence: str


@dataclass(frozen=True, kw_only=True)
class Reproduction:
    """All printed experiments, simulated.

    Attributes:
        rig: that was simulated.
        start: assumption on where the steps started.
        rows: the 24 rows; repeats share their original's recording.
        identified: G1 and G2 of the large step without load; None if it did not complete.
        record: how the rig's static model was chosen; None if its folder does not tell.
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

    def as_dict(self) -> dict[str, Any]:
        """Everything but the recordings, JSON-safe, units in the key names."""
        printed = mas20_models()
        large = self.recordings[IDENTIFIED_ROW]
        models = to_dict(self.identified) if self.identified else {"g1": None, "g2": None}
        curves = model_responses(large, self.identified) if self.identified else None
        done = [row for row in self.distinct if row.metrics]
        worst = max(done, key=lambda row: abs(row.error), default=None)
        return {
            "schema": SCHEMA,
            "rig": self.rig.name,
            "start": self.start.name,
            "start_meaning": self.start.meaning,
            "timestep_s": large.meta["timestep_s"],
            "sample_hz": large.meta["sample_hz"],
            "sensors": self.sensors,
            "rows": [row.as_dict() for row in self.rows],
            "rms_deg": json_number(rms_error(self.distinct) * DEG_PER_RAD),
            "worst": {"row": worst.step.row, "error_deg": worst.error * DEG_PER_RAD}
            if worst
            else None,
            "checks": [vars(check) for check in self.checks],
            "g1": models.pop("g1"),
            "g2": models.pop("g2"),
            "identification": {"row": IDENTIFIED_ROW, **models},
            "fit_percent": self.identified.g2.output_error.fit_percent if self.identified else None,
            "figure6": static_characteristic(),
            "figure9": curves,
            "paper": {
                "source": printed["source"],
                "g1": printed["g1"],
                "g2": printed["g2"],
                "static": printed["static"],
                "notes": [f"{slip['where']}: {slip['what']}" for slip in printed["slip"]],
            },
            "parameters": stated_parameters(self.rig.file),
            "calibration": self._calibration(),
            "ladder": list(self.record.ladder) if self.record else None,
            "versions": versions(),
            "wall_s": self.seconds,
        }

    def _calibration(self) -> dict[str, Any] | None:
        if self.record is None:
            return None
        return {
            "rms_deg": json_number(rms_error(self.distinct) * DEG_PER_RAD),
            "loo_rms_deg": self.record.used["loo_rms_deg"],
            "recorded_rms_deg": self.record.used["rms_deg"],
            "model": self.record.used["name"],
            "parameters": identified_parameters(self.rig.file),
            "command": self.record.command,
        }


def rms_error(rows: tuple[Row, ...]) -> float:
    """RMS error of the final angle over some rows [rad]; NaN if one did not complete."""
    return math.sqrt(sum(row.error**2 for row in rows) / len(rows))


def json_number(value: float) -> float | None:
    """The number, or None where JSON has none."""
    return value if math.isfinite(value) else None
