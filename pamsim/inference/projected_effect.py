"""A further effect, with the error of the formulas already in the model as a nuisance.

No formula is exact. Where an effect is in the model by one of its forms, what that form misses
looks like further effects. So while a further effect is tested, the other forms of the effects in
the model are free: their signatures are projected out of the candidate's, in the metric of the
noise, and only what they cannot give counts. A candidate whose signature is in the span of the
forms cannot be distinguished from an error of the formula, whatever its size.

All is linear about the fitted model, in whitened rows (`pamsim.inference.blocks.Stack`):

    residual = -(model and forms) a - signature * size + noise of variance 1

Each row is predicted from the other ones. With Q an orthonormal basis of the columns of model and
forms, and q its row, the prediction has the variance ``1 / (1 - q' q)``: a row that no other
determines has an infinite one and does not count. Losses are squares in units of this variance
(Dawid's prequential score with a flat prior of the nuisance), the same for the models without and
with the candidate. The candidate's size is that of the other rows.

Flips of the rows' scores decide whether an effect is there (`compare_effects`). They hold their
level from 3 rows on, also of tables of ten rows with five parameters. Gains on unseen rows are what
to report, and what to compare models by. As a test of presence they are weaker: the other rows give
an absent effect some size, so that it is expected to lose.

Sources: F. Cook, Technometrics 19 (1977), and S. Weisberg, Applied Linear Regression (Wiley 1985)
(residuals without a row, or rows); A. P. Dawid, Journal of the Royal Statistical Society A 147
(1984); M. Plumlee, Journal of the American Statistical Association 112 (2017) (discrepancy
orthogonal to the model); J. Hemerik, J. Goeman and L. Finos, Journal of the Royal Statistical
Society B 82 (2020) (flips of score contributions); R. De Santis et al., Journal of the American
Statistical Association (2025), doi 10.1080/01621459.2025.2491775 (flipped scores in units of their
standard deviation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.blocks import Stack
from pamsim.inference.model_comparison import Comparisons, compare_paired

_RANK = 1e-6
"""Relative size of a direction from which it counts: difference Jacobians are that accurate."""


@dataclass(frozen=True, kw_only=True)
class ProjectedEffect:
    """What a candidate adds to a model whose forms are free.

    Attributes:
        losses: (n,) of the rows, each predicted from the other ones with the candidate; squares,
            to be compared with `FreeForms.losses`.
        scores: (n,) fall of each row's half square per size at size 0, forms profiled out: above 0
            where the row speaks for a positive size.
        score_covariance: (n, n) of the scores by the noise alone. It is diagonal but for what the
            fit of model and forms to all rows makes them share.
    """

    losses: FloatArray
    scores: FloatArray
    score_covariance: FloatArray


class FreeForms:
    """A fitted model with the other forms of its effects free.

    Args:
        stack: whitened residual, and Jacobian of nuisance parameters and effects in the model; each
            row is a unit of its own, in the order of the units.
        forms: (n, f) whitened signatures of the effects' other forms; f may be 0.

    Attributes:
        losses: (n,) squares of the rows, each predicted from the other ones.

    Raises:
        InputError: fewer than two rows, units of several rows, or forms of another number of rows.
    """

    def __init__(self, stack: Stack, forms: FloatArray) -> None:
        count = stack.residual.size
        if count < 2:
            raise InputError("one row alone cannot be predicted from others; give two or more")
        if not np.array_equal(stack.unit, np.arange(count)):
            raise InputError("rows are predicted one by one; give each as a unit of its own")
        if forms.ndim != 2 or len(forms) != count:
            raise InputError(f"forms of shape {forms.shape}, not ({count}, f)")
        self._basis = orthonormal(np.hstack([stack.jacobian, forms]))
        free = 1.0 - np.sum(self._basis**2, axis=1)
        self._metric = 1.0 / np.where(free > _RANK**2, free, 1.0)
        self._residual = self._project_out(stack.residual)
        self.losses = self._metric * self._residual**2

    def _project_out(self, rows: FloatArray) -> FloatArray:
        return rows - self._basis @ (self._basis.T @ rows)

    def effect(self, signature: FloatArray) -> ProjectedEffect:
        """Test a candidate.

        Args:
            signature: (n,) whitened change of the residual with the candidate's size.

        Raises:
            InputError: another number of rows, or a signature that is not finite.
        """
        if signature.shape != self._residual.shape or not np.all(np.isfinite(signature)):
            raise InputError(f"signature of shape {signature.shape}, or not finite")
        left = self._project_out(signature)
        kept = float(left @ left)
        if kept <= _RANK**2 * float(signature @ signature):
            none = np.zeros_like(left)
            return ProjectedEffect(
                losses=self.losses, scores=none, score_covariance=np.outer(none, none)
            )
        slope = self._metric * left * self._residual
        curvature = self._metric * left**2
        along = slope - float(left @ self._residual)
        others = kept - curvature  # what the other rows know of the size
        known = others > _RANK**2 * kept
        sizes = np.where(known, along / np.where(known, others, 1.0), 0.0)
        shared = left[:, np.newaxis] * self._basis
        return ProjectedEffect(
            losses=self.losses + 2.0 * sizes * slope + sizes**2 * curvature,
            scores=-left * self._residual,
            score_covariance=np.diag(left**2) - shared @ shared.T,
        )


def compare_effects(effects: Sequence[ProjectedEffect], *, seed: int = 0) -> Comparisons:
    """Which candidates are there, each by itself.

    The scores' signs are flipped; each flipped sum is compared in units of its own standard
    deviation. In other words, the candidate competes with itself under the negative sign in some
    rows, which fits as well if it is absent.

    Args:
        effects: candidates with a positive size, on the same rows.
        seed: random seed of the sign patterns, where they are drawn.

    Raises:
        InputError: no candidates.
    """
    if not effects:
        raise InputError("no candidate effects to compare")
    return compare_paired(
        np.stack([effect.scores for effect in effects], axis=1),
        covariance=np.stack([effect.score_covariance for effect in effects]),
        seed=seed,
    )


def orthonormal(columns: FloatArray, rank: float = _RANK) -> FloatArray:
    """Orthonormal basis (n, r) of columns, which all count the same whatever their units.

    Directions below ``rank``, a share of the largest singular value, count as none.
    """
    norms = np.linalg.norm(columns, axis=0)
    used = columns[:, norms > 0.0] / norms[norms > 0.0]
    if not used.size:
        return np.empty((len(columns), 0))
    basis, values, _ = np.linalg.svd(used, full_matrices=False)
    return basis[:, values > rank * values[0]]
