"""Guess what the columns of a lab's log are, from their names, units and values.

A guess is certain where the name states quantity, unit, and joint or muscle. Otherwise a warning
states what it rests on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray, number_and_unit, to_si
from pamsim.physics.air import ATMOSPHERE
from pamsim.recordings.columns import Columns
from pamsim.recordings.signals import EFFORTS, JOINT_KINDS, SignalNames

_WORDS: Mapping[str, frozenset[str]] = {
    kind: frozenset(words.split())
    for kind, words in {
        "time": "t time timestamp clock zeit elapsed",
        "valve": "u valve pwm duty opening spool ventil",
        "pressure": "p pm press pressure druck",
        "force": "f fm force tension cell loadcell kraft pull",
        "torque": "torque tau moment drehmoment",
        "angle": "angle ang theta phi alpha beta q enc encoder winkel rotation position pos joint",
        "position": "position pos x travel displacement enc encoder stroke weg slide",
    }.items()
}
"""Kind of quantity -> words in the names of its columns, the most telling kind first."""

_SET = {"set", "setpoint", "sp", "cmd", "command", "commanded"}
_SET |= {"ref", "reference", "des", "desired", "target", "soll"}
_RATE = {"vel", "velocity", "speed", "rate", "dot", "omega", "acc", "accel"}
_PULSE = {"pwm", "duty"}
_ELSEWHERE = {"supply", "source", "tank", "reservoir", "ambient", "error", "err", "std"}
"""Words of what is no reading of a joint or muscle."""
_OF_CONVERTER = {"v", "mv", "volt", "volts", "ma", "counts", "ticks"}
"""Ends of names in units that only a calibration converts to those of a quantity."""

_SPELLINGS = {
    "time": "s ms us min sec=s seconds=s msec=ms µs=us",
    "pressure": "Pa hPa kPa MPa bar mbar psi atm barg=bar psig=psi kpag=kPa"
    " bara=bar psia=psi kpaa=kPa",
    "angle": "deg rad mrad degree=deg degrees=deg °=deg grad=deg radian=rad radians=rad",
    "position": "m mm cm um inch",
    "force": "N kN mN lbf kgf",
    "torque": "n*m=N*m nm=N*m n·m=N*m n.m=N*m",
    "valve": "percent %=percent",
}
_UNITS = {
    spelled.partition("=")[0].lower(): (spelled.rpartition("=")[2], kind)
    for kind, units in _SPELLINGS.items()
    for spelled in units.split()
}
"""Spelling in lower case -> unit of the unit library, and kind of quantity."""
_ABSOLUTE = frozenset(("bara", "psia", "kpaa"))
_CHUNK = re.compile(r"[_\s.:-]+")
_BRACKET = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$|\s*/\s*([^/]*?)\s*$")
_WORD = re.compile(r"[A-Z]?[a-zµ°%]+|[A-Z]+(?![a-z])|\d+")

_BY_SIZE: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "time": dict.fromkeys(("s", "ms", "us"), (1e-4, 0.25)),
    "pressure": dict.fromkeys(("kPa", "bar", "psi", "MPa", "Pa", "mbar"), (0.08, 1.3)),
    "angle": {"rad": (-1.0, 7.0), "deg": (1.0, math.inf)},
    "position": {"m": (-1.0, 1.0), "mm": (0.5, math.inf)},
    "force": {"N": (-1.0, math.inf)},
    "torque": {"N*m": (-1.0, math.inf)},
    "valve": {"1": (-1.0, 1.0), "percent": (1.0, 100.0)},
}
"""Kind -> unit -> what its size lies above, and not above: of the steps of a clock [s], of the
highest pressure as a share of the supply's, of the greatest number as written of all else."""
_NEAR_ATMOSPHERE = 0.06  # relative


@dataclass(frozen=True)
class Guess:
    """What a column is taken for."""

    quantity: str  # such as ``knee.angle``
    column: str  # in the log
    unit: str  # of its numbers
    sign: int = 1  # 1 or -1
    absolute: bool = False  # whether pressures count from vacuum
    times: str = ""  # factor with its unit, such as ``0.0069 m`` of a force that makes a torque
    wraps: float = 0.0  # time in its unit after which a clock begins again, 0 for one that runs on
    # What is not certain, and why; none if the name states everything
    warnings: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """Kind of its quantity, such as ``pressure`` of ``flexor.pressure_set``."""
        kind = self.quantity.rpartition(".")[2]
        return {"pressure_set": "pressure", "pulse": "valve"}.get(kind, kind)

    def seconds(self, where: str) -> float:
        """How long 1 in the column of a clock is, with its factor [s]."""
        factor, of_factor = number_and_unit(self.times or "1", where=where)
        return to_si(factor, f"{self.unit}*({of_factor or 1})", "s", where=where)


