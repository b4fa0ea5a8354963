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
    """Where a running fit stands, reported after each Jacobian.

    Attributes:
        start: number of the start that is followed, from 0.
        starts: of how many.
        iteration: of this start.
        cost: mean square of the residuals in units of the noise.
    """

    start: int
    starts: int
    iteration: int
    cost: float


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """Noise of one channel.

    Attributes:
        standard_deviation: [SI unit of the channel].
        source: where it comes from.
        rms: root mean square residual over all trials [SI unit of the channel].
        rms_per_trial: trial -> root mean square residual [SI unit of the channel].
    """

    standard_deviation: float = field(metadata=json_key("noise_sd"))
    source: NoiseSource = field(metadata=json_key("noise_source"))
    rms: float
    rms_per_trial: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class StartReport:
    """Where one start ended.

    Attributes:
        start: values it began with [parameter units].
        end: values it ended with [parameter units].
        objective: -2 log likelihood up to a constant, priors included.
        converged: False if it ran out of simulations.
        iterations: Jacobians it took.
        same_optimum: True if its objective is that of the best start within 0.1.
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    objective: float
    converged: bool
    iterations: int
    same_optimum: bool


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """The simulator near the optimum, for what builds on a fit (intervals, screening).

    Attributes:
        places: the blocks and their rows.
        residual: simulated minus measured, shape (n,) [SI units of the channels].
        jacobian: change of the residual per change of each parameter's place in its range (0 to
            1, see `SearchScale`), shape (n, p).
        weight: 1 / noise standard deviation of each row, shape (n,).
    """

    places: tuple[BlockPlace, ...]
    residual: FloatArray
    jacobian: FloatArray
    weight: FloatArray


@dataclass(frozen=True, kw_only=True)
class SimulatorFit:
    """A simulator fitted to trials.

    Attributes:
        parameters: in the order given, with intervals and flags.
        covariance: of the values, shape (p, p) [products of parameter units]; NaN in rows and
            columns without an interval.
        correlation: the same scaled to 1 on the diagonal.
        determined: combinations that are determined although their members are not, as text.
        noise: channel -> noise and residual.
        status: whether to trust the numbers.
        sentence: the same for a person.
        interval_method: which intervals these are, for a person.
        objective: -2 log likelihood up to a constant, priors included.
        evaluations: simulated parameter vectors.
        calls: of the simulate callable; one for each Jacobian.
        iterations: Jacobians over all starts.
        diverged: simulated vectors that diverged inside the search.
        starts: where each start ended.
        linearisation: residual and Jacobian at the optimum.
    """

    parameters: tuple[Estimate, ...]
    covariance: FloatArray
    correlation: FloatArray
    determined: tuple[str, ...]
    noise: Mapping[str, ChannelNoise]
    status: FitStatus
    sentence: str
    interval_method: str
    objective: float
    evaluations: int
    calls: int
    iterations: int
    diverged: int
    starts: tuple[StartReport, ...]
    linearisation: Linearisation = field(metadata=NOT_IN_JSON)

    @property
    def values(self) -> FloatArray:
        """All values, shape (p,) [parameter units]."""
        return np.array([p.value for p in self.parameters])

    @json_property
    def same_optimum(self) -> int:
        """How many starts reached the best optimum."""
        return sum(start.same_optimum for start in self.starts)
