"""Models that predict as well as the best one: a model confidence set at level alpha.

Models are taken out one at a time, the worst first, as long as those that are left differ. The set
that remains holds the best model with a probability of at least 1 - alpha, whichever it is: what is
in it is tied. The test of each set is the largest paired statistic between any two of its models,
with the same sign flips for all (see `pamsim.inference.model_comparison` for what they assume and
for how few units decide anything). At five units or fewer and a level of 5 % nothing is ever taken
out: the set then says that the data cannot separate models, not that they are equal
(`ConfidenceSet.decidable`).

Source: P. Hansen, A. Lunde and J. Nason, Econometrica 79 (2011), the range statistic and its
elimination rule, with sign flips of independent units in place of their block bootstrap.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.model_comparison import (
    sign_patterns,
    smallest_p_value,
    standardised,
    unit_order,
)

_ROUNDING = 1e-12  # relative difference of two statistics that counts as none


@dataclass(frozen=True, kw_only=True)
class ConfidenceSet:
    """Models that are not worse than the best with certainty.

    Attributes:
        kept: True for models in the set, (m,).
        p_values: of each model, (m,): it is in the set of every level below. 1 for the best.
        alpha: level of the set.
        smallest: smallest p-value that so many units can give.
    """

    kept: NDArray[np.bool_]
    p_values: FloatArray
    alpha: float
    smallest: float

    @property
    def decidable(self) -> bool:
        """Whether so many units can take any model out at all."""
        return self.smallest <= self.alpha


def model_confidence_set(losses: FloatArray, alpha: float, *, seed: int = 0) -> ConfidenceSet:
    """Find the models that predict held-out units as well as the best one.

    Args:
        losses: (n, m) of m models on n held-out units.
        alpha: largest probability that the best model is not in the set.
        seed: random seed of the sign patterns, where they are drawn.

    Raises:
        InputError: not (n, m), a loss that is not finite, or alpha not between 0 and 1.
    """
    if losses.ndim != 2 or 0 in losses.shape:
        raise InputError(f"losses of shape {losses.shape}, not (n units, m models)")
    if not np.all(np.isfinite(losses)):
        raise InputError("a loss is not finite; leave out models that cannot be simulated")
    if not 0.0 < alpha < 1.0:
        raise InputError(f"alpha {alpha:g} is not between 0 and 1")
    units, models = losses.shape
    smallest = smallest_p_value(units, two_sided=True)
    if models == 1:
        return ConfidenceSet(
            kept=np.ones(1, dtype=bool), p_values=np.ones(1), alpha=alpha, smallest=smallest
        )
    pairs = np.array(list(combinations(range(models), 2)))
    scaled = standardised(losses[:, pairs[:, 0]] - losses[:, pairs[:, 1]])
    scaled = scaled[unit_order(scaled)]
    behind = np.zeros((models, models))  # of the row's model: positive if its loss is the larger
    behind[pairs[:, 0], pairs[:, 1]] = scaled.sum(axis=0)
    step, statistics = _eliminate(behind - behind.T)
    # A pair is in the sets of all steps up to the first that takes out one of the two.
    last = np.minimum(*step[pairs].T)
    columns = np.argsort(last, kind="stable")
    begins = np.searchsorted(last[columns], np.arange(models - 1))
    limit = np.array(statistics) - _ROUNDING * np.sqrt(units)
    reached, patterns = np.zeros(models - 1), 0
    for signs in sign_patterns(units, np.random.default_rng(seed)):
        own = np.maximum.reduceat(np.abs(signs @ scaled[:, columns]), begins, axis=1)
        largest = np.maximum.accumulate(own[:, ::-1], axis=1)[:, ::-1]
        reached += np.sum(largest >= limit, axis=0)
        patterns += len(signs)
    p_of_step = np.append(np.maximum.accumulate(reached / patterns), 1.0)
    p_values = p_of_step[step]
    return ConfidenceSet(kept=p_values > alpha, p_values=p_values, alpha=alpha, smallest=smallest)


def _eliminate(behind: FloatArray) -> tuple[NDArray[np.intp], list[float]]:
    """Order in which models are taken out: it depends on what is observed alone.

    Args:
        behind: (m, m) statistic of each pair, antisymmetric.

    Returns:
        Step at which each model goes, (m,), the last one for the best; and the statistic of the set
        before each step.
    """
    left = list(range(len(behind)))
    step = np.zeros(len(left), dtype=np.intp)
    statistics: list[float] = []
    while len(left) > 1:
        farthest = behind[np.ix_(left, left)].max(axis=1)
        worst = int(np.argmax(farthest))
        statistics.append(float(farthest[worst]))
        step[left.pop(worst)] = len(statistics) - 1
    step[left] = len(statistics)
    return step, statistics
