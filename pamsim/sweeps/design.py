"""What a sweep varies, and which runs it makes: combinations, samples, a design for indices."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

import numpy as np
import scipy.stats
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError, nearest
from pamsim.core.limits import SWEEP_RUNS
from pamsim.core.toml_tables import NUMBER, Entry, check_table
from pamsim.core.units import FloatArray

_stats: Any = scipy.stats

Value: TypeAlias = float | str
"""Of a factor in one run: a number in the factor's unit, or text, such as the name of a rig."""

_MOST = 100_000
"""Most listed values of one factor."""


@dataclass(frozen=True, kw_only=True)
class Factor:
    """One varied quantity."""

    # Of a rig parameter, such as ``chamber.dead_volume``; of an effect, whose size is then in
    # typical sizes; ``load``, ``start_pressure_1``, ``final_1``; or ``rig``
    name: str
    unit: str  # of the values; empty for the usual one
    values: tuple[Value, ...] = ()  # listed; empty where there is a distribution
    distribution: Any = None  # frozen, of scipy.stats; None where values are listed

    def at(self, share: ArrayLike) -> FloatArray:
        """Values at shares in [0, 1) of the distribution, in the factor's unit."""
        found = np.asarray(self.distribution.ppf(share), dtype=float)
        if not np.all(np.isfinite(found)):
            raise InputError(
                f"vary.{self.name}: its distribution gives values that are not finite; check its"
                " numbers"
            )
        return found


def are_numbers(values: Sequence[Any]) -> bool:
    """Whether all of a list are finite numbers."""
    return all(FINITE.accepts(value) for value in values)


FINITE = Entry(NUMBER, "a finite number", holds=math.isfinite)
_UNIT = Entry(write='"...", such as "kPa"', default="")
_MANY = f"a list of 1 to {_MOST:,}"
_RIGS = {
    "values": Entry(
        list,
        f"{_MANY} names or folders of rigs",
        holds=lambda names: _few(names) and all(isinstance(name, str) for name in names),
    ),
}
_LISTED = {
    "values": Entry(
        list, f"{_MANY} numbers", holds=lambda values: _few(values) and are_numbers(values)
    ),
    "unit": _UNIT,
}
_RANGE = {
    "low": FINITE,
    "high": FINITE,
    "count": Entry(
        int, f"a whole number of 2 to {_MOST:,}", None, lambda count: 2 <= count <= _MOST
    ),
    "unit": _UNIT,
}


def _few(values: Sequence[Any]) -> bool:
    return 1 <= len(values) <= _MOST


def factor(name: str, table: Any) -> Factor:
    """A factor of a name as a study states it.

    Its table has ``values``; or ``low`` and ``high``, with ``count`` for evenly spaced values and
    without for a uniform distribution; or ``distribution``, a name of scipy.stats, with its
    parameters; and ``unit``. InputError for one that is none of these.
    """
    where = f"vary.{name}"
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table with values, low and high, or a distribution")
    if name == "rig":
        return Factor(name=name, unit="", values=tuple(check_table(table, _RIGS, where)["values"]))
    if "values" in table:
        stated = check_table(table, _LISTED, where)
        return Factor(name=name, unit=stated["unit"], values=tuple(map(float, stated["values"])))
    if "distribution" in table:
        return _drawn(name, table, where)
    if not {"low", "high"} <= table.keys():
        raise InputError(f"{where} needs values, low and high, or a distribution")
    stated = check_table(table, _RANGE, where)
    low, high, unit, count = (stated[key] for key in ("low", "high", "unit", "count"))
    if not low < high:
        raise InputError(f"{where}: low ({low:g}) must be below high ({high:g})")
    if count is None:
        return Factor(name=name, unit=unit, distribution=_stats.uniform(low, high - low))
    return Factor(name=name, unit=unit, values=tuple(np.linspace(low, high, count).tolist()))


def _drawn(name: str, table: Mapping[str, Any], where: str) -> Factor:
    """A factor with a distribution of scipy.stats."""
    known = {n for n in dir(_stats) if isinstance(getattr(_stats, n), _stats.rv_continuous)}
    of = table["distribution"]
    if not isinstance(of, str) or of not in known:
        raise InputError(f"{where}: no distribution {of!r}; {nearest(str(of), known)}")
    own = {"distribution": Entry(), "unit": _UNIT}
    numbers = check_table(table, dict.fromkeys(table, FINITE) | own, where)
    unit = numbers.pop("unit")
    del numbers["distribution"]
    try:
        found = getattr(_stats, of)(**numbers)
        middle = float(found.median())
    except TypeError as error:
        shapes = getattr(_stats, of).shapes
        takes = f"loc, scale{f', {shapes}' if shapes else ''}"
        raise InputError(f"{where}: {of} takes {takes}: {error}") from None
    if not math.isfinite(middle):
        raise InputError(f"{where}: {of} has no values with {numbers}; scale must be above 0")
    return Factor(name=name, unit=unit, distribution=found)


Runs = list[dict[str, Value]]
"""Factor -> value in its unit, of each run."""


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
        if runs:
            raise InputError(
                f"runs is {runs}; the runs of a design {design.value!r} follow from the values:"
                " leave runs out"
            )
        return [dict(zip(names, values, strict=True)) for values in _listed(design, factors)]
    listed = [f.name for f in factors if f.distribution is None]
    if listed:
        raise InputError(
            f"vary.{listed[0]} lists values; design {design.value!r} draws from distributions: give"
            " low and high, or a distribution"
        )
    if runs < 1:
        raise InputError(
            f"runs is {runs or 'missing or 0'}; a design {design.value!r} needs 1 or more"
        )
    if design is Design.SENSITIVITY and len(factors) < 2:
        raise InputError(
            f"only {names[0]} varies: a sensitivity design divides a variance among two factors or"
            " more; use design 'random'"
        )
    total = runs * (len(factors) + 2) if design is Design.SENSITIVITY else runs
    if total > SWEEP_RUNS:
        raise InputError(f"{total:,} runs; a sweep has {SWEEP_RUNS:,} at most")
    shares = _shares(design, len(factors), runs, seed)
    # An unbounded distribution has no value at 0 and 1.
    shares = np.clip(shares, 1e-12, 1.0 - 1e-12)
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
    """(n, count) shares from 0 to 1."""
    if design is Design.RANDOM:
        return np.random.default_rng(seed).random((runs, count))
    if design is Design.SOBOL:
        return _sobol(count, runs, seed)
    if runs < 2 or runs & (runs - 1):
        raise InputError(f"runs is {runs}; a sensitivity design needs a power of 2, such as 256")
    both = _sobol(2 * count, runs, seed)
    a, b = both[:, :count], both[:, count:]
    mixed = [np.where(np.arange(count) == i, b, a) for i in range(count)]
    return np.concatenate([a, b, *mixed])


def _sobol(count: int, runs: int, seed: int) -> FloatArray:
    sampler = _stats.qmc.Sobol(d=count, rng=np.random.default_rng(seed))
    with warnings.catch_warnings():
        # The balance of a whole power of 2 is no reason to refuse another number of runs.
        warnings.filterwarnings("ignore", "The balance properties of Sobol")
        return sampler.random(runs)
