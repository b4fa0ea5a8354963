"""What a fit of simulator parameters returns: estimates, noise, status, and how it got there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pamsim.core.encoding import NOT_IN_JSON, json_key, json_property
from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Estimate
from pamsim.inference.residual_block import BlockPlace


class FitStatus(StrEnum):
    """How far the numbers of a fit can be trusted."""

    CONVERGED = "converged"
    AT_BOUND = "at_bound"
    """A parameter ran into its range, which then decides, not the data."""
    NOT_IDENTIFIABLE = "not_identifiable"
    """The trials do not determine every parameter: only combinations of some."""
    NOT_CONVERGED = "not_converged"
    """The search ran out of simulations before it settled."""


class NoiseSource(StrEnum):
    """Where the standard deviation of a channel's noise comes from."""

    GIVEN = "given"
    REPEATS = "repeats"
    """Scatter between trials of the same protocol."""
    RESIDUAL = "residual"
    """Root mean square of what the fit leaves, model error included."""


@dataclass(frozen=True, kw_only=True)
class SearchProgress:
    """Where a running fit stands, reported after each Jacobian."""

    start: int  # number of the start that is followed, from 0
    starts: int  # of how many
    iteration: int  # of this start
    cost: float  # mean square of the residuals in units of the noise


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """Noise of one channel."""

    standard_deviation: float = field(metadata=json_key("noise_sd"))  # [SI unit of the channel]
    source: NoiseSource = field(metadata=json_key("noise_source"))  # where it comes from
    rms: float  # root mean square residual over all trials [SI unit of the channel]
    # Trial -> root mean square residual [SI unit of the channel]
    rms_per_trial: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class StartReport:
    """Where one start ended."""

    start: tuple[float, ...]  # values it began with [parameter units]
    end: tuple[float, ...]  # values it ended with [parameter units]
    objective: float  # -2 log likelihood up to a constant, priors included
    converged: bool  # False if it ran out of simulations
    iterations: int  # Jacobians it took
    same_optimum: bool  # True if its objective is that of the best start within 0.1


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """The simulator near the optimum, for what builds on a fit (intervals, screening)."""

    places: tuple[BlockPlace, ...]  # the blocks and their rows
    residual: FloatArray  # simulated minus measured, shape (n,) [SI units of the channels]
    # Change of the residual per change of each parameter's place in its range (0 to 1, see
    # `SearchScale`), shape (n, p)
    jacobian: FloatArray
    weight: FloatArray  # 1 / noise standard deviation of each row, shape (n,)


@dataclass(frozen=True, kw_only=True)
class SimulatorFit:
    """A simulator fitted to trials."""

    parameters: tuple[Estimate, ...]  # in the order given, with intervals and flags
    # Of the values, shape (p, p) [products of parameter units]; NaN in rows and columns without an
    # interval
    covariance: FloatArray
    correlation: FloatArray  # the same scaled to 1 on the diagonal
    # Combinations that are determined although their members are not, as text
    determined: tuple[str, ...]
    noise: Mapping[str, ChannelNoise]  # channel -> noise and residual
    status: FitStatus  # whether to trust the numbers
    sentence: str  # the same for a person
    interval_method: str  # which intervals these are, for a person
    objective: float  # -2 log likelihood up to a constant, priors included
    evaluations: int  # simulated parameter vectors
    calls: int  # of the simulate callable; one for each Jacobian
    iterations: int  # Jacobians over all starts
    diverged: int  # simulated vectors that diverged inside the search
    starts: tuple[StartReport, ...]  # where each start ended
    # Residual and Jacobian at the optimum
    linearisation: Linearisation = field(metadata=NOT_IN_JSON)

    @property
    def values(self) -> FloatArray:
        """All values, shape (p,) [parameter units]."""
        return np.array([p.value for p in self.parameters])

    @json_property
    def same_optimum(self) -> int:
        """How many starts reached the best optimum."""
        return sum(start.same_optimum for start in self.starts)
