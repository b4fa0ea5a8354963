"""What a model leaves in a link that is no noise: what repeats miss together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.links import Link
from pamsim.comparison.repeated_misfit import repeated_misfit, shared_p_values
from pamsim.core.units import FloatArray

ALPHA = 0.05
"""Probability that an effect that is not there is claimed, that a level is said to be certain that
is not, or that what noise leaves is taken for something that is missing."""

LEAST = 0.05
"""Mean square from which a remainder counts, in variances of the noise. Measured pressures and
motion are imposed smoothed, which misses some of their corners in the same way in all repeats: with
the true parameters of training cases that left up to 0.04."""


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """What is left in a link.

    Attributes:
        excess: mean square of what repeats miss together, in the noise's variance; may be below 0.
            Without repeats it is the mean square less that of the noise.
        p_value: of nothing being left, corrected for the number of links; 1 without repeats.
        known: whether repeats show it. Without them slow noise, and what differs from log to log,
            look like something that is left, and a fit that has followed them looks like nothing:
            neither is evidence.
    """

    excess: float
    p_value: float
    known: bool = True

    @property
    def counts(self) -> bool:
        """Whether it is certain (`ALPHA`) and material (`LEAST`)."""
        return self.p_value <= ALPHA and self.excess >= LEAST

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
        return not self.known and self.excess >= LEAST

    @property
    def excluded(self) -> bool:
        """Whether repeats show nothing material."""
        return self.known and not self.counts


def remainders(
    rows: Mapping[Link, Sequence[Mapping[str, FloatArray]]],
    losses: Mapping[Link, FloatArray],
    *,
    seed: int = 0,
) -> dict[Link, Remainder]:
    """What a model leaves in the held-out units of every link.

    Args:
        rows: whitened rows of every link: for each group of repeats and channel, trial -> (n,).
        losses: mean square of the rows of every link in every unit, (u,).
        seed: random seed of the sign flips.
    """
    misfits = {
        link: [repeated_misfit(one) for one in groups if len(one) > 1]
        for link, groups in rows.items()
    }
    repeated = {link: own for link, own in misfits.items() if own}
    p_values = shared_p_values(list(repeated.values()), seed=seed) if repeated else []
    found = {
        link: Remainder(excess=float(np.mean(loss)) - 1.0, p_value=1.0, known=False)
        for link, loss in losses.items()
    }
    for (link, own), p_value in zip(repeated.items(), p_values, strict=True):
        excess = float(np.mean([one.shared for one in own]))
        found[link] = Remainder(excess=excess, p_value=p_value)
    return found
