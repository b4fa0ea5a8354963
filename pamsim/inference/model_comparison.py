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
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

DRAWN = 9_999
"""Sign patterns drawn where there are more in all (14 units and more): a p-value of 0.05 then has
a standard error of 0.002. The smallest p-value is 0.0001."""

_BLOCK = 500  # patterns at a time, so that they fit into memory
_ROUNDING = 1e-12  # relative difference of two statistics that counts as none


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


def compare_paired(
    differences: FloatArray, *, covariance: FloatArray | None = None, seed: int = 0
) -> tuple[float, float]:
    """The mean of some differences (n,), and the p-value of one that is not above 0.

    They are those of the losses of two models on n units, or other values whose sign is arbitrary
    if nothing is there, such as the scores of `pamsim.inference.row_tests`. The statistic is their
    sum over the root of their sum of squares, which is a function of Student's t that increases
    with it. Where units are not independent, ``covariance`` (n, n) is that of the differences under
    noise alone, up to a factor: flipped sums are then compared in units of their own standard
    deviation.

    Raises:
        InputError: not (n,), or a value that is not finite.
    """
    if differences.ndim != 1 or not differences.size:
        raise InputError(f"differences of shape {differences.shape}, not (n units,)")
    if not np.all(np.isfinite(differences)):
        raise InputError("a loss is not finite; leave out models that cannot be simulated")
    count = differences.size
    scaled = _standardised(differences)
    order = unit_order(scaled)
    scaled = scaled[order]
    own = None if covariance is None else covariance[np.ix_(order, order)]

    def statistic(signs: FloatArray) -> FloatArray:
        sums = signs @ scaled
        if own is None:
            return sums
        whole = max(float(np.trace(own)), np.finfo(float).tiny)
        squares = np.sum((signs @ own) * signs, axis=1)
        # A sum without variance is 0 but for rounding.
        return sums / np.sqrt(np.maximum(squares / whole, _ROUNDING))

    limit = statistic(np.ones((1, count))) - _ROUNDING * math.sqrt(count)
    drawn = [statistic(s) for s in sign_patterns(count, np.random.default_rng(seed))]
    return float(differences.mean()), float(np.mean(np.concatenate(drawn) >= limit))


def _standardised(differences: FloatArray) -> FloatArray:
    """Differences (n,) with a sum of squares of 1, or 0 where all are 0."""
    largest = float(np.max(np.abs(differences)))
    scaled = differences / (largest or 1.0)
    return scaled / (float(np.linalg.norm(scaled)) or 1.0)


def unit_order(values: FloatArray) -> NDArray[np.intp]:
    """Units in the order of their values (n,), so that p-values do not depend on another."""
    return np.lexsort((values, np.abs(values)))


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
    """One-sided p-value of an observed statistic, of which (k,) were drawn under the null.

    ``scale`` is the size of the numbers it was summed from, for rounding; its own size if left out.
    """
    limit = observed - _ROUNDING * (abs(observed) if scale is None else scale)
    return (1 + int(np.sum(drawn >= limit))) / (1 + drawn.size)


def _countable(units: int) -> bool:
    return 2**units <= DRAWN + 1
