"""A simulator parameter that a calibration may change: range, scale, start, prior knowledge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pamsim.core.errors import ParameterError
from pamsim.core.units import FloatArray

Scale = Literal["linear", "log"]


@dataclass(frozen=True, kw_only=True)
class Prior:
    """What was known of a parameter before: a normal distribution and where it comes from."""

    mean: float  # most likely value [unit of the parameter]
    standard_deviation: float  # of that knowledge [unit of the parameter]
    source: str  # such as "data sheet, +-5 %"


@dataclass(frozen=True, kw_only=True)
class FreeParameter:
    """What a calibration may do with a parameter of the simulator.

    The search sees each range as 0 to 1, linearly or in the logarithm. A logarithmic scale suits a
    positive number known to a factor only; its interval is then symmetric in the logarithm.

    Raises:
        ParameterError: for a number that is not finite, an empty range, a start outside it, a
            logarithmic range that reaches 0, or a prior without a positive standard deviation.
    """

    name: str  # of the parameter
    unit: str  # SI unit of start, low, high and prior
    # Where the search begins; on a bound it is moved inside, because friction that starts at 0 has
    # no slope
    start: float
    low: float  # smallest value
    high: float  # largest value
    scale: Scale = "linear"  # ``linear`` or ``log``
    prior: Prior | None = None  # knowledge from elsewhere, or None

    def __post_init__(self) -> None:
        for field in ("start", "low", "high"):
            if not math.isfinite(getattr(self, field)):
                raise ParameterError(
                    f"{self.name}: {field} = {getattr(self, field)!r} is not a finite number"
                )
        if not self.low < self.high:
            raise ParameterError(
                f"{self.name}: range [{self.low:g}, {self.high:g}] {self.unit} is empty;"
                " low must be below high"
            )
        if not self.low <= self.start <= self.high:
            raise ParameterError(
                f"{self.name}: start {self.start:g} is outside [{self.low:g}, {self.high:g}]"
                f" {self.unit}"
            )
        if self.scale not in ("linear", "log"):
            raise ParameterError(
                f"{self.name}: scale {self.scale!r} is not known; give linear or log"
            )
        if self.scale == "log" and self.low <= 0.0:
            raise ParameterError(
                f"{self.name}: a logarithmic range must be positive, low is {self.low:g}"
                f" {self.unit}; raise it or use the linear scale"
            )
        known = self.prior
        if known is not None and not (
            math.isfinite(known.mean)
            and math.isfinite(known.standard_deviation)
            and known.standard_deviation > 0.0
        ):
            raise ParameterError(
                f"{self.name}: prior {known.mean!r} +- {known.standard_deviation!r} {self.unit}"
                " needs a finite mean and a positive standard deviation"
            )


class SearchScale:
    """Change of variables: each parameter's range to 0 ... 1, linearly or in the logarithm."""

    def __init__(self, parameters: Sequence[FreeParameter]) -> None:
        self._log = np.array([p.scale == "log" for p in parameters], dtype=bool)
        self._ends = np.array([(p.low, p.high) for p in parameters], dtype=np.float64).reshape(
            -1, 2
        )
        self._low = self._forward(self._ends[:, 0])
        self._width = self._forward(self._ends[:, 1]) - self._low

    def _forward(self, values: FloatArray) -> FloatArray:
        return np.where(self._log, np.log(np.where(self._log, values, 1.0)), values)

    def to_unit(self, values: FloatArray) -> FloatArray:
        """Values, shape (..., p) [parameter units], to places in the unit cube, same shape."""
        return (self._forward(values) - self._low) / self._width

    def from_unit(self, places: FloatArray) -> FloatArray:
        """Places in the unit cube, shape (..., p), to values, same shape [parameter units]."""
        raw = self._low + places * self._width
        values = np.where(self._log, np.exp(np.where(self._log, raw, 0.0)), raw)
        # Rounding in the exponential must not carry a value over its bound, nor keep it off.
        values = np.where(places >= 1.0, self._ends[:, 1], np.maximum(values, self._ends[:, 0]))
        return np.where(places <= 0.0, self._ends[:, 0], np.minimum(values, self._ends[:, 1]))

    def slope(self, places: FloatArray) -> FloatArray:
        """Change of value per change of place, shape (p,) [parameter units]."""
        return np.where(self._log, self.from_unit(places), 1.0) * self._width
