"""The trim point of a linear model of the arm: the command and the angle it counts from."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Sight
from pamsim.controllers.split import PressureSplit


@dataclass(frozen=True, kw_only=True)
class TrimPoint:
    """A pressure difference and the angle it holds; linear models count from there.

    Attributes:
        split: makes pressures of the difference.
        difference: p1 - p2 [Pa].
        angle: at rest there [rad].
    """

    split: PressureSplit
    difference: float = 0.0
    angle: float = 0.0

    def told(self, seen: Sight) -> float:
        """Measured difference from the point's [Pa]."""
        return seen.pressure[0] - seen.pressure[1] - self.difference

    def given(self, departure: float) -> float:
        """What the limits leave of a wanted departure from the point's difference [Pa]."""
        return self.split.given(self.difference + departure) - self.difference

    def pressures(self, departure: float) -> tuple[float, float]:
        """Pressures for a departure from the point's difference, gauge [Pa]."""
        return self.split.pressures(self.difference + departure)
