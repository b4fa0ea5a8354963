"""The operating point of a linear model of the arm: pressure difference and angle at rest."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.pressure_split import PressureSplit


@dataclass(frozen=True, kw_only=True)
class LinearisationPoint:
    """A pressure difference and the angle that it holds; linear models are deviations from it.

    Attributes:
        split: makes pressures of the difference.
        difference: p1 - p2 [Pa].
        angle: at rest there [rad].
    """

    split: PressureSplit
    difference: float = 0.0
    angle: float = 0.0

    def measured_departure(self, observation: Observation) -> float:
        """Measured difference from the point's [Pa]."""
        return observation.pressure[0] - observation.pressure[1] - self.difference

    def given(self, departure: float) -> float:
        """Departure [Pa] that remains of a wanted one after the limits."""
        return self.split.given(self.difference + departure) - self.difference

    def pressures(self, departure: float) -> Command:
        """Pressures for a departure from the point's difference, gauge [Pa]."""
        return self.split.pressures(self.difference + departure)
