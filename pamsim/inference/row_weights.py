"""Weight of each row of a fit to trials: in units of its channel's noise, priors beside it."""

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

    A row counts with the factor of its channel over the standard deviation of its noise.

    Args:
        residual: the simulator.
        parameters: p of them.
        noise: of the channels.
        weights: channel -> factor on its residuals in units of noise.
        frozen: True keeps the noise a search begins with.

    Attributes:
        priors: of the parameters, as rows.
    """

    def __init__(
        self,
        residual: BatchedResidual,
        parameters: Sequence[FreeParameter],
        noise: NoiseModel,
        weights: Mapping[str, float],
        *,
        frozen: bool = False,
    ) -> None:
        self.residual = residual
        self.noise = noise
        self.weights = weights
        self.frozen = frozen or noise.fixed
        self.priors = Priors(parameters, residual.scale)
        self._factor = np.concatenate(
            [
                np.full(p.block.residual.size, weights.get(p.block.channel, 1.0))
                for p in residual.places
            ]
        )

    def weight(self, noise: Mapping[str, float]) -> FloatArray:
        """Factor on each row, shape (n,) [1 / SI unit of the channel]."""
        return self._factor / self.noise.deviation(noise)

    def objective(self, place: FloatArray, noise: Mapping[str, float]) -> float:
        """-2 log likelihood up to a constant; infinite where the simulation diverges."""
        residual = self.residual.at(place)
        if residual is None:
            return np.inf
        logs = 2.0 * self._factor**2 * np.log(self.noise.deviation(noise))
        squares = (self.weight(noise) * residual) ** 2
        return float(np.sum(logs + squares) + np.sum(self.priors(place)[0] ** 2))
