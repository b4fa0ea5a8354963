"""A printed row of Matiskova 2021 and its simulation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pamsim.core.encoding import to_dict
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.recordings.printed import PrintedStep
from pamsim.recordings.recording import Recording
from pamsim.recordings.step_metrics import StepMetrics

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
        increment: smallest angle that the rig's encoder resolves [rad].
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
        return self.metrics is not None and self.metrics.reversal <= self.increment

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe, units in the key names."""
        step, metrics = self.step, self.metrics
        return to_dict(
            {
                "row": step.row,
                "table": step.table,
                "size": step.size,
                "p1_kpa": step.pressure[0] / PA_PER_KPA,
                "p2_kpa": step.pressure[1] / PA_PER_KPA,
                "load_kg": step.load,
                "measured_deg": step.angle * DEG_PER_RAD,
                "simulated_deg": metrics.final * DEG_PER_RAD if metrics else None,
                "error_deg": self.error * DEG_PER_RAD,
                "start_p1_kpa": self.start[0] / PA_PER_KPA,
                "start_p2_kpa": self.start[1] / PA_PER_KPA,
                "settling_s": metrics.settling_time if metrics else None,
                "overshoot_percent": 100.0 * metrics.overshoot if metrics else None,
                "monotonic": self.monotonic,
                "repeats": step.repeats,
                "slip": step.slip,
                "outcome": self.recording.outcome.value,
                "message": self.recording.message,
            }
        )


def rms_error(rows: tuple[Row, ...]) -> float:
    """RMS error of the final angle over some rows [rad]; NaN if one did not complete."""
    return math.sqrt(sum(row.error**2 for row in rows) / len(rows))
