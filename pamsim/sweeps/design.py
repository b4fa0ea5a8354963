"""Which runs a sweep makes: every combination, samples, or a design for Sobol' indices."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from scipy.stats import qmc

from pamsim.core.errors import InputError
from pamsim.core.limits import SWEEP_RUNS
from pamsim.core.units import FloatArray
from pamsim.sweeps.factor import Factor, Value

Runs = list[dict[str, Value]]
"""Factor -> value in its unit, of each run."""

_qmc: Any = qmc


class Design(StrEnum):
    """Kinds of design."""

    GRID = "grid"
    """Every combination of listed values."""
    ROWS = "rows"
    """The listed values row by row: the first of each factor, the second of each, ..."""
    RANDOM = "random"
    """Independent draws."""
    SOBOL = "sobol"
    """A scrambled Sobol' sequence: fills the space more evenly than random draws."""
    SENSITIVITY = "sensitivity"
    """Saltelli's design, from which Sobol' indices follow: ``runs`` x (factors + 2) runs."""


def runs_of(design: Design, factors: Sequence[Factor], runs: int, seed: int) -> Runs:
    """The runs of a design, in their order.

    Args:
        design: which.
        factors: what varies.
        runs: of a random or Sobol' design; the base sample of a sensitivity design, a power of 2.
        seed: of the draws.

    Raises:
        InputError: if the factors or the number of runs do not fit the design.
    """
    if not factors:
        raise InputError("nothing varies: give one table vary.NAME or more")
    names = [f.name for f in factors]
    if design in (Design.GRID, Design.ROWS):
        return [dict(zip(names, values, strict=True)) for values in _listed(design, factors)]
    listed = [f.name for f in factors if f.distribution is None]
    if listed:
        raise InputError(
            f"vary.{listed[0]} lists values; design {design.value!r} draws from distributions: give"
            " low and high, or a distribution"
        )
    if runs < 1:
        raise InputError(f"runs is {runs}; a design {design.value!r} needs 1 or more")
    shares = _shares(design, len(factors), runs, seed)
    if shares.shape[0] > SWEEP_RUNS:
        raise InputError(f"{shares.shape[0]:,} runs; a sweep has {SWEEP_RUNS:,} at most")
    columns = [f.at(shares[:, i]).tolist() for i, f in enumerate(factors)]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def _listed(design: Design, factors: Sequence[Factor]) -> Iterable[tuple[Value, ...]]:
    drawn = [f.name for f in factors if f.distribution is not None]
    if drawn:
        raise InputError(
            f"vary.{drawn[0]} is a distribution; design {design.value!r} needs listed values: give"
            " values, or low, high and count"
        )
    if design is Design.ROWS:
        if len({len(f.values) for f in factors}) > 1:
            counts = ", ".join(f"{f.name} {len(f.values)}" for f in factors)
            raise InputError(f"design 'rows' needs as many values of each factor; here: {counts}")
        return zip(*(f.values for f in factors), strict=True)
    total = math.prod(len(f.values) for f in factors)
    if total > SWEEP_RUNS:
        raise InputError(f"{total:,} combinations; a sweep has {SWEEP_RUNS:,} at most")
    return itertools.product(*(f.values for f in factors))


def _shares(design: Design, count: int, runs: int, seed: int) -> FloatArray:
    """(n, count) shares in (0, 1)."""
    if design is Design.RANDOM:
        return _inside(np.random.default_rng(seed).random((runs, count)))
    if design is Design.SOBOL:
        return _inside(_sobol(count, runs, seed))
    if runs < 2 or runs & (runs - 1):
        raise InputError(f"runs is {runs}; a sensitivity design needs a power of 2, such as 256")
    both = _sobol(2 * count, runs, seed)
    a, b = both[:, :count], both[:, count:]
    mixed = [np.where(np.arange(count) == i, b, a) for i in range(count)]
    return _inside(np.concatenate([a, b, *mixed]))


def _sobol(count: int, runs: int, seed: int) -> FloatArray:
    sampler = _qmc.Sobol(d=count, rng=np.random.default_rng(seed))
    with warnings.catch_warnings():
        # The balance of a whole power of 2 is no reason to refuse another number of runs.
        warnings.filterwarnings("ignore", "The balance properties of Sobol")
        return sampler.random(runs)


def _inside(shares: FloatArray) -> FloatArray:
    """Shares kept off 0 and 1, where an unbounded distribution has no value."""
    return np.clip(shares, 1e-12, 1.0 - 1e-12)
