"""Read a user's measured CSV: a force map, a length-pressure loop, or force-displacement loops.

Which of the three a file is shows in its columns; each name carries its unit:

- force map: pressure (``p_kpa``, ``p_gauge_pa``, ``p_bar``), ``contraction`` or
  ``contraction_percent`` or ``length_mm``, and ``force_n``;
- length-pressure loop: pressure and ``length_cm``, perhaps ``branch`` (up, down) and ``repeat``;
- force-displacement loops: ``time_s``, ``force_n``, ``displacement_mm``, perhaps ``loop``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray, to_si
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.columns import Columns
from pamsim.recordings.recording_checks import HIGHEST_KPA, LARGEST, LEAST_KPA
from pamsim.recordings.table_reader import read_columns

_WORDS = ("branch", "repeat", "loop")
_MOST_CONTRACTION = 0.6
_MOST = {"force": LARGEST["n"][0], "length": 1e-3 * LARGEST["mm"][0]}
_MOST |= {"displacement": _MOST["length"]}
"""Quantity -> largest number [SI]; others are checked by what they are compared with."""

# Quantity -> what a column name begins with, the SI unit, an example.
_QUANTITIES: Mapping[str, tuple[str, str, str]] = {
    "pressure": ("p(?:ressure)?(?:_gauge)?", "Pa", "p_kpa"),
    "contraction": ("contraction|kappa", "1", "contraction_percent"),
    "length": ("length", "m", "length_mm"),
    "force": ("force", "N", "force_n"),
    "displacement": ("displacement", "m", "displacement_mm"),
    "time": ("time", "s", "time_s"),
}
_STEMS = "|".join(f"(?P<{quantity}>{stem})" for quantity, (stem, _, _) in _QUANTITIES.items())
_NAME = re.compile(f"(?:{_STEMS})(?:_(?P<unit>.*))?")
# Files write units in lower case, the unit library does not.
_SPELLED = {"kpa": "kPa", "pa": "Pa", "mpa": "MPa", "hpa": "hPa", "n": "N", "kn": "kN"}
_SPELLED |= {"ratio": "1"}


@dataclass(frozen=True, kw_only=True)
class ForceMap:
    """Static force over pressure and contraction."""

    pressure: FloatArray  # gauge, shape (n,) [Pa]
    contraction: FloatArray  # 1 - l/l0, shape (n,) [-]
    force: FloatArray  # shape (n,) [N]
    nominal_length: float | None  # l0 if the file or the user says it [m]
    notes: tuple[str, ...] = ()  # what was taken for granted, for the reader

    def without_zeros(self) -> ForceMap:
        """The map without points of no force, slack or not measured; InputError if none is left."""
        keep = self.force != 0.0
        if not np.any(keep):
            raise InputError("the map has no force but zero; there is nothing to fit")
        if np.all(keep):
            return self
        note = f"{np.sum(~keep)} points of zero force dropped: slack or not measured"
        kept = {name: getattr(self, name)[keep] for name in ("pressure", "contraction", "force")}
        return replace(self, **kept, notes=(*self.notes, note))


@dataclass(frozen=True, kw_only=True)
class LengthLoop:
    """Length while the pressure goes up and down."""

    pressure: FloatArray  # gauge, shape (n,) [Pa]
    length: FloatArray  # shape (n,) [m]
    # Whether each point belongs to the branch of rising pressure, shape (n,)
    rising: NDArray[np.bool_]
    notes: tuple[str, ...] = ()  # what was taken for granted, for the reader


@dataclass(frozen=True, kw_only=True)
class ForceLoops:
    """Force and displacement over time, one record per loop."""

    names: tuple[str, ...]  # of the loops
    time: tuple[FloatArray, ...]  # per loop, shape (n_i,) [s]
    force: tuple[FloatArray, ...]  # per loop, shape (n_i,) [N]
    displacement: tuple[FloatArray, ...]  # per loop, shape (n_i,) [m]
    notes: tuple[str, ...] = ()  # what was taken for granted, for the reader


def read_measured(
    path: Path, nominal_length: float | None = None
) -> ForceMap | LengthLoop | ForceLoops:
    """Read a force map, a length-pressure loop or force-displacement loops, in SI.

    ``nominal_length`` is l0 for a force map that gives lengths only [m].

    Raises:
        InputError: in one line: what `read_columns` refuses, missing quantities, a pressure
            or contraction that must be in another unit than the column's name says, lengths
            without a nominal length or at odds with the contraction beside them.
    """
    table = _Table(read_columns(path))
    if table.found.keys() & {"displacement", "time"}:
        return _force_loops(table)
    pressure = _pressure(table)
    if "force" in table.found:
        contraction, nominal = _contraction(table, nominal_length)
        return ForceMap(
            pressure=pressure,
            contraction=contraction,
            force=table.si("force"),
            nominal_length=nominal,
            notes=table.notes,
        )
    if "length" in table.found:
        return _length_loop(table, pressure)
    raise table.missing("force" if "contraction" in table.found else "length")


class _Table:
    """A file's columns by quantity; the unit may be any that measures the quantity."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        self.found: dict[str, tuple[str, float]] = {}  # quantity -> column, SI units in its unit
        self.words: dict[str, list[str]] = {}
        self.notes: tuple[str, ...] = ()
        for name, cells in columns.cells.items():
            match = _NAME.fullmatch(name.lower())
            if name.lower() in _WORDS:
                self.words[name.lower()] = [cell.lower() for cell in cells]
            elif match is None:
                self.notes += (f"column {name!r} is not used",)
            else:
                (quantity,) = (q for q in _QUANTITIES if match[q] is not None)
                self._add(quantity, name, match["unit"] or "")

    def _add(self, quantity: str, name: str, unit: str) -> None:
        place, (_, si_unit, example) = self.columns.place(name), _QUANTITIES[quantity]
        if quantity in self.found:
            raise InputError(f"{place}: there is {self.found[quantity][0]!r} already; keep one")
        if not unit and si_unit != "1":
            raise InputError(f"{place} has no unit; write it in the name: {example!r}")
        unit = _SPELLED.get(unit, unit or "1")
        self.found[quantity] = name, to_si(1.0, unit, si_unit, where=place)

    def si(self, quantity: str) -> FloatArray:
        """Values of a quantity, shape (n,) [SI]; InputError if it has no column."""
        if quantity not in self.found:
            raise self.missing(quantity)
        name, scale = self.found[quantity]
        numbers = self.columns.numbers(name)
        self.columns.refuse(
            np.abs(numbers) * scale > _MOST.get(quantity, np.inf),
            lambda i: (
                f"{name} = {numbers[i]:g} is more {quantity} than any muscle has; check the unit in"
                " the column's name"
            ),
        )
        return numbers * scale

    def missing(self, quantity: str) -> InputError:
        """The error for a quantity without a column."""
        return InputError(
            f"{self.columns.path}: no column for {quantity}; name one such as"
            f" {_QUANTITIES[quantity][2]!r} (there are: {', '.join(self.columns.cells)})"
        )


