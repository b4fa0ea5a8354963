"""Whether a simulation misses what repeats have in common: the misfit that is no noise.

Repeats of a protocol differ by noise, of what is compared and of what is imposed; what the model
misses they share. So the mean product of the residuals of two different repeats estimates the mean
square of what is missed, and the noise of each need not be known to be taken off.

Two tests are made, each at half the level:

* Without a gap a trial's residual may as well have the other sign. Trials are the units, however
  their noise is coloured, and a trial has one sign in all outputs: the largest statistic over the
  outputs in every draw of signs corrects for having looked at all of them (Westfall and Young
  1993). It finds a small gap in many inputs.
* The mean of the repeats beside their scatter (Shen and Faraway, Statistica Sinica 14, 2004), with
  as few degrees of freedom as the repeats can have. It finds a large gap in few trials, whose signs
  could not reach the level.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from pamsim.core.units import FloatArray
from pamsim.inference.model_comparison import sign_flips, upper_p_value

LEVEL = 0.01
"""Probability that any output of a rig without a gap is said to exceed its floor."""

_FLIPS = 3_999
"""Draws of signs: a p-value at `LEVEL` is then known to a sixth of itself."""


@dataclass(frozen=True, kw_only=True)
class RepeatedMisfit:
    """What the repeats of one protocol miss together."""

    trials: tuple[str, ...]  # names of the repeats
    products: FloatArray  # (k, k) mean product of the residuals of two of them [SI^2]

    @property
    def shared(self) -> float:
        """Estimate of the mean square of what all of them miss [SI^2]; may be below 0."""
        count = len(self.trials)
        return float(self.products.sum() - np.trace(self.products)) / (count * (count - 1))

    @property
    def noise(self) -> float:
        """Variance of what they differ by [SI^2]."""
        return float(np.trace(self._about_mean())) / (len(self.trials) - 1)

    def _about_mean(self) -> FloatArray:
        centre = np.eye(len(self.trials)) - 1.0 / len(self.trials)
        return centre @ self.products @ centre

    def mean_and_scatter(self) -> tuple[float, float, float, float]:
        """Terms of the comparison of mean and scatter.

        Returns:
            Square of the mean times the number of repeats, the variance, and the sum of squared
            eigenvalues of their covariance, over 1 and over the degrees of freedom [SI^2, SI^4].
        """
        count, free = len(self.trials), len(self.trials) - 1
        spread = self._about_mean() / free
        squares = float(np.sum(spread**2))
        return float(self.products.sum()) / count, self.noise, squares, squares / free


def repeated_misfit(residuals: Mapping[str, FloatArray]) -> RepeatedMisfit:
    """The misfit of repeats, trial -> residual (n,) [SI], cut to the shortest of them."""
    shortest = min(map(len, residuals.values()))
    rows = np.stack([r[:shortest] for r in residuals.values()])
    return RepeatedMisfit(trials=tuple(residuals), products=rows @ rows.T / shortest)


def shared_p_values(outputs: Sequence[Sequence[RepeatedMisfit]], *, seed: int = 0) -> list[float]:
    """P-value of each output, by its protocols, corrected for the number of outputs."""
    trials = list(dict.fromkeys(t for own in outputs for one in own for t in one.trials))
    index = {name: i for i, name in enumerate(trials)}
    rng = np.random.default_rng(seed)
    signs = np.concatenate([np.ones((1, len(trials))), *sign_flips(_FLIPS, len(trials), rng)])
    drawn = np.stack([_under_signs(own, signs, index) for own in outputs])
    largest = drawn[:, 1:].max(axis=0)
    return [
        min(
            1.0,
            2.0 * upper_p_value(largest, float(flipped[0])),
            2.0 * len(outputs) * _scatter_p_value(own),
        )
        for flipped, own in zip(drawn, outputs, strict=True)
    ]


def smallest_p_value(repeats: Iterable[int]) -> float:
    """Smallest p-value that signs give, of so many repeats of each protocol.

    The sign of one repeat of each is free, and of two tests each has half the level.
    """
    return 2.0 * 0.5 ** sum(count - 1 for count in repeats)


def _under_signs(
    own: Sequence[RepeatedMisfit], signs: FloatArray, index: Mapping[str, int]
) -> FloatArray:
    """Products of different repeats under signs (b, n), in their standard deviations, (b,).

    What it is divided by does not depend on the signs, so that outputs whose noise is white and
    outputs whose trials vary as a whole are on one scale.
    """
    total, square = np.zeros(len(signs)), 0.0
    for one in own:
        pairs = np.triu(one.products, 1) / (len(one.trials) * (len(one.trials) - 1))
        there = signs[:, [index[name] for name in one.trials]]
        total += np.einsum("bi,ij,bj->b", there, pairs, there)
        square += float(np.sum(pairs**2))
    return total / np.sqrt(square) if square > 0.0 else total


def _scatter_p_value(own: Sequence[RepeatedMisfit]) -> float:
    """P-value of the mean of repeats beside their scatter."""
    terms = np.array([one.mean_and_scatter() for one in own])
    mean, noise, squares, fewer = terms.sum(axis=0).tolist()
    if not noise > 0.0:
        return 0.0 if mean > 0.0 else 1.0
    return float(f_distribution.sf(mean / noise, noise**2 / squares, noise**2 / fewer))
