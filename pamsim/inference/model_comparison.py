"""Paired comparison of models by their losses on held-out units: sign flips.

Two models that predict equally well may exchange their losses on any unit, so that the difference
of the two is as likely with the other sign. A test flips the signs of whole units and counts how
often the flipped differences favour a model as much as those observed.

The null is exact for held-out units and models fitted elsewhere: a difference of squared residuals
is ``(a - b) (a + b)``, of which the first factor is no measurement. It is linear in the noise and
symmetric about its mean wherever the noise is, however skewed the losses are. If both models miss
something, and one is better on some units as the other is on others, flips overstate the scatter:
the test keeps its level and loses power. Differences that are skewed themselves, as where one unit
in many shows all that a model is better by, break it: of ``1 - e`` with e exponential, whose mean
is 0, 11 % are significant at 5 %, one-sided, at 5 and at 12 units.

Few units decide little, whatever the losses are. n units have 2^n sign patterns, so that the
smallest p-value is ``2^-n``: four units decide nothing at 5 %, five only if all agree. With five
units to ten the test is weak against an effect that is not seen in nearly all of them. Where there
are fewer trials, parts of trials are units if they are independent (`pamsim.inference.blocks.cut`).

Sources: F. Diebold and R. Mariano, Journal of Business and Economic Statistics 13 (1995), 3.2 (sign
tests of loss differences); B. Phipson and G. Smyth, Statistical Applications in Genetics and
Molecular Biology 9 (2010) (p-values that are never 0).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

DRAWN = 9_999
"""Sign patterns drawn where there are more in all (14 units and more): a p-value of 0.05 then has
a standard error of 0.002. The smallest p-value is 0.0001."""

_BLOCK = 500  # patterns at a time, so that many comparisons fit into memory
_ROUNDING = 1e-12  # relative difference of two statistics that counts as none


@dataclass(frozen=True, kw_only=True)
class Comparisons:
    """Result of k paired comparisons on the same units, each by itself.

    Attributes:
        gain: mean over the units of each difference, (k,) [unit of the losses].
        p_value: of a mean that is not above 0, (k,).
    """

    gain: FloatArray
    p_value: FloatArray


def fewest_units(alpha: float) -> int:
    """Fewest units of which a sign-flip test can reject anything at level alpha.

    Raises:
        InputError: alpha is not between 0 and 1, or below what drawn patterns can reach.
    """
    if not 1.0 / (DRAWN + 1) <= alpha < 1.0:
        raise InputError(f"alpha {alpha:g} is not between {1.0 / (DRAWN + 1):g} and 1")
    units = 1
    while _countable(units) and 2.0**-units > alpha:
        units += 1
    return units


def compare_with_reference(
    reference: FloatArray, losses: FloatArray, *, seed: int = 0
) -> Comparisons:
    """Which models predict better than a reference.

    Args:
        reference: (n,) losses of the reference on n held-out units.
        losses: (n, k) of the models, on the same units.
        seed: random seed of the sign patterns, where they are drawn.

    Raises:
        InputError: shapes that do not fit, or a loss that is not finite.
    """
    if losses.ndim != 2 or reference.shape != losses.shape[:1]:
        raise InputError(f"losses of shapes {reference.shape} and {losses.shape}, not (n,), (n, k)")
    return compare_paired(reference[:, np.newaxis] - losses, seed=seed)


def compare_paired(
    differences: FloatArray, *, covariance: FloatArray | None = None, seed: int = 0
) -> Comparisons:
    """Whether the mean of each difference is above 0.

    The statistic is the sum of a column over the root of its sum of squares, which is a function of
    Student's t that increases with it, the same one for all columns.

    Args:
        differences: (n, k) of k pairs of losses on n units, or other values whose sign is arbitrary
            if nothing is there, such as the scores of `pamsim.inference.projected_effect`.
        covariance: (k, n, n) of each column under noise alone, up to a factor, where units are not
            independent: each flipped sum is then compared in units of its own standard deviation.
        seed: random seed of the sign patterns, where they are drawn.

    Raises:
        InputError: not (n, k), or a value that is not finite.
    """
    if differences.ndim != 2 or 0 in differences.shape:
        raise InputError(f"differences of shape {differences.shape}, not (n units, k)")
    if not np.all(np.isfinite(differences)):
        raise InputError("a loss is not finite; leave out models that cannot be simulated")
    count = len(differences)
    scaled = standardised(differences)
    units = unit_order(scaled)
    scaled = scaled[units]
    if covariance is None:
        covariance = np.eye(count)[np.newaxis]
    spreads = _spreads(covariance[:, units][:, :, units])
    observed = scaled.sum(axis=0) / spreads(np.ones((1, count)))[0]
    limit = observed - _ROUNDING * math.sqrt(count)
    reached, patterns = np.zeros(observed.size), 0
    for signs in sign_patterns(count, np.random.default_rng(seed)):
        patterns += len(signs)
        reached += np.sum((signs @ scaled) / spreads(signs) >= limit, axis=0)
    return Comparisons(gain=differences.mean(axis=0), p_value=reached / patterns)


def standardised(differences: FloatArray) -> FloatArray:
    """Columns (n, k) with a sum of squares of 1, or 0 where all are 0."""
    largest = np.max(np.abs(differences), axis=0)
    scaled = differences / np.where(largest > 0.0, largest, 1.0)
    norms = np.linalg.norm(scaled, axis=0)
    return scaled / np.where(norms > 0.0, norms, 1.0)


def unit_order(scaled: FloatArray) -> NDArray[np.intp]:
    """Units in the order of their values (n, k), so that p-values do not depend on another."""
    keys = np.concatenate([np.sort(scaled), np.sort(np.abs(scaled))], axis=1)
    return np.lexsort(keys.T)


def _spreads(covariance: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Signs (b, n) to the deviation of flipped sums over that of independent units, (b, k)."""
    whole = np.maximum(np.trace(covariance, axis1=1, axis2=2), np.finfo(float).tiny)

    def ratio(signs: FloatArray) -> FloatArray:
        squares = np.stack([np.sum((signs @ c) * signs, axis=1) for c in covariance], axis=1)
        # A sum without variance is 0 but for rounding.
        return np.sqrt(np.maximum(squares / whole, _ROUNDING))

    return ratio


def sign_patterns(units: int, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Blocks of sign patterns, (b, units): all there are, or that observed and `DRAWN` others."""
    if _countable(units):
        for begin in range(0, 2**units, _BLOCK):
            numbers = np.arange(begin, min(begin + _BLOCK, 2**units))[:, np.newaxis]
            yield np.where((numbers >> np.arange(units)) & 1, -1.0, 1.0)
        return
    yield np.ones((1, units))
    yield from sign_flips(DRAWN, units, rng)


def sign_flips(count: int, size: int, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Random signs in blocks of shape (b, size), ``count`` rows in all."""
    for begin in range(0, count, _BLOCK):
        yield rng.choice([-1.0, 1.0], (min(_BLOCK, count - begin), size))


def upper_p_value(drawn: FloatArray, observed: float, *, scale: float | None = None) -> float:
    """One-sided p-value of a statistic.

    Args:
        drawn: (k,) the statistic under the null hypothesis.
        observed: the statistic of the data.
        scale: size of the numbers it was summed from, for rounding; its own size if left out.
    """
    limit = observed - _ROUNDING * (abs(observed) if scale is None else scale)
    return (1 + int(np.sum(drawn >= limit))) / (1 + drawn.size)


def _countable(units: int) -> bool:
    return 2**units <= DRAWN + 1
