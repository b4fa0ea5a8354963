"""Residuals of a simulation against trials, as calibration sees them: blocks of one channel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray


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
