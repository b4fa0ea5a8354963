"""From where on something is claimed, or left, and from where on that is worth reporting."""

from __future__ import annotations

from collections.abc import Iterable
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


@dataclass(frozen=True, kw_only=True)
class Difference:
    """By how much one model predicts unseen data better than another."""

    gain: float  # mean difference of their losses [noise variance]
    p_value: float  # of none
    limits: Limits = USUAL  # from which it is certain

    @property
    def certain(self) -> bool:
        """Whether the model predicts better for certain."""
        return self.p_value <= self.limits.alpha and self.gain > 0.0


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """What is left in a link."""

    # Mean square of what repeats miss together, in the noise's variance; may be below 0. Without
    # repeats it is the mean square less that of the noise
    excess: float
    p_value: float  # of nothing being left, corrected for the number of links; 1 without repeats
    # Whether repeats show it. Without them slow noise, and what differs from log to log, look like
    # something that is left, and a fit that has followed them looks like nothing: neither is
    # evidence
    known: bool = True
    limits: Limits = USUAL  # from which it counts

    @property
    def counts(self) -> bool:
        """Whether it is certain and material."""
        return self.p_value <= self.limits.alpha and self.excess >= self.limits.least

    @property
    def certain(self) -> float:
        """Excess that counts [noise variance]; else 0."""
        return self.excess if self.counts else 0.0

    @property
    def uncounted(self) -> float:
        """Excess that is too little to count, or may be noise [noise variance]; else 0."""
        return 0.0 if self.counts else max(self.excess, 0.0)

    @property
    def undecided(self) -> bool:
        """Whether something material is left that may be noise: no repeats decide it."""
        return not self.known and self.excess >= self.limits.least

    @property
    def excluded(self) -> bool:
        """Whether repeats show nothing material."""
        return self.known and not self.counts


def nothing_material(found: Iterable[Remainder]) -> bool:
    """Whether no link shows anything material, neither for certain nor what may be noise."""
    return not any(one.counts or one.undecided for one in found)
