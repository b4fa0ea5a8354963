"""Guess what the columns of a lab's log are, from their names, units and values.

A guess is certain where the name states quantity, unit, and joint or muscle. Otherwise a warning
states what it rests on.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray, to_si
from pamsim.recordings.columns import Columns
from pamsim.recordings.log_columns import ATMOSPHERE
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
_LEAST_PREFIX = 2  # letters by which a word may stand for a longer one

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

_BY_VALUE: Mapping[str, tuple[str, ...]] = {
    "time": ("s", "ms", "us"),
    "pressure": ("kPa", "bar", "psi", "MPa", "Pa", "mbar"),
    "angle": ("rad", "deg"),
    "position": ("m", "mm"),
    "force": ("N",),
    "torque": ("N*m",),
    "valve": ("1", "percent"),
}
_STEPS = (1e-4, 0.25)  # usual steps of a log's clock [s]
_NEAR_ATMOSPHERE = 0.06  # relative
_TURN = 7.0  # rad that no joint of such rigs turns by


@dataclass(frozen=True, kw_only=True)
class Guess:
    """What a column is taken for.

    Attributes:
        quantity: such as ``knee.angle``.
        column: in the log.
        unit: of its numbers.
        sign: 1 or -1.
        absolute: whether pressures count from vacuum.
        warnings: what is not certain, and why; none if the name states everything.
    """

    quantity: str
    column: str
    unit: str
    sign: int = 1
    absolute: bool = False
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Column:
    """What a column is by its name, or as stated; the warning may be empty.

    Attributes:
        words: of its name, in lower case, without the unit.
        unit: as the name or the line of units writes it, in lower case; empty if none is known.
    """

    quantity: str
    kind: str
    name: str
    words: tuple[str, ...]
    unit: str
    values: FloatArray
    warning: str = ""


def guess_columns(
    columns: Columns, names: SignalNames, *, supply: float, stated: Sequence[Guess] = ()
) -> tuple[tuple[Guess, ...], dict[str, str]]:
    """Guess what each column of a log is.

    Args:
        columns: of the log.
        names: of the rig's signals.
        supply: gauge pressure of the rig's supply, below which its pressures lie [Pa].
        stated: what the user states of some; the unit is guessed where it is empty.

    Returns:
        What is stated and the guesses, and column -> why it is not used.

    Raises:
        InputError: if a stated column is not there, or a quantity is stated twice.
    """
    found: dict[str, _Column] = {}
    unused: dict[str, str] = {}
    for one in stated:
        columns.require(one.column, f" for {one.quantity}")
        if one.quantity in found:
            raise InputError(f"{one.quantity} is stated twice, as {one.column!r} the second time")
        kind = one.quantity.rpartition(".")[2]
        words, unit, _ = _parts(one.column, columns.units.get(one.column, ""))
        found[one.quantity] = _Column(
            quantity=one.quantity,
            kind={"pressure_set": "pressure", "pulse": "valve"}.get(kind, kind),
            name=one.column,
            words=words,
            unit=unit,
            values=columns.numbers(one.column),
        )
    for name in columns.cells:
        if any(name == one.column for one in stated):
            continue
        one = _by_name(columns, name, names)
        if isinstance(one, str):
            unused[name] = one
        elif one.quantity in found:
            unused[name] = f"would be {one.quantity}, which {found[one.quantity].name!r} is"
        else:
            found[one.quantity] = one
    order = sorted(found.values(), key=lambda one: list(columns.cells).index(one.name))
    by_quantity = {one.quantity: one for one in stated}
    return tuple(_guess(one, order, supply, by_quantity.get(one.quantity)) for one in order), unused


def unit_in_name(column: str, stated: str) -> str:
    """Unit of a column as its file writes it.

    Args:
        column: name, such as ``p1_kpa``, ``Power (W)``, ``phi [deg]`` or ``p / bar``.
        stated: in a line of units, which counts first; empty if there is none.

    Returns:
        The unit; empty if there is none, or if a name ends in no unit that is known.
    """
    _, unit, unknown = _parts(column, stated)
    return unknown or unit


def kind_of_unit(text: str) -> str:
    """Kind of quantity that a unit measures, such as ``pressure``; empty if it is not known."""
    return _UNITS.get(text.strip().lower(), ("", ""))[1]


def unit_of(text: str) -> tuple[str, bool]:
    """A unit as people write it, and whether pressures in it are absolute: ``psia``, ``bar``."""
    lower = text.strip().lower()
    return _UNITS.get(lower, (text.strip(), ""))[0], lower in _ABSOLUTE


def _by_name(columns: Columns, name: str, names: SignalNames) -> _Column | str:
    """What one column is by its name, or why it is not used."""
    words, unit, unknown = _parts(name, columns.units.get(name, ""))
    try:
        values = columns.numbers(name)
    except InputError:
        return "not all of its cells are numbers"
    kinds = _kinds(words, unit)
    if not kinds:
        return f"unit {unknown!r} is not known" if unknown else "name not known"
    if _RATE & set(words):
        return "a rate; rates follow from positions"
    is_set = bool(_SET & set(words))
    for kind in kinds:
        quantity, warning = "time", ""
        if kind != "time":
            owner, warning = _owner(words, _owners(kind, words, names))
            if not owner:
                continue
            if kind in JOINT_KINDS and is_set:
                return f"a reference for {owner}, which drives no muscle by itself"
            own = "pressure_set" if kind == "pressure" and is_set else kind
            own = "pulse" if kind == "valve" and _PULSE & set(words) else own
            quantity = f"{owner}.{own}"
        if unknown:
            return f"would be {quantity}, but its unit {unknown!r} is not known"
        return _Column(
            quantity=quantity,
            kind=kind,
            name=name,
            words=words,
            unit=unit,
            values=values,
            warning=warning,
        )
    return f"{kinds[0]} of no joint or muscle that its name states"


def _owners(kind: str, words: Sequence[str], names: SignalNames) -> Sequence[str]:
    """Joints or muscles that may have a quantity of a kind."""
    if kind in JOINT_KINDS:
        return [joint for joint, own in names.joints.items() if own == kind]
    of_joints = [joint for joint, own in names.joints.items() if EFFORTS[own] == kind]
    if kind == "torque":
        return of_joints
    # A force is a muscle's unless it names a joint that slides.
    named = [joint for joint in of_joints if set(_words([joint])) & set(words)]
    return named or names.muscles


def _parts(column: str, unit: str) -> tuple[tuple[str, ...], str, str]:
    """Words of a column's name, its unit in lower case, and a unit that means nothing here."""
    bracket = _BRACKET.search(column)
    stem = column[: bracket.start()] if bracket else column
    stated = unit or (next(g for g in bracket.groups() if g is not None) if bracket else "")
    chunks = [chunk for chunk in _CHUNK.split(stem) if chunk]
    if stated:
        known = stated.lower() in _UNITS
        return _words(chunks), stated.lower() if known else "", "" if known else stated
    if len(chunks) > 1 and (last := chunks[-1].lower()) in _UNITS:
        words = _words(chunks[:-1])
        by_word = _by_word(words)
        if not by_word or _UNITS[last][1] in by_word:
            return words, last, ""
    return _words(chunks), "", ""


