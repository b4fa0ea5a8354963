"""Tests on rows of a fitted model that are too few to hold some out.

All is linear about the fit to all of them, in whitened rows (`pamsim.inference.blocks`):

    residual = -model a - signature * size + noise of variance 1

**A further effect** (`UnseenRows`). Each row is predicted from the other ones. With Q an
orthonormal basis of the model's columns, and q its row, the prediction has the variance
``1 / (1 - q' q)``: a row that no other determines has an infinite one and does not count. Losses
are squares in units of this variance (Dawid's prequential score with a flat prior of the nuisance),
the same for the models without and with the candidate. The candidate's size is that of the other
rows. Flips of the rows' scores decide whether an effect is there (`ProjectedEffect.p_value`): they
hold their level from 3 rows on, also of tables of ten rows with five parameters. Gains on unseen
rows are what to report, and what to compare models by. As a test of presence they are weaker: the
other rows give an absent effect some size, so that it is expected to lose.

**The best of many extensions** may be so by chance (`best_of_many_p_values`): residuals are
exchanged.

**Rows whose inputs are near** each other may miss something together (`missed_together`). Without
repeats it is not known what a perfect model would leave. But what a model misses changes little
between near inputs, and noise is independent: the mean product of a row's residual with that of its
nearest neighbours estimates the mean square of what both miss, as the product of two repeats does
(`pamsim.comparison.repeated_misfit`). Where noise alone is left, every residual may as well have
the other sign, whatever its variance; under each pattern of signs the model is fitted again. What
changes from one input to the next is not seen.

Sources: F. Cook, Technometrics 19 (1977), and S. Weisberg, Applied Linear Regression (Wiley 1985)
(residuals without a row); A. P. Dawid, Journal of the Royal Statistical Society A 147 (1984);
J. Hemerik, J. Goeman and L. Finos, Journal of the Royal Statistical Society B 82 (2020) (flips of
score contributions); R. De Santis et al., Journal of the American Statistical Association (2025),
doi 10.1080/01621459.2025.2491775 (flipped scores in units of their standard deviation); R.
Christensen, The Annals of Statistics 17 (1989), 673 (lack of fit by near replicates); A. Winkler et
al., NeuroImage 92 (2014), 381 (flips of residuals beside a fitted model).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist
from scipy.stats import f as f_distribution

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.model_comparison import (
    compare_paired,
    sign_patterns,
    unit_order,
    upper_p_value,
)
from pamsim.inference.projection import RANK, orthonormal, project_out

ORDERS = 2_999
"""Orders drawn: a p-value of 0.05 is then known to a twelfth of itself, the smallest is 0.00033."""

_SPANNED = 1e-8
"""Share of the largest singular value below which a direction counts as none in exchanges."""

_AS_NEAR = 1e-9  # of the largest distance: neighbours that differ by rounding alone
_DETERMINED = 1e-9  # share of a row's variance that a fit leaves, below which it passes through it


@dataclass(frozen=True, kw_only=True)
class ProjectedEffect:
    """What a candidate adds to a model."""

    # (n,) of the rows, each predicted from the other ones with the candidate; squares, to be
    # compared with `UnseenRows.losses`
    losses: FloatArray
    # (n,) fall of each row's half square per size at size 0: above 0 where the row speaks for a
    # positive size
    scores: FloatArray
    # (n, n) of the scores by the noise alone. It is diagonal but for what the fit of the model to
    # all rows makes them share
    score_covariance: FloatArray

    def p_value(self, seed: int = 0) -> float:
        """Of a candidate that is not there, by flips of the scores' signs.

        In other words, it competes with itself under the negative sign in some rows, which fits as
        well if it is absent.
        """
        return compare_paired(self.scores, covariance=self.score_covariance, seed=seed)[1]


class UnseenRows:
    """Rows of a fitted model, (n,) whitened with a Jacobian (n, p), each predicted from the others.

    ``losses`` (n,) are the squares of the rows so predicted.

    Raises:
        InputError: fewer than two rows.
    """

    def __init__(self, residual: FloatArray, jacobian: FloatArray) -> None:
        if residual.size < 2:
            raise InputError("one row alone cannot be predicted from others; give two or more")
        self._basis = orthonormal(jacobian)
        free = 1.0 - np.sum(self._basis**2, axis=1)
        self._metric = 1.0 / np.where(free > RANK**2, free, 1.0)
        self._residual = project_out(self._basis, residual)
        self.losses = self._metric * self._residual**2

    def effect(self, signature: FloatArray) -> ProjectedEffect:
        """Test a candidate by its signature, the change (n,) of the residual with its size.

        Raises:
            InputError: another number of rows, or a signature that is not finite.
        """
        if signature.shape != self._residual.shape or not np.all(np.isfinite(signature)):
            raise InputError(f"signature of shape {signature.shape}, or not finite")
        left = project_out(self._basis, signature)
        kept = float(left @ left)
        if kept <= RANK**2 * float(signature @ signature):
            none = np.zeros_like(left)
            return ProjectedEffect(
                losses=self.losses, scores=none, score_covariance=np.outer(none, none)
            )
        slope = self._metric * left * self._residual
        curvature = self._metric * left**2
        along = slope - float(left @ self._residual)
        others = kept - curvature  # what the other rows know of the size
        known = others > RANK**2 * kept
        sizes = np.where(known, along / np.where(known, others, 1.0), 0.0)
        shared = left[:, np.newaxis] * self._basis
        return ProjectedEffect(
            losses=self.losses + 2.0 * sizes * slope + sizes**2 * curvature,
            scores=-left * self._residual,
            score_covariance=np.diag(left**2) - shared @ shared.T,
        )


def nearest_units(inputs: FloatArray) -> FloatArray:
    """Weights (n, n) of each unit's nearest neighbours, with a sum of 1 in every row.

    Of the ``inputs`` (n, k) of two units or more each column counts by its span.
    """
    span = np.ptp(inputs, axis=0)
    scaled = inputs[:, span > 0.0] / span[span > 0.0]
    apart = cdist(scaled, scaled) if scaled.size else np.zeros((len(inputs), len(inputs)))
    np.fill_diagonal(apart, np.inf)
    limit = apart.min(axis=1, keepdims=True) + _AS_NEAR * np.sqrt(scaled.shape[1])
    near = np.where(apart <= limit, 1.0, 0.0)
    return near / near.sum(axis=1, keepdims=True)


def missed_together(
    rows: FloatArray, jacobian: FloatArray, near: FloatArray, *, seed: int = 0
) -> tuple[float, float]:
    """Mean square of what near units miss together [noise variance], and the p-value of nothing.

    It is that of whitened rows (n,) of a fitted model with a Jacobian (n, p), one row of each unit,
    and may be below 0. ``near`` is that of `nearest_units`, the seed that of sign patterns that are
    drawn.
    """
    order = unit_order(rows)
    own, weights = rows[order], near[np.ix_(order, order)]
    basis = orthonormal(jacobian)[order]
    # What a fit takes of a row's variance; a row that it passes through shows nothing.
    free = 1.0 - np.sum(basis**2, axis=1)
    shown = free > _DETERMINED
    noise = np.where(shown, own, 0.0) / np.sqrt(np.where(shown, free, 1.0))
    drawn: list[FloatArray] = []
    for signs in sign_patterns(rows.size, np.random.default_rng(seed)):
        flipped = signs * noise
        flipped -= (flipped @ basis) @ basis.T
        drawn.append(np.mean(flipped * (flipped @ weights.T), axis=1))
    products, observed = np.concatenate(drawn), float(np.mean(own * (weights @ own)))
    p_value = upper_p_value(products, observed, scale=float(np.mean(noise**2)))
    return observed - float(products.mean()), p_value


def best_of_many_p_values(
    residual: FloatArray,
    jacobian: FloatArray,
    extended: Sequence[tuple[FloatArray, FloatArray]],
    *,
    seed: int = 0,
) -> list[float]:
    """P-value of each extension of a model, corrected for choosing the best of all of them.

    Under the model without extensions its residuals may stand in any order (Freedman and Lane
    1983). Every order is fitted with the Jacobians of all extensions, and only the best of them
    counts (Westfall and Young 1993), so that extensions with similar signatures are not counted
    twice. A p-value counts the observed order among the drawn ones: it is never 0. The model has a
    residual (n,) and a Jacobian (n, p), each extended one after its fit a residual (n,) and a
    Jacobian (n, p + q).
    """
    count = residual.size
    # In the order of size, so that the order of a table's rows changes nothing.
    order = np.argsort(residual, kind="stable")
    spanned = orthonormal(jacobian[order], _SPANNED)
    leverage = np.minimum(np.sum(spanned**2, axis=1), 1.0 - 1e-9)
    rest = residual[order] / np.sqrt(1.0 - leverage)
    rng = np.random.default_rng(seed)
    mixed = rng.permuted(np.tile(rest - rest.mean(), (ORDERS, 1)), axis=1).T
    before = np.sum(mixed**2, axis=0) - np.sum((spanned.T @ mixed) ** 2, axis=0)
    tails: list[float] = []
    largest: dict[tuple[int, int], FloatArray] = {}  # F ratios, by degrees of freedom
    total = np.array([float(residual @ residual)])
    for extended_residual, extended_jacobian in extended:
        wider = orthonormal(extended_jacobian[order], _SPANNED)
        added = max(extended_jacobian.shape[1] - jacobian.shape[1], 1)
        left = count - spanned.shape[1] - added
        if left < 1:
            tails.append(1.0)
            continue
        after = np.sum(mixed**2, axis=0) - np.sum((wider.T @ mixed) ** 2, axis=0)
        ratio = _f_ratio(before, after, added, left)
        largest[added, left] = np.maximum(largest.get((added, left), 0.0), ratio)
        reached = np.array([float(extended_residual @ extended_residual)])
        own = f_distribution.sf(_f_ratio(total, reached, added, left), added, left)
        tails.append(float(own[0]))
    # The tail of an F distribution is a common scale for extensions by one and by two parameters.
    best = np.ones(ORDERS)
    for (added, left), ratio in largest.items():
        best = np.minimum(best, f_distribution.sf(ratio, added, left))
    return [(1 + int(np.sum(best <= p * (1.0 + 1e-9)))) / (1 + ORDERS) for p in tails]


def _f_ratio(before: FloatArray, after: FloatArray, added: int, left: int) -> FloatArray:
    """F ratio of a fall of the sum of squares."""
    return np.maximum(before - after, 0.0) / added / np.maximum(after / left, 1e-300)
