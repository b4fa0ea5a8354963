"""What a fit of simulator parameters takes and returns: residuals, estimates, noise, status."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pamsim.core.encoding import NOT_IN_JSON, json_key, json_property
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.estimate import Estimate


@dataclass(frozen=True, kw_only=True)
class ResidualBlock:
    """Simulated minus measured, one channel of one trial."""

    trial: str  # name of the trial, or of a static table
    # Trials of the same one are repeats of each other; with the load, if some trials of the
    # protocol have another
    protocol: str
    channel: str  # such as ``angle``; blocks of the same channel share their noise
    # Shape (n,) [SI unit of the channel]. Its length must not depend on parameters
    residual: FloatArray
    # [s], or None for rows without an order in time (static table), which are taken as independent
    sample_interval: float | None = None
    # Standard deviation of the sensor noise if it is known [SI unit of the channel]
    noise_sd: float | None = None


Blocks = list[ResidualBlock]
Simulate = Callable[[FloatArray], Sequence[Blocks | None]]
"""Parameter vectors, shape (k, p) [parameter units], to the blocks of each. None, or a residual
that is not finite, means that the simulation diverged there. The blocks of all vectors must agree
in number, order and length."""


@dataclass(frozen=True)
class BlockPlace:
    """Where a block lies in the stacked residual."""

    block: ResidualBlock  # as first returned; its residual is that of the first simulation
    rows: slice  # its rows in the stack


def layout(blocks: Sequence[ResidualBlock]) -> tuple[BlockPlace, ...]:
    """Stack the blocks of a simulation one after the other.

    Raises:
        InputError: no blocks, an empty or badly shaped block, or a useless noise or interval.
    """
    if not blocks:
        raise InputError("nothing to calibrate to: the simulation returned no residuals")
    places: list[BlockPlace] = []
    end = 0
    for block in blocks:
        where = f"trial {block.trial}, channel {block.channel}"
        if block.residual.ndim != 1 or block.residual.size == 0:
            raise InputError(f"{where}: residual of shape {block.residual.shape} is not (n,)")
        for what, value in (("noise", block.noise_sd), ("interval", block.sample_interval)):
            if value is not None and not (np.isfinite(value) and value > 0.0):
                raise InputError(f"{where}: {what} {value!r} is not a positive number")
        places.append(BlockPlace(block, slice(end, end + block.residual.size)))
        end += block.residual.size
    return tuple(places)


def stacked(blocks: Blocks | None, places: tuple[BlockPlace, ...]) -> FloatArray | None:
    """The residual of one simulation, shape (n,), or None if it diverged.

    Raises:
        InputError: the blocks are not those of ``places``.
    """
    if blocks is None:
        return None
    same = len(blocks) == len(places) and all(
        (b.trial, b.channel, b.residual.size)
        == (p.block.trial, p.block.channel, p.block.residual.size)
        for b, p in zip(blocks, places, strict=True)
    )
    if not same:
        raise InputError(
            "simulations returned residuals of different layout; trial, channel and length of each"
            " block must not depend on the parameters"
        )
    vector = np.concatenate([block.residual for block in blocks])
    return vector if bool(np.all(np.isfinite(vector))) else None


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
