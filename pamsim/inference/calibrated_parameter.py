"""A parameter after a calibration: value, interval, reasons for doubt, pull of its prior."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pamsim.inference.coefficient import Doubt, Interval
from pamsim.inference.free_parameter import Prior


@dataclass(frozen=True, kw_only=True)
class PriorPull:
    """What a prior and the data did to each other.

    Attributes:
        prior: the knowledge from elsewhere.
        distance: (value - mean) / standard deviation [-]; beyond 2 they contradict each other.
        share: of the information on the parameter that comes from its prior, 0 to 1; None where the
            parameter has no interval.
    """

    prior: Prior
    distance: float
    share: float | None

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class CalibratedParameter:
    """A parameter after a calibration.

    Attributes:
        name: of the parameter.
        unit: SI, of value, interval and bounds.
        value: at the optimum.
        interval95: 95 % interval, cut to the bounds; None at a bound or where only a combination
            is determined.
        standard_error: [unit]; None like the interval.
        rise95: by how much -2 log likelihood has risen at the ends of the interval; 3.84 for white
            noise, more where the noise is coloured; None like the interval.
        bounds: range the fit was allowed.
        doubts: why not to quote it; empty if there is no reason.
        partners: parameters it trades off or shares a flat direction with.
        sentence: the doubts for a person; empty if there are none.
        pull: its prior against the data, or None.
    """

    name: str
    unit: str
    value: float
    interval95: Interval | None
    standard_error: float | None
    rise95: float | None
    bounds: Interval
    doubts: tuple[Doubt, ...] = ()
    partners: tuple[str, ...] = ()
    sentence: str = ""
    pull: PriorPull | None = None

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return {
            "name": self.name,
            "unit": self.unit,
            "value": self.value,
            "interval95": None if self.interval95 is None else list(self.interval95),
            "standard_error": self.standard_error,
            "rise95": self.rise95,
            "bounds": list(self.bounds),
            "doubts": [str(doubt) for doubt in self.doubts],
            "partners": list(self.partners),
            "sentence": self.sentence,
            "prior": None if self.pull is None else self.pull.as_dict(),
        }
