"""From where on something is claimed, and from where on it is worth reporting."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.core.errors import InputError

ALPHA = 0.05
"""Probability that an effect that is not there is claimed, that a level is said to be certain that
is not, or that what noise leaves is taken for something that is missing."""

LOWEST_ALPHA, HIGHEST_ALPHA = 0.001, 0.5
"""Ends of its range. Below, hardly any p-value of 3000 exchanges of rows decides, of which the
smallest is 0.0003; above, what noise does is claimed more often than not."""

MATERIAL = 0.02
"""Fall of the mean square of the whitened rows of some link, from which an effect is material, in
variances of the noise: a signal of a seventh of the noise's amplitude."""

LEAST = 0.05
"""Mean square from which a remainder counts, in variances of the noise. Measured pressures and
motion are imposed smoothed, which misses some of their corners in the same way in all repeats: with
the true parameters of training cases that left up to 0.04."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a diagnosis claims and reports.

    Raises:
        InputError: for a level or a materiality that nothing can be judged by.
    """

    alpha: float = ALPHA  # level of all tests, see `ALPHA`
    # Fall of a link's mean square from which an effect is searched for, see `MATERIAL` [noise
    # variance]
    material: float = MATERIAL
    least: float = LEAST  # mean square from which a remainder counts, see `LEAST` [noise variance]

    def __post_init__(self) -> None:
        if not LOWEST_ALPHA <= self.alpha <= HIGHEST_ALPHA:
            raise InputError(
                f"`alpha` is {self.alpha:g}; it must be from {LOWEST_ALPHA:g} to {HIGHEST_ALPHA:g}"
            )
        if not 0.0 < self.material < float("inf"):
            raise InputError(
                f"`material` is {self.material:g}; it must be above 0, in variances of the noise"
            )


USUAL = Limits()
