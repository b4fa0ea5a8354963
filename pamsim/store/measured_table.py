"""Read a user's measured CSV: a force map, a length-pressure loop, or force-displacement loops.

Which of the three a file is shows in its columns; each name carries its unit:

- force map: pressure (``p_kpa``, ``p_gauge_pa``, ``p_bar``), ``contraction`` or
  ``contraction_percent`` or ``length_mm``, and ``force_n``;
- length-pressure loop: pressure and ``length_cm``, perhaps ``branch`` (up, down) and ``repeat``;
- force-displacement loops: ``time_s``, ``force_n``, ``displacement_mm``, perhaps ``loop``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.store.measured_columns import Columns, missing, plausible_pressure, read_columns

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ForceMap:
    """Static force over pressure and contraction.

    Attributes:
        pressure: gauge, shape (n,) [Pa].
        contraction: 1 - l/l0, shape (n,) [-].
        force: shape (n,) [N].
        nominal_length: l0 if the file or the user says it [m].
        notes: what was taken for granted, for the reader.
    """

    pressure: FloatArray
    contraction: FloatArray
    force: FloatArray
    nominal_length: float | None
    notes: tuple[str, ...] = ()

    def without_zeros(self) -> ForceMap:
        """The map without points of no force: there the muscle was slack or nothing was measured.

        Raises:
            InputError: if nothing is left.
        """
        keep = self.force != 0.0
        if not np.any(keep):
            raise InputError("the map has no force but zero; there is nothing to fit")
        dropped = int(np.sum(~keep))
        note = f"{dropped} points of zero force dropped: slack or not measured" if dropped else ""
        return replace(
            self,
            pressure=self.pressure[keep],
            contraction=self.contraction[keep],
            force=self.force[keep],
            notes=(*self.notes, *([note] if note else [])),
        )


@dataclass(frozen=True, kw_only=True)
class LengthLoop:
    """Length while the pressure goes up and down.

    Attributes:
        pressure: gauge, shape (n,) [Pa].
        length: shape (n,) [m].
        rising: whether each point belongs to the branch of rising pressure, shape (n,).
        notes: what was taken for granted, for the reader.
    """

    pressure: FloatArray
    length: FloatArray
    rising: NDArray[np.bool_]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ForceLoops:
    """Force and displacement over time, one record per loop.

    Attributes:
        names: of the loops.
        time: per loop, shape (n_i,) [s].
        force: per loop, shape (n_i,) [N].
        displacement: per loop, shape (n_i,) [m].
        notes: what was taken for granted, for the reader.
    """

    names: tuple[str, ...]
    time: tuple[FloatArray, ...]
    force: tuple[FloatArray, ...]
    displacement: tuple[FloatArray, ...]
    notes: tuple[str, ...] = ()


MeasuredTable: TypeAlias = ForceMap | LengthLoop | ForceLoops


def read_measured(path: Path, nominal_length: float | None = None) -> MeasuredTable:
    """Read a measured CSV.

    Args:
        path: of the file.
        nominal_length: l0 for a force map that gives lengths only [m].

    Returns:
        The table, in SI.

    Raises:
        InputError: in one line: what `read_columns` refuses, columns of no known kind, a pressure
            or contraction that must be in another unit than the column's name says, lengths
            without a nominal length or at odds with the contraction beside them.
    """
    columns = read_columns(path)
    have = set(columns.values)
    notes = [f"column {name!r} is not used" for name in columns.ignored]
    if "displacement" in have or "time" in have:
        return _force_loops(columns, notes)
    if "pressure" not in have:
        raise missing(columns, "pressure")
    plausible_pressure(columns)
    if "force" in have:
        return _force_map(columns, nominal_length, notes)
    if "length" in have:
        return _length_loop(columns, notes)
    raise missing(columns, "force" if "contraction" in have else "length")


def _force_map(columns: Columns, nominal: float | None, notes: list[str]) -> ForceMap:
    values = columns.values
    if "contraction" in values:
        contraction = values["contraction"]
        bad = np.flatnonzero(np.abs(contraction) > 0.6)
        if bad.size:
            raise InputError(
                f"{columns.path}: line {columns.lines[int(bad[0])]}: {columns.names['contraction']}"
                f" = {columns.written['contraction'][bad[0]]:g} is {contraction[bad[0]]:.0%}, which"
                " no muscle does; if it is percent, name the column contraction_percent"
            )
        if "length" in values:
            implied = values["length"] / (1.0 - contraction)
            nominal = float(np.median(implied)) if nominal is None else nominal
            odd = np.abs(1.0 - values["length"] / nominal - contraction)
            if np.max(odd) > 0.005:
                raise InputError(
                    f"{columns.path}: line {columns.lines[int(np.argmax(odd))]}: length and"
                    f" contraction disagree for a nominal length of {1e3 * nominal:.4g} mm; mend"
                    " one of the columns or drop it"
                )
    elif "length" not in values:
        raise missing(columns, "contraction")
    elif nominal is None:
        raise InputError(
            f"{columns.path}: {columns.names['length']!r} needs the nominal length of the muscle;"
            " give --nominal-length, such as 300mm"
        )
    else:
        contraction = 1.0 - values["length"] / nominal
        far = np.flatnonzero(np.abs(contraction) > 0.6)
        if far.size:
            raise InputError(
                f"{columns.path}: line {columns.lines[int(far[0])]}: length"
                f" {1e3 * values['length'][far[0]]:.4g} mm of nominal {1e3 * nominal:.4g} mm is"
                " beyond any muscle; check both units"
            )
    return ForceMap(
        pressure=values["pressure"],
        contraction=contraction,
        force=values["force"],
        nominal_length=nominal,
        notes=tuple(notes),
    )


def _length_loop(columns: Columns, notes: list[str]) -> LengthLoop:
    pressure = columns.values["pressure"]
    if "branch" in columns.words:
        for line, word in zip(columns.lines, columns.words["branch"], strict=True):
            if word not in ("up", "down"):
                hint = nearest(word, ("up", "down"))
                raise InputError(f"{columns.path}: line {line}: branch = {word!r}; {hint}")
        rising = np.array([word == "up" for word in columns.words["branch"]])
    else:
        rising = _rising(pressure)
        notes.append("no column 'branch': taken from whether the pressure rises or falls")
    return LengthLoop(
        pressure=pressure, length=columns.values["length"], rising=rising, notes=tuple(notes)
    )


def _rising(pressure: FloatArray) -> NDArray[np.bool_]:
    """Whether the pressure rises towards each point; held pressure goes on as before."""
    move = np.sign(np.diff(pressure))
    moving = np.flatnonzero(move)
    if not moving.size:
        return np.ones(pressure.size, dtype=bool)
    # Where the pressure is held, its last move counts; before its first, the first to come.
    last = np.maximum.accumulate(np.where(move != 0.0, np.arange(move.size), moving[0]))
    steps = move[last] > 0.0
    return np.concatenate([steps[:1], steps])


def _force_loops(columns: Columns, notes: list[str]) -> ForceLoops:
    for quantity in ("time", "force", "displacement"):
        if quantity not in columns.values:
            raise missing(columns, quantity)
    label = columns.words.get("loop", ["1"] * len(columns.lines))
    names = tuple(dict.fromkeys(label))
    rows = [np.flatnonzero(np.array(label) == name) for name in names]

    def parts(quantity: str) -> tuple[FloatArray, ...]:
        return tuple(columns.values[quantity][r] for r in rows)

    return ForceLoops(
        names=names,
        time=parts("time"),
        force=parts("force"),
        displacement=parts("displacement"),
        notes=tuple(notes),
    )
