"""From a pressure difference to the pressures of both muscles, and back.

The difference turns the joint, the common pressure stiffens it: p1 = p0 + dp/2, p2 = p0 - dp/2,
each between the atmosphere and the supply. Where one muscle is at its limit the other still moves,
so that the difference given may be less than the one wanted; a controller with a memory must know.
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Command
from pamsim.core.errors import InputError


@dataclass(frozen=True, kw_only=True)
class PressureSplit:
    """Makes pressures of a difference.

    Attributes:
        common: p0, mean of both pressures where neither is limited, gauge [Pa].
        supply: highest pressure there is, gauge [Pa].
    """

    common: float
    supply: float

    def __post_init__(self) -> None:
        """Check that the common pressure is within the supply.

        Raises:
            InputError: if it cannot.
        """
        if not 0.0 <= self.common <= self.supply:
            raise InputError(
                f"common pressure {self.common / 1e3:g} kPa is not between 0 and the supply's"
                f" {self.supply / 1e3:g} kPa; choose one that is"
            )

    def pressures(self, difference: float) -> Command:
        """Pressures of muscles 1 and 2 for a wanted difference p1 - p2, gauge [Pa]."""
        half = 0.5 * difference
        return self._limited(self.common + half), self._limited(self.common - half)

    def given(self, difference: float) -> float:
        """Difference [Pa] that remains of a wanted one after the limits."""
        first, second = self.pressures(difference)
        return first - second

    def beyond(self, difference: float) -> bool:
        """Whether the limits reduce a wanted difference [Pa]."""
        return 0.5 * abs(difference) > min(self.common, self.supply - self.common)

    def _limited(self, pressure: float) -> float:
        return min(max(pressure, 0.0), self.supply)