def guess_columns(
    columns: Columns,
    names: SignalNames,
    *,
    supply: float,
    stated: Sequence[Guess] = (),
    ignore: Sequence[str] = (),
) -> tuple[tuple[Guess, ...], dict[str, str]]:
    """Guess what each column of a log is: the guesses, and column -> why it is not used.

    Pressures lie below the gauge pressure of the rig's ``supply`` [Pa]. What the user has
    ``stated`` of some columns is taken over; the unit is guessed where it is empty. Columns to
    ``ignore`` are left out.

    Raises:
        InputError: if a stated or ignored column is not there, or a quantity is stated twice.
    """
    found: dict[str, Guess] = {}
    unused: dict[str, str] = {}
    for one in stated:
        columns.require(one.column, f" for {one.quantity}")
        if one.quantity in found:
            raise InputError(f"{one.quantity} is stated twice, as {one.column!r} the second time")
        words, unit, _ = _parts(one.column, columns.units.get(one.column, ""))
        found[one.quantity] = one if one.unit else _with_unit(one, words, unit)
    taken = {one.column for one in stated}
    for name in ignore:
        columns.require(name, " to ignore")
        unused[name] = "ignored"
    for name in (name for name in columns.cells if name not in taken and name not in unused):
        one = _by_name(columns, name, names)
        if not _all_numbers(columns, name, isinstance(one, Guess)):
            one = "not all of its cells are numbers"
        if isinstance(one, str):
            unused[name] = one
        elif one.quantity in found:
            unused[name] = f"would be {one.quantity}, which {found[one.quantity].column!r} is"
        else:
            found[one.quantity] = one
    guesses: list[Guess] = []
    for one in sorted(found.values(), key=lambda one: list(columns.cells).index(one.column)):
        if not one.unit:
            # Columns of one kind share their unit.
            same = [o for o in found.values() if o.kind == one.kind]
            known = [o for o in same if o.unit]
            if known:
                unit, warnings = known[0].unit, (f"unit {known[0].unit}, as {known[0].column}",)
            else:
                values = np.concatenate([columns.numbers(o.column) for o in same])
                unit, warnings = _unit_by_size(one.kind, values, supply)
            one = replace(one, unit=unit, warnings=(*one.warnings, *warnings))
        gauge = one.quantity.endswith(".pressure") and not one.absolute
        if gauge and one.column not in taken:
            lowest = to_si(float(columns.numbers(one.column).min()), one.unit, "Pa", where="")
            if abs(lowest - ATMOSPHERE) < _NEAR_ATMOSPHERE * ATMOSPHERE:
                never = "never below the atmosphere's pressure: absolute, or never vented"
                one = replace(one, warnings=(*one.warnings, never))
        guesses.append(one)
    return tuple(guesses), unused


def names_a_clock(column: str) -> bool:
    """Whether a column is the clock of a log by its name, such as ``t`` or ``Time [s]``."""
    words, _, _ = _parts(column, "")
    return bool(words) and words[0] in _WORDS["time"]


def unit_in_name(column: str, stated: str) -> str:
    """Unit of a column such as ``p1_kpa`` or ``Power (W)`` as its file writes it, else empty.

    What is ``stated`` in a line of units counts first. As no rig is known, ``u`` is an input in any
    unit, not a valve's opening.
    """
    _, unit, unknown = _parts(column, stated, any_input=True)
    return unknown or unit


def kind_of_unit(text: str) -> str:
    """Kind of quantity that a unit measures, such as ``pressure``; empty if it is not known."""
    return _UNITS.get(text.strip().lower(), ("", ""))[1]


def unit_of(text: str) -> tuple[str, bool]:
    """A unit as people write it, and whether pressures in it are absolute: ``psia``, ``bar``."""
    lower = text.strip().lower()
    return _UNITS.get(lower, (text.strip(), ""))[0], lower in _ABSOLUTE


def _all_numbers(columns: Columns, name: str, signal: bool) -> bool:
    """Whether all cells of a column are numbers.

    Raises:
        InputError: for one that is none in a signal, where most are: it is not left out silently.
    """
    try:
        columns.numbers(name)
    except InputError as error:
        if signal and 2 * sum(map(_is_number, columns.cells[name])) > columns.cells[name].count:
            raise InputError(f"{error}, or leave the column out with --ignore {name!r}") from None
        return False
    return True


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _by_name(columns: Columns, name: str, names: SignalNames) -> Guess | str:
    """What one column is by its name, or why it is not used."""
    words, unit, unknown = _parts(name, columns.units.get(name, ""))
    if columns.instants(name) is not None:
        unit, unknown = "s", ""
    kinds = _kinds(words, unit)
    if not kinds:
        return f"unit {unknown!r} is not known" if unknown else "name not known"
    if _RATE & set(words) or words[-2:] in (("rad", "s"), ("deg", "s")):
        return "a rate; rates follow from positions"
    if _ELSEWHERE & set(words) - set(_words([*names.joints, *names.muscles])):
        return "no reading of a joint or muscle by its name"
    if not unit and words[-1] in _OF_CONVERTER:
        unknown = words[-1]
    set_point = bool(_SET & set(words))
    for kind in kinds:
        owner, warning = ("time", "") if kind == "time" else _owner(kind, words, names)
        if not owner:
            continue
        if set_point and (kind in JOINT_KINDS or (kind == "force" and owner in names.muscles)):
            return f"a reference for {owner}, which drives no muscle by itself"
        own = "pressure_set" if kind == "pressure" and set_point else kind
        own = "pulse" if kind == "valve" and _PULSE & set(words) else own
        quantity = owner if kind == "time" else f"{owner}.{own}"
        if unknown:
            return f"would be {quantity}, but its unit {unknown!r} is not known"
        warnings = (warning,) if warning else ()
        return _with_unit(Guess(quantity, name, "", warnings=warnings), words, unit)
    return f"{kinds[0]} of no joint or muscle that its name states"


