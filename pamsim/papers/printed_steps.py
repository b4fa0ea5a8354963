"""The printed MAS-20 rows as experiments, and what their simulation gives.

The paper prints the pressures at which the arm came to rest, not those it started from. Its
operating concept (Matiskova 2021, section 3.1) is that both muscles are filled equally, the arm
rests at the reference point E, and then the pressure of one muscle, the active one, is changed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, nearest
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.printed import PrintedStep, mas20_steps
from pamsim.recordings.recording import Recording
from pamsim.recordings.step_metrics import StepMetrics

DURATION = 6.0
"""Length of a simulated response [s]: ten times the paper's slower time constant."""

IDENTIFIED_ROW = 1
"""Large step without load, the kind the paper identified G1 and G2 from."""


class Start(NamedTuple):
    """An assumption on where a step started: name on the command line, meaning as a sentence."""

    name: str
    meaning: str


_SENTENCES = {
    "vent": "the paper's operating concept: both muscles rest at the higher printed pressure"
    " (reference point E), then the active one is vented to the lower",
    "fill": "both muscles rest at the lower printed pressure, then the active one is filled to the"
    " higher",
    "maximum": "both muscles rest at the largest printed pressure of all rows (stiffest reference"
    " point), then both are brought to the printed pair",
}

STARTS: Mapping[str, Start] = {name: Start(name, text) for name, text in _SENTENCES.items()}
"""The assumptions offered; ``vent`` is the default."""


def find_start(name: str) -> Start:
    """The start condition of a name.

    Raises:
        InputError: if there is none.
    """
    if name not in STARTS:
        raise InputError(f"no start {name!r}; {nearest(name, STARTS)}")
    return STARTS[name]


def start_pressures(step: PrintedStep, start: Start) -> tuple[float, float]:
    """Gauge pressures before a printed step [Pa], under an assumption."""
    if start.name == "vent":
        rest = max(step.pressure)
    elif start.name == "fill":
        rest = min(step.pressure)
    else:
        rest = max(max(row.pressure) for row in mas20_steps())
    return rest, rest


def printed_experiment(
    step: PrintedStep, start: Start, *, duration: float = DURATION, sample_rate: float = 500.0
) -> Experiment:
    """A printed row as an experiment.

    Args:
        step: the row.
        start: assumption on its start.
        duration: [s].
        sample_rate: [Hz]; the paper's is 500.
    """
    return pressure_step(
        start_pressures(step, start),
        step.pressure,
        duration=duration,
        load=step.load,
        sample_rate=sample_rate,
        name=f"row {step.row}",
    )


@dataclass(frozen=True, kw_only=True)
class Row:
    """One printed row and its simulation."""

    step: PrintedStep
    start: tuple[float, float]  # gauge pressures it was assumed to start from [Pa]
    recording: Recording
    metrics: StepMetrics | None  # of its angle [rad]; None if it did not complete
    increment: float  # smallest angle that the rig's encoder resolves [rad]

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


def rms_error_deg(rows: Iterable[Row]) -> float:
    """RMS error of the final angle over rows that are no copies [deg]; NaN if one broke down."""
    errors = [row.error for row in rows if row.step.repeats is None]
    return math.sqrt(sum(error**2 for error in errors) / len(errors)) * DEG_PER_RAD
