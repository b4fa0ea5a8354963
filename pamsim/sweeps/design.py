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
from pamsim.core.units import FloatArray

_stats: Any = scipy.stats

Value: TypeAlias = float | str
"""Of a factor in one run: a number in the factor's unit, or text, such as the name of a rig."""

_MOST = 100_000
"""Most listed values of one factor."""


@dataclass(frozen=True, kw_only=True)
class Factor:
    """One varied quantity.

    Attributes:
        name: of a rig parameter, such as ``chamber.dead_volume``; of an effect, whose size is then
            in typical sizes; ``load``, ``start_pressure_1``, ``final_1``; or ``rig``.
        unit: of the values; empty for the usual one.
        values: listed; empty where there is a distribution.
        distribution: frozen, of scipy.stats; None where values are listed.
    """

    name: str
    unit: str
    values: tuple[Value, ...] = ()
    distribution: Any = None

    def at(self, share: ArrayLike) -> FloatArray:
        """Values at shares in [0, 1) of the distribution, in the factor's unit."""
        found = np.asarray(self.distribution.ppf(share), dtype=float)
        if not np.all(np.isfinite(found)):
            raise InputError(
                f"vary.{self.name}: its distribution gives values that are not finite; check its"
                " numbers"
            )
        return found


def factor(name: str, table: Any) -> Factor:
    """A factor as a study states it.

    Args:
        name: of the factor.
        table: ``values``; or ``low`` and ``high``, with ``count`` for evenly spaced values and
            without for a uniform distribution; or ``distribution``, a name of scipy.stats, with
            its parameters; and ``unit``.

    Raises:
        InputError: for a table that is none of these.
    """
    where = f"vary.{name}"
    if not isinstance(table, Mapping):
        raise InputError(f"{where} must be a table with values, low and high, or a distribution")
    rest = {str(key): value for key, value in table.items()}
    rig = name == "rig"
    unit = "" if rig else rest.pop("unit", "")
    if not isinstance(unit, str):
        raise InputError(f"{where}.unit must be text, such as 'kPa'")
    if rig and "values" not in rest:
        raise InputError(f"{where} needs values: names or folders of rigs")
    if "values" in rest:
        listed = _listed_values(where, rest.pop("values"), text=rig)
        _nothing_left(where, rest)
        return Factor(name=name, unit=unit, values=listed)
    if "distribution" in rest:
        return Factor(name=name, unit=unit, distribution=_frozen(where, rest))
    if not {"low", "high"} <= set(rest):
        raise InputError(f"{where} needs values, low and high, or a distribution")
    low, high = (number(f"{where}.{end}", rest.pop(end)) for end in ("low", "high"))
    if not low < high:
        raise InputError(f"{where}: low ({low:g}) must be below high ({high:g})")
    if "count" not in rest:
        _nothing_left(where, rest)
        return Factor(name=name, unit=unit, distribution=_stats.uniform(low, high - low))
    count = rest.pop("count")
    if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= _MOST:
        raise InputError(f"{where}.count is {count!r}; it must be a whole number of 2 to {_MOST:,}")
    _nothing_left(where, rest)
    return Factor(name=name, unit=unit, values=tuple(np.linspace(low, high, count).tolist()))


def _listed_values(where: str, values: Any, *, text: bool) -> tuple[Value, ...]:
    if not isinstance(values, list) or not 1 <= len(values) <= _MOST:
        raise InputError(f"{where}.values must be a list of 1 to {_MOST:,} values")
    if not text:
        return tuple(number(f"{where}.values", value) for value in values)
    if not all(isinstance(value, str) for value in values):
        raise InputError(f"{where}.values must be names or folders of rigs")
    return tuple(values)


def _frozen(where: str, rest: dict[str, Any]) -> Any:
    """A distribution of scipy.stats with its parameters."""
    name = rest.pop("distribution")
    known = {n for n in dir(_stats) if isinstance(getattr(_stats, n), _stats.rv_continuous)}
    if not isinstance(name, str) or name not in known:
        raise InputError(f"{where}: no distribution {name!r}; {nearest(str(name), known)}")
    numbers = {key: number(f"{where}.{key}", value) for key, value in rest.items()}
    try:
        found = getattr(_stats, name)(**numbers)
        middle = float(found.median())
    except TypeError as error:
        shapes = getattr(_stats, name).shapes
        takes = f"loc, scale{f', {shapes}' if shapes else ''}"
        raise InputError(f"{where}: {name} takes {takes}: {error}") from None
    if not math.isfinite(middle):
        raise InputError(f"{where}: {name} has no values with {numbers}; scale must be above 0")
    return found


def number(where: str, value: Any) -> float:
    """A finite number of a study; an `InputError` with its key if it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where} is {value!r}; it must be a number")
    return float(value)


def _nothing_left(where: str, rest: Mapping[str, Any]) -> None:
    if rest:
        raise InputError(f"{where}: {', '.join(sorted(rest))} cannot be used there")


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