def _with_unit(one: Guess, words: Sequence[str], unit: str) -> Guess:
    known, absolute = unit_of(unit)
    from_vacuum = "abs" in words and one.kind == "pressure"  # and not an absolute encoder
    return replace(one, unit=known, absolute=absolute or from_vacuum)


def _parts(column: str, unit: str, *, any_input: bool = False) -> tuple[tuple[str, ...], str, str]:
    """Words of a column's name, its unit in lower case, and a unit that means nothing here.

    With ``any_input`` what a valve is called may be in any unit: ``u_kpa``.
    """
    bracket = _BRACKET.search(column)
    stem = column[: bracket.start()] if bracket else column
    stated = unit or (next(g for g in bracket.groups() if g is not None) if bracket else "")
    chunks = [chunk for chunk in _CHUNK.split(stem) if chunk]
    last = "" if stated or len(chunks) < 2 else chunks[-1].lower()
    if last in _UNITS:
        kinds = _kinds(_words(chunks[:-1]), last)
        if kinds == [_UNITS[last][1]] or (any_input and kinds == ["valve"]):
            stated = chunks.pop()
    known = stated.lower() in _UNITS
    return _words(chunks), stated.lower() if known else "", "" if known else stated


def _words(chunks: Sequence[str]) -> tuple[str, ...]:
    return tuple(word.lower() for word in _WORD.findall(" ".join(chunks)))


def _kinds(words: Sequence[str], unit: str) -> list[str]:
    """Kinds of quantity that a name may mean, the likeliest first."""
    by_word = [
        kind
        for kind, own in _WORDS.items()
        if own & set(words) and not (kind == "time" and any(word.isdigit() for word in words))
    ]
    own = [_UNITS[unit][1]] if unit else by_word
    return own if not by_word or own[0] in by_word else by_word


def _owner(kind: str, words: Sequence[str], names: SignalNames) -> tuple[str, str]:
    """Joint or muscle whose quantity of a kind a name means, and the warning about it."""
    of_joints = [joint for joint, own in names.joints.items() if kind in (own, EFFORTS[own])]
    # A force is a muscle's unless it names a joint that slides.
    named = [joint for joint in of_joints if set(_words([joint])) & set(words)]
    owners = of_joints if kind in (*JOINT_KINDS, "torque") else named or names.muscles
    if len(owners) == 1:
        return owners[0], ""
    parts = {owner: _words([owner]) for owner in owners}

    def fits(part: str) -> bool:
        # A word of two letters or more may stand for a longer one.
        return any(w == part or (len(w) > 1 and part.startswith(w)) for w in words)

    shared = {owner: sum(map(fits, own)) for owner, own in parts.items()}
    best = [owner for owner in owners if shared[owner] == max(shared.values())]
    if len(best) == 1:
        common = set.intersection(*map(set, parts.values()))
        whole = set(parts[best[0]]) - common <= set(words)
        return best[0], "" if whole else f"{best[0]} is what its name fits best"
    digits = [int(word) for word in words if word.isdecimal()]
    letters = [ord(word) - ord("a") + 1 for word in words if re.fullmatch("[a-d]", word)]
    number = next(iter(digits or letters), 0)
    if 1 <= number <= len(owners):
        return owners[number - 1], f"number {number} in the rig's order is {owners[number - 1]}"
    return "", ""


def _unit_by_size(kind: str, values: FloatArray, supply: float) -> tuple[str, tuple[str, ...]]:
    """Unit that numbers of a kind may be in, and the warning about it."""
    if kind != "time":
        size = float(np.abs(values).max())
    elif values.size < 2 or not (size := float(np.median(np.diff(values)))):
        size = float(np.ptp(values)) / values.size  # one row, or most repeat a time stamp

    def fits(unit: str, above: float, most: float) -> bool:
        si_unit, scale = {"time": ("s", 1.0), "pressure": ("Pa", supply)}.get(kind, (unit, 1.0))
        return above < to_si(size, unit, si_unit, where=unit) / scale <= most

    usual = _BY_SIZE[kind]
    fitting = [unit for unit, bounds in usual.items() if fits(unit, *bounds)]
    unit, *others = fitting or list(usual)
    if len(fitting) > 1:
        return unit, (f"unit {unit} by its size, or {' or '.join(others)}",)
    certain = kind in ("valve", "time") and fitting
    return unit, () if certain else (f"unit {unit} by its size",)