def _pressure(table: _Table) -> FloatArray:
    """The pressures, unless they can only be in another unit than the column's name states."""
    pressure, columns, name = table.si("pressure"), table.columns, table.found["pressure"][0]
    numbers = columns.numbers(name)
    columns.refuse(
        pressure < -ATMOSPHERE,
        lambda i: f"{name} = {numbers[i]:g} lies below vacuum; pressures are gauge",
    )
    if pressure.max() < 1e3 * LEAST_KPA:
        unit = name.lower().rpartition("_")[2]
        meant = "kpa" if unit == "pa" else "bar"
        raise InputError(
            f"{columns.path}: line {columns.lines[0]} and below: no {name!r} is above"
            f" {numbers.max():g} {unit}, too little for a muscle; if it is {meant}, name the column"
            f" 'p_{meant}'"
        )
    columns.refuse(
        pressure > 1e3 * HIGHEST_KPA,
        lambda i: (
            f"{name} = {numbers[i]:g} is {pressure[i] / 1e5:.4g} bar, too much for a muscle; check"
            " the unit in the column's name"
        ),
    )
    return pressure


def _contraction(table: _Table, nominal: float | None) -> tuple[FloatArray, float | None]:
    """Contraction of a force map, and the nominal length [m] if that is known."""
    refuse = table.columns.refuse
    length = table.si("length") if "length" in table.found else None
    if "contraction" not in table.found and length is not None:
        if nominal is None:
            raise InputError(
                f"{table.columns.path}: {table.found['length'][0]!r} needs the nominal length of"
                " the muscle; give `nominal_length`"
            )
        contraction = 1.0 - length / nominal
        beyond = f"of nominal {1e3 * nominal:.4g} mm is beyond any muscle; check both units"
        refuse(
            np.abs(contraction) > _MOST_CONTRACTION,
            lambda i: f"length {1e3 * length[i]:.4g} mm {beyond}",
        )
        return contraction, nominal
    contraction, (name, scale) = table.si("contraction"), table.found["contraction"]
    refuse(
        np.abs(contraction) > _MOST_CONTRACTION,
        lambda i: (
            f"{name} = {contraction[i] / scale:g} is {contraction[i]:.0%}, which no muscle reaches;"
            " if it is percent, name the column contraction_percent"
        ),
    )
    largest = float(np.abs(contraction).max())
    if scale != 1.0 and 0.0 < largest <= _MOST_CONTRACTION * scale:
        table.notes += (
            f"no {name} is above {largest / scale:.3g}: if it is a ratio, not percent, name the"
            " column contraction",
        )
    if length is not None:
        nominal = float(np.median(length / (1.0 - contraction))) if nominal is None else nominal
        disagree = (
            f"length and contraction disagree for a nominal length of {1e3 * nominal:.4g} mm;"
            " correct one of the columns or drop it"
        )
        odd = np.abs(1.0 - length / nominal - contraction)
        refuse((odd > 0.005) & (odd == odd.max()), lambda _: disagree)
    return contraction, nominal


