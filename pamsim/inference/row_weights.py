"""Rows of a fit to trials: in units of their channels' noise, priors beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.free_parameter import FreeParameter, SearchScale
from pamsim.inference.noise_model import NoiseModel


class Priors:
    """Priors of parameters as m rows of a least-squares problem.

    Args:
        parameters: p of them.
        scale: of their places.
    """

    def __init__(self, parameters: Sequence[FreeParameter], scale: SearchScale) -> None:
        self._scale = scale
        known = [(i, p.prior) for i, p in enumerate(parameters) if p.prior is not None]
        self._which = np.array([i for i, _ in known], dtype=np.intp)
        self._mean = np.array([prior.mean for _, prior in known])
        self._spread = np.array([prior.standard_deviation for _, prior in known])

    def __call__(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, shape (m,), and their Jacobian per range, shape (m, p)."""
        values, slope = self._scale.from_unit(place), self._scale.slope(place)
        jacobian = np.zeros((self._which.size, place.size))
        jacobian[np.arange(self._which.size), self._which] = slope[self._which] / self._spread
        return (values[self._which] - self._mean) / self._spread, jacobian


class RowWeights:
    """Cost of a fit to trials: residual rows in units of noise, and priors.

    Args:
        residual: the simulator, its blocks known.
        parameters: p of them.
        first: residual at the first start, shape (n,).
        frozen: True keeps the noise a search begins with.

    Attributes:
        noise: of the channels.
        priors: of the parameters, as m rows.
    """

    def __init__(
        self,
        residual: BatchedResidual,
        parameters: Sequence[FreeParameter],
        first: FloatArray,
        *,
        frozen: bool = False,
    ) -> None:
        self.residual = residual
        self.noise = NoiseModel(residual.places, first)
        self.frozen = frozen or self.noise.fixed
        self.priors = Priors(parameters, residual.scale)

    def weight(self, noise: Mapping[str, float]) -> FloatArray:
        """1 / standard deviation of each row's noise, shape (n,) [1 / SI unit of the channel]."""
        return 1.0 / self.noise.deviation(noise)

    def miss(self, place: FloatArray, weight: FloatArray) -> FloatArray | None:
        """Weighted residual and priors, shape (n + m,); None where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return None
        return np.concatenate([weight * residual, self.priors(place)[0]])

    def columns(self, place: FloatArray, weight: FloatArray, jacobian: FloatArray) -> FloatArray:
        """Jacobian of `miss`, shape (n + m, p), from that of the residual per range, (n, p)."""
        return np.vstack([weight[:, np.newaxis] * jacobian, self.priors(place)[1]])

    def objective(self, place: FloatArray, noise: Mapping[str, float]) -> float:
        """-2 log likelihood up to a constant; infinite where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return np.inf
        logs = 2.0 * np.log(self.noise.deviation(noise))
        squares = (self.weight(noise) * residual) ** 2
        return float(np.sum(logs + squares) + np.sum(self.priors(place)[0] ** 2))
