"""A further effect, with the error of the formulas already in the model as a nuisance.

No formula is exact. Where an effect is in the model by one of its forms, what that form misses
looks like further effects. So while a further effect is tested, the other forms of the effects in
the model are free: their signatures are projected out of the candidate's, in the metric of the
noise, and only what they cannot give counts. A candidate whose signature is in the span of the
forms cannot be distinguished from an error of the formula, whatever its size.

All is linear about the fitted model, in whitened rows (`pamsim.inference.blocks.Stack`):

    residual = -(model and forms) a - signature * size + noise of variance 1

Each unit is predicted from the other ones. With Q an orthonormal basis of the columns of model and
forms, and Q_u its rows in unit u, the prediction of unit u has the covariance ``(1 - Q_u Q_u')^-1``
in a unit's rows: a direction that no other unit determines has infinite variance and does not
count. Losses are squares in this metric (Dawid's prequential score with a flat prior of the
nuisance), the same for the models without and with the candidate. The candidate's size is that of
the other units.

Flips of the units' scores decide whether an effect is there (`compare_effects`). They hold their
level from 3 units on, also of tables of ten rows with five parameters. Gains on unseen units are
what to report, and what to compare models by. As a test of presence they are weaker: the other
units give an absent effect some size, so that it is expected to lose.

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
        losses: (u,) of the units, each predicted from the other ones with the candidate; mean
            squares per row, to be compared with `FreeForms.losses`.
        scores: (u,) fall of each unit's half sum of squares per size at size 0, forms profiled
            out: above 0 where the unit speaks for a positive size.
        score_covariance: (u, u) of the scores by the noise alone. It is diagonal but for what the
            fit of model and forms to all units makes them share.
    """

    losses: FloatArray
    scores: FloatArray
    score_covariance: FloatArray


class FreeForms:
    """A fitted model with the other forms of its effects free.

    Args:
        stack: whitened residual, and Jacobian of nuisance parameters and effects in the model.
        forms: (n, f) whitened signatures of the effects' other forms; f may be 0.

    Raises:
        InputError: fewer than two units, or forms of another number of rows.
    """

    def __init__(self, stack: Stack, forms: FloatArray) -> None:
        if len(stack.units) < 2:
            raise InputError("one unit alone cannot be predicted from others; give two or more")
        if forms.ndim != 2 or len(forms) != stack.residual.size:
            raise InputError(f"forms of shape {forms.shape}, not ({stack.residual.size}, f)")
        self.units = stack.units
        self._unit = stack.unit
        self._own = [np.flatnonzero(stack.unit == u) for u in range(len(stack.units))]
        self._rows = np.bincount(stack.unit, minlength=len(stack.units)).astype(np.float64)
        self._basis = orthonormal(np.hstack([stack.jacobian, forms]))
        # In each unit the directions of (1 - Q_u' Q_u)^(-1/2), undetermined ones left out.
        self._roots: list[FloatArray] = []
        for rows in self._own:
            own = self._basis[rows]
            known, turn = np.linalg.eigh(np.eye(own.shape[1]) - own.T @ own)
            good = known > _RANK**2
            self._roots.append((own @ turn[:, good]) / np.sqrt(known[good]))
        self._residual = self.project_out(stack.residual)
        self.losses = self._products(self._residual, self._residual) / self._rows

    def project_out(self, rows: FloatArray) -> FloatArray:
        """Part of whitened rows, (n,) or (n, k), that model and forms cannot give."""
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
        left = self.project_out(signature)
        whole, kept = float(signature @ signature), float(left @ left)
        if kept <= _RANK**2 * whole:
            return ProjectedEffect(
                losses=self.losses,
                scores=np.zeros(self._rows.size),
                score_covariance=np.zeros((self._rows.size, self._rows.size)),
            )
        slope = self._products(left, self._residual)
        curvature = self._products(left, left)
        along = -float(left @ self._residual)
        others = kept - curvature  # what the other units know of the size
        known = others > _RANK**2 * kept
        sizes = np.where(known, (along + slope) / np.where(known, others, 1.0), 0.0)
        shared = np.stack([left[rows] @ self._basis[rows] for rows in self._own])
        return ProjectedEffect(
            losses=self.losses + (2.0 * sizes * slope + sizes**2 * curvature) / self._rows,
            scores=-self._sums(left * self._residual),
            score_covariance=np.diag(self._sums(left**2)) - shared @ shared.T,
        )

    def _products(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Products of projected rows in the metric of each unit's prediction, (u,)."""
        inside = self._sums(a * b)
        for u, (rows, root) in enumerate(zip(self._own, self._roots, strict=True)):
            inside[u] += float((root.T @ a[rows]) @ (root.T @ b[rows]))
        return inside

    def _sums(self, values: FloatArray) -> FloatArray:
        """Sums over the rows of each unit, (u,)."""
        sums = np.bincount(self._unit, weights=values, minlength=self._rows.size)
        return sums.astype(np.float64)


def compare_effects(effects: Sequence[ProjectedEffect], *, seed: int = 0) -> Comparisons:
    """Which candidates are there, each by itself.

    The scores' signs are flipped for whole units; each flipped sum is compared in units of its own
    standard deviation. In other words, the candidate competes with itself under the negative sign
    in some units, which fits as well if it is absent.

    Args:
        effects: candidates with a positive size, on the same units.
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


def orthonormal(columns: FloatArray) -> FloatArray:
    """Orthonormal basis (n, r) of columns, which all count the same whatever their units."""
    norms = np.linalg.norm(columns, axis=0)
    used = columns[:, norms > 0.0] / norms[norms > 0.0]
    if not used.size:
        return np.empty((len(columns), 0))
    basis, values, _ = np.linalg.svd(used, full_matrices=False)
    return basis[:, values > _RANK * values[0]]
