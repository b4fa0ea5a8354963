"""What a model leaves in a link that is no noise: what repeats miss together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.links import Link
from pamsim.comparison.repeated_misfit import repeated_misfit, shared_p_values
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.limits import USUAL, Limits


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


def remainders(
    rows: Mapping[Link, Sequence[Mapping[str, FloatArray]]],
    losses: Mapping[Link, FloatArray],
    *,
    limits: Limits = USUAL,
    seed: int = 0,
) -> dict[Link, Remainder]:
    """What a model leaves in the held-out units of every link.

    Args:
        rows: whitened rows of every link: for each group of repeats and channel, trial -> (n,).
        losses: mean square of the rows of every link in every unit, (u,).
        limits: from which something counts.
        seed: random seed of the sign flips.
    """
    misfits = {
        link: [repeated_misfit(one) for one in groups if len(one) > 1]
        for link, groups in rows.items()
    }
    repeated = {link: own for link, own in misfits.items() if own}
    p_values = shared_p_values(list(repeated.values()), seed=seed) if repeated else []
    found = {
        link: Remainder(excess=float(np.mean(loss)) - 1.0, p_value=1.0, known=False, limits=limits)
        for link, loss in losses.items()
    }
    for (link, own), p_value in zip(repeated.items(), p_values, strict=True):
        excess = float(np.mean([one.shared for one in own]))
        found[link] = Remainder(excess=excess, p_value=p_value, limits=limits)
    return found
