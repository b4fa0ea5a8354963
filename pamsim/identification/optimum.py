"""Where a fit of a linear model ended, and 95 % intervals of functions of its coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.special
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Estimate
from pamsim.inference.trial_noise import TrialNoise

_STEP = 6e-6  # the cube root of the rounding error, best for central differences
_SMALL = 1e-3  # below it a coordinate, of order 1 as a rule, counts as 0
_BOUNDLESS = float(np.log(1e6))  # half width of a logarithm: more is no interval

_quantile: Any = scipy.special.stdtrit


def student_quantile(freedom: float) -> float:
    """Return the half width of a 95 % interval in standard errors, of Student's t."""
    return float(_quantile(freedom, 0.975))


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """Where a fit ended."""

    coordinates: FloatArray  # shape ``(k,)``
    covariance: FloatArray | None  # shape ``(k, k)``; None if the data do not determine them
    quantile: float  # half width of a 95 % interval in standard errors
    settled: bool  # whether the optimiser stopped because it had converged
    noise: TrialNoise  # of the residuals
    # whether the estimates minimise the whitened error; otherwise they minimise the plain error,
    # and only the intervals use the noise model
    weighted: bool = False
    # p-value of weighted against unweighted estimates; None if not compared
    disagreement: float | None = None

    def moved(self, origin: FloatArray, matrix: FloatArray) -> Optimum:
        """Return it in coordinates that are ``origin + matrix @ coordinates``."""
        covariance = None if self.covariance is None else matrix @ self.covariance @ matrix.T
        return replace(self, coordinates=origin + matrix @ self.coordinates, covariance=covariance)

    def unit(self, i: int) -> FloatArray:
        """Return the gradient of coordinate i, shape ``(k,)``."""
        return np.eye(self.coordinates.size)[i]

    def ratio(self, i: int, j: int) -> tuple[float, FloatArray]:
        """Return coordinate i over coordinate j, and its gradient; both NaN where j is 0."""
        below = float(self.coordinates[j]) or np.nan
        value = float(self.coordinates[i]) / below
        return value, (self.unit(i) - value * self.unit(j)) / below

    def half_width(self, gradient: FloatArray) -> float | None:
        """Return the half width of the 95 % interval of a function with this gradient.

        None without a covariance, or of a gradient that does not exist.
        """
        if self.covariance is None or not np.all(np.isfinite(gradient)):
            return None
        variance = float(gradient @ self.covariance @ gradient)
        return self.quantile * float(np.sqrt(max(variance, 0.0)))

    def estimate(
        self, name: str, unit: str, value: float, gradient: FloatArray, *, positive: bool = False
    ) -> Estimate:
        """Return a function of the coordinates with its interval.

        With ``positive`` that is symmetric in the logarithm, of which the gradient is, shape
        ``(k,)``: from 0 to infinity where that is not known within a factor of a million.
        """
        half = self.half_width(gradient)
        interval = None
        if half is not None and positive:
            known = half < _BOUNDLESS
            factor = float(np.exp(half)) if known else np.inf
            interval = (value / factor, value * factor) if known else (0.0, np.inf)
        elif half is not None:
            interval = (value - half, value + half)
        return Estimate(name=name, unit=unit, value=value, interval95=interval)

    def half_widths(self, function: Callable[[FloatArray], NDArray[Any]]) -> NDArray[Any] | None:
        """Return half widths of the 95 % intervals of a function of the coordinates.

        Of complex values those of both parts; None without a covariance.
        """
        covariance = self.covariance
        if covariance is None:
            return None
        deviations = np.sqrt(np.diag(covariance))
        sizes = np.where(deviations > 0.0, deviations, _SMALL)  # what is held has none
        jacobian = central_differences(function, self.coordinates, sizes)

        def spread(part: FloatArray) -> FloatArray:
            return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", part, covariance, part), 0.0))

        if np.iscomplexobj(jacobian):
            return self.quantile * (spread(np.real(jacobian)) + 1j * spread(np.imag(jacobian)))
        return self.quantile * spread(jacobian)


def central_differences(
    function: Callable[[FloatArray], NDArray[Any]], at: FloatArray, sizes: FloatArray
) -> NDArray[Any]:
    """Return the Jacobian of a function from shape ``(k,)`` to ``(n,)``, shape ``(n, k)``.

    A step is a share of the coordinate or, where that is nearly 0, of a thousandth; or of its
    ``sizes``, shape ``(k,)``, where they are smaller, as of a dead time in nanoseconds.
    """
    if at.size == 0:
        return np.empty((function(at).size, 0))
    columns: list[NDArray[Any]] = []
    for i in range(at.size):
        step = np.zeros(at.size)
        step[i] = _STEP * max(abs(float(at[i])), min(float(sizes[i]), _SMALL))
        columns.append((function(at + step) - function(at - step)) / (2.0 * step[i]))
    return np.column_stack(columns)
