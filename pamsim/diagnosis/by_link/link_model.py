"""A rig with some effects, as it was fitted to the links of recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.core.units import FloatArray
from pamsim.inference.projection import as_columns


@dataclass(frozen=True, kw_only=True)
class LinkModel:
    """A rig with some effects, after their fit."""

    effects: tuple[Candidate, ...]  # that it has
    # Of nuisance parameters in each link, and of the effects' parameters [SI]
    values: Mapping[str, float]
    # Of all links and trials, (n,) [SI]; of trials that no fit needs it is that of the rig as it is
    residual: FloatArray
    # Of the residual, by which it is that of shorter time steps, (n,) [SI]. Simulations about this
    # model have the same added: long steps get right what parameters change, not what a large
    # effect does
    offset: FloatArray
    rows: FloatArray  # of the fitted units, whitened, (f,)
    # Change of the rows with each parameter, in units of its `LinkFitter.scale`, (f,)
    sensitivities: Mapping[str, FloatArray]

    @property
    def cost(self) -> float:
        """Sum of squares of the whitened rows."""
        return float(self.rows @ self.rows)

    @property
    def criterion(self) -> float:
        """Of two models that with the smaller is preferred (Schwarz, Annals of Statistics 6, 1978).

        Every parameter of an effect costs the logarithm of the number of rows: of two formulas that
        fit as well the one with fewer parameters is taken.
        """
        return self.cost + len(self.freed) * float(np.log(self.rows.size))

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects, with their places."""
        return frozenset(effect.name for effect in self.effects)

    @property
    def labels(self) -> frozenset[str]:
        """The effects, with their forms."""
        return frozenset(effect.label for effect in self.effects)

    @property
    def freed(self) -> frozenset[str]:
        """Parameters of the effects."""
        return frozenset(p.name for effect in self.effects for p in effect.parameters)

    def jacobian(self) -> FloatArray:
        """Sensitivities as columns, (f, p)."""
        return as_columns(self.sensitivities.values(), self.rows.size)