def _length_loop(table: _Table, pressure: FloatArray) -> LengthLoop:
    branch, notes = table.words.get("branch"), table.notes
    if branch is None:
        rising = _rising(pressure)
        notes = (*notes, "no column 'branch': taken from whether the pressure rises or falls")
    else:
        rising, falling = (np.array([word == way for word in branch]) for way in ("up", "down"))
        table.columns.refuse(
            ~(rising | falling),
            lambda i: f"branch = {branch[i]!r}; {nearest(branch[i], ('up', 'down'))}",
        )
    return LengthLoop(pressure=pressure, length=table.si("length"), rising=rising, notes=notes)


def _rising(pressure: FloatArray) -> NDArray[np.bool_]:
    """Whether the pressure rises towards each point; held pressure goes on as before."""
    move = np.diff(pressure)
    moving = np.flatnonzero(move)
    if not moving.size:
        return np.ones(pressure.size, dtype=bool)
    # Where the pressure is held, its last move counts; before its first, the first to come.
    last = np.maximum.accumulate(np.where(move != 0.0, np.arange(move.size), moving[0]))
    steps = move[last] > 0.0
    return np.concatenate([steps[:1], steps])


def _force_loops(table: _Table) -> ForceLoops:
    label = np.array(table.words.get("loop", ["1"] * len(table.columns.lines)))
    names = tuple(dict.fromkeys(label.tolist()))
    records = {
        quantity: tuple(table.si(quantity)[label == name] for name in names)
        for quantity in ("time", "force", "displacement")
    }
    return ForceLoops(names=names, notes=table.notes, **records)