def _words(chunks: Sequence[str]) -> tuple[str, ...]:
    return tuple(word.lower() for chunk in chunks for word in _WORD.findall(chunk))


def _by_word(words: Sequence[str]) -> list[str]:
    return [
        kind
        for kind, own in _WORDS.items()
        if own & set(words) and not (kind == "time" and any(word.isdigit() for word in words))
    ]


def _kinds(words: Sequence[str], unit: str) -> list[str]:
    """Kinds of quantity that a name may mean, the likeliest first."""
    by_word = _by_word(words)
    own = [_UNITS[unit][1]] if unit else by_word
    return own if not by_word or own[0] in by_word else by_word


def _owner(words: Sequence[str], owners: Sequence[str]) -> tuple[str, str]:
    """Joint or muscle that a name means, and the warning about it."""
    if len(owners) == 1:
        return owners[0], ""
    parts = {owner: [w.lower() for w in _WORD.findall(owner)] for owner in owners}
    shared = {
        owner: sum(any(_means(word, part) for word in words) for part in own)
        for owner, own in parts.items()
    }
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


def _means(word: str, part: str) -> bool:
    """Whether a word is part of a name, or an abbreviation of it."""
    return word == part or (len(word) >= _LEAST_PREFIX and part.startswith(word))


def _guess(one: _Column, others: Sequence[_Column], supply: float, stated: Guess | None) -> Guess:
    """A column with its unit; columns of one kind that state none share theirs."""
    if stated is not None and stated.unit:
        return stated
    by_size: list[str] = []
    if one.unit:
        unit = _UNITS[one.unit][0]
    else:
        shared = np.concatenate([o.values for o in others if o.kind == one.kind and not o.unit])
        usual = _BY_VALUE[one.kind]
        fitting = [unit for unit in usual if _plausible(shared, unit, one.kind, supply)]
        unit = (fitting or usual)[0]
        if len(fitting) > 1:
            by_size = [f"unit {unit} by its size, or {' or '.join(fitting[1:])}"]
        elif one.kind not in ("valve", "time") or not fitting:
            by_size = [f"unit {unit} by its size"]
    absolute = one.unit in _ABSOLUTE or "abs" in one.words
    if stated is not None:
        return replace(stated, unit=unit, absolute=absolute, warnings=tuple(by_size))
    warnings = [*([one.warning] if one.warning else []), *by_size]
    if one.quantity.endswith(".pressure") and not absolute:
        lowest = to_si(float(one.values.min()), unit, "Pa", where=one.name)
        if abs(lowest - ATMOSPHERE) < _NEAR_ATMOSPHERE * ATMOSPHERE:
            warnings.append("never below the atmosphere's pressure: absolute, or never vented")
    return Guess(
        quantity=one.quantity,
        column=one.name,
        unit=unit,
        absolute=absolute,
        warnings=tuple(warnings),
    )


def _plausible(values: FloatArray, unit: str, kind: str, supply: float) -> bool:
    """Whether numbers may be in a unit."""
    if kind == "time":
        step = to_si(float(np.median(np.diff(values))), unit, "s", where=unit)
        return _STEPS[0] <= step <= _STEPS[1]
    top = float(np.abs(values).max())
    match kind:
        case "pressure":
            # The set points of a rig are some part of its supply; more, and muscles would not fill.
            return 0.08 * supply <= to_si(top, unit, "Pa", where=unit) <= 1.3 * supply
        case "angle":
            return top <= _TURN if unit == "rad" else top > 1.0
        case "position":
            return top <= 1.0 if unit == "m" else top > 0.5
        case "valve":
            return top <= 1.0 if unit == "1" else 1.0 < top <= 100.0
        case _:
            return True
