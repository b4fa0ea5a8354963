"""A claim: a printed statement, what came out when it was recomputed, and the verdict on it.

A claim is a row of ``pamsim/data/<paper>_claims.toml`` and a function that recomputes it, joined by
the claim's id. A statement that could not fail is no claim. Columns of a row:

    statement   the printed statement in a short sentence
    place       where the paper prints it
    printed     the printed number, numbers or words; ``$table.key`` quotes the paper's other file,
                ``<paper>.toml``; left out where the function reads them from a printed table
    unit        of both; ``1`` for a pure number
    kind        what agreement is worth: ``independent`` or ``calibrated``
    because     why it is of that kind
    otherwise   verdict if the statement does not hold, ``not reproducible from printed data`` if
                left out
    same_as     number of the claim whose fact this one repeats; the fact is counted once
    reason      evidence and method; {names} are filled in with what the function computed, or with
                the file's ``[shared]`` texts
    as          number of the row from which columns that are left out are taken
    note        ``true`` for what the paper does not state or print: shown, but no claim of it;
                needs no ``printed``, ``kind`` and ``because``, and no function

A verdict follows at run time from the recomputed numbers that the claim shows, and from nothing
else. They must lie in the accepted intervals, for which there is one rule:

    a printed number    half a unit of its last printed digit on either side, wider by what half a
                        unit of every printed number that went in moves the recomputed one (not
                        carried through searches and simulations, where it would decide nothing)
    a printed interval  the interval, wider in the same way
    an equation         both sides agree to `AGREES` of their size
    rows that scatter   a law describes them if it misses them by no more than their scatter, that
                        is what a fitted law without the physics in question leaves
    words               their direction: greater, less, falling, rising; no word of degree is judged

Where a recomputed number scatters, with a printed interval or with the rows it was fitted to, all
of its 95 % interval must lie inside or all of it outside; otherwise nothing is decided.
"""

from __future__ import annotations

import functools
import importlib
import itertools
import math
import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.papers.numerics import PrintedNumbers, digits_of, several
from pamsim.recordings.printed import Printed, printed_document

Number = float | Printed
Numbers = Number | Sequence[Number]
Limits = Number | Sequence[Number | None]
Interval = tuple[float | None, float | None]

AGREES = 1e-6
"""Largest difference of both sides of an equation over their size: rounding and the differences
that stand for derivatives stay far below."""


class Verdict(StrEnum):
    """What recomputing a printed statement showed."""

    INDEPENDENT = "independent"
    CALIBRATED = "calibrated"
    NOT_SIGNIFICANT = "not significant"
    INCONSISTENT = "inconsistent in the paper"
    TEXT_DAMAGED = "text damaged"
    NOT_REPRODUCIBLE = "not reproducible from printed data"


KINDS = (Verdict.INDEPENDENT, Verdict.CALIBRATED)
"""Verdicts on a statement that holds: agreement that could have failed, and that was made by
fitting."""


class Order(StrEnum):
    """How recomputed numbers must follow one another."""

    RISING = "rising"
    FALLING = "falling"


@dataclass(frozen=True, kw_only=True)
class Note:
    """What a paper does not state or print, and what can be said of it; no claim of the paper.

    The ``id`` is the name of the paper and a number that stays, such as ``matiskova2021-07``;
    what is ``recomputed`` may be nothing. The rest are columns of the row.
    """

    id: str
    paper: str
    statement: str
    place: str
    recomputed: float | tuple[float, ...] | None
    unit: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A printed statement and its recomputation.

    What is not explained here is a column of the row, or as in a `Note`.

    Attributes:
        accepted: interval in which each recomputed number must lie, None for an open end.
        scatter: half the 95 % interval of each recomputed number; empty if they do not scatter.
        order: in which the recomputed numbers must come, if any.
        same_as: id of the claim whose fact this one repeats, or None.
    """

    id: str
    paper: str
    statement: str
    place: str
    printed: float | str | tuple[float, ...]
    recomputed: float | tuple[float, ...]
    unit: str
    accepted: tuple[Interval, ...]
    scatter: tuple[float, ...]
    order: Order | None
    kind: Verdict
    because: str
    verdict: Verdict
    same_as: str | None
    reason: str

    @property
    def fact(self) -> tuple[str, Verdict]:
        """What is counted: claims of one fact and one verdict count once."""
        return self.same_as or self.id, self.verdict


class Recomputed:
    """What a function found for its claim.

    The value is `Printed` with what the rounding of printed numbers leaves open, and None only for
    a note. The smallest and largest accepted numbers, ``low`` and ``high``, are for all or for
    each, and open if left out; without them and an order the printed numbers are compared, those
    given here or the row's. The scatter is half the 95 % interval of each number; the evidence is
    what the row's reason quotes.
    """

    def __init__(
        self,
        value: Numbers | None,
        *,
        printed: Numbers | None = None,
        low: Limits | None = None,
        high: Limits | None = None,
        order: Order | None = None,
        scatter: float | Sequence[float] = (),
        **evidence: Any,
    ) -> None:
        self.value, self.printed, self.low, self.high = value, printed, low, high
        self.order, self.scatter, self.evidence = order, scatter, evidence


def agreeing(*values: float) -> dict[str, Any]:
    """Limits of `Recomputed` for numbers that an equation says are these."""
    return {
        "low": [value - AGREES * abs(value) for value in values],
        "high": [value + AGREES * abs(value) for value in values],
    }


_RECOMPUTE: dict[str, Callable[[], Recomputed | Numbers]] = {}


def recomputes(first: str, *, each: Iterable[Any] = ((),)) -> Callable[[Any], Any]:
    """Make a function the one that recomputes the claim of an id, and those numbered after it.

    It returns a `Recomputed`, or just its value, and is called with an entry of ``each``, which has
    one for every claim: an argument, or a tuple of several.
    """
    paper, _, number = first.rpartition("-")

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        for place, given in enumerate(each, start=int(number)):
            id, arguments = f"{paper}-{place:02d}", given if isinstance(given, tuple) else (given,)
            if id in _RECOMPUTE:
                raise InputError(f"claim {id} has two functions")
            _RECOMPUTE[id] = functools.partial(function, *arguments)
        return function

    return register


def claim_ids(paper: str) -> list[str]:
    """Ids of a paper's claims and notes, in order."""
    return [f"{paper}-{number}" for number in _table(paper) if number != "shared"]


def evaluate(id: str) -> Claim | Note:
    """Recompute one claim and judge it, or one note.

    Raises:
        InputError: if there is no such claim, or its row and function do not fit each other.
    """
    return judge(id, *recomputed(id))


def recomputed(id: str) -> tuple[Mapping[str, Any], Recomputed]:
    """Row of a claim or note and what its function returned; raises as `evaluate`."""
    paper, _, number = id.rpartition("-")
    ids = claim_ids(paper)
    if id not in ids:
        raise InputError(f"no claim {id!r}; {nearest(id, ids)}")
    _import_room(paper)
    row = _row(paper, number)
    if id not in _RECOMPUTE and not row.get("note"):
        raise InputError(f"claim {id} has no function that recomputes it")
    found = _RECOMPUTE[id]() if id in _RECOMPUTE else None
    return row, found if isinstance(found, Recomputed) else Recomputed(found)


@functools.cache
def _import_room(paper: str) -> None:
    """Import every module of a paper's room, which registers its functions."""
    room = importlib.import_module(f"pamsim.papers.{paper}")
    for module in pkgutil.iter_modules(room.__path__):
        importlib.import_module(f"{room.__name__}.{module.name}")


def judge(id: str, row: Mapping[str, Any], result: Recomputed) -> Claim | Note:
    """Judge a row by what its function returned; join the two of a note.

    Raises:
        InputError: for a number that is not finite, or a row that cannot be judged.
    """
    paper, same_as = id.rpartition("-")[0], row.get("same_as")
    texts = {**_table(paper).get("shared", {}), **result.evidence}

    def filled(text: str) -> str:
        # Twice: a shared text quotes the evidence too.
        return text.format_map(texts).format_map(texts)

    common = {name: row[name] for name in ("statement", "place", "unit")}
    common |= {"id": id, "paper": paper, "reason": filled(row["reason"])}
    if row.get("note"):
        value = None if result.value is None else _shown(id, result.value)
        return Note(**common, recomputed=value)
    if result.value is None:
        raise InputError(f"claim {id} has no recomputed number; make it a note")
    kind = row["kind"]
    if kind not in KINDS:
        raise InputError(f"claim {id} is of kind {kind}; kinds are {', '.join(KINDS)}")
    printed = result.printed
    if printed is None:
        printed = PrintedNumbers(paper).quoted(row["printed"])
    accepted, scatter = _accepted(id, printed, result), _floats(result.scatter)
    holds = _holds(_floats(result.value), accepted, scatter, result.order)
    failing = Verdict(row.get("otherwise", Verdict.NOT_REPRODUCIBLE))
    return Claim(
        **common,
        printed=printed if isinstance(printed, str) else _shown(id, printed),
        recomputed=_shown(id, result.value),
        accepted=accepted,
        scatter=scatter,
        order=result.order,
        kind=Verdict(kind),
        because=filled(row["because"]),
        verdict={None: Verdict.NOT_SIGNIFICANT, True: Verdict(kind), False: failing}[holds],
        same_as=None if same_as is None else f"{paper}-{same_as}",
    )


def _accepted(id: str, printed: Any, result: Recomputed) -> tuple[Interval, ...]:
    """Interval in which each recomputed number must lie, by the rule of this file."""
    values = several(result.value)
    low, high = result.low, result.high
    if low is None and high is None and result.order is None:
        if isinstance(printed, str):
            raise InputError(f"claim {id} is in words and has no limit and no order")
        low = high = printed

    def each(limits: Limits | None) -> Sequence[Number | None]:
        if limits is None or not isinstance(limits, Sequence):
            return (limits,) * len(values)
        if len(limits) != len(values):
            raise InputError(f"claim {id} compares {len(values)} numbers with {len(limits)}")
        return limits

    return tuple(
        (_widened(a, -1.0, value), _widened(b, 1.0, value))
        for a, b, value in zip(each(low), each(high), values, strict=True)
    )


def _widened(limit: Number | None, side: float, value: Number) -> float | None:
    if limit is None:
        return None
    limit, value = digits_of(limit), digits_of(value)
    edge = limit.value + side * (limit.half_unit + value.half_unit)
    # 1e-12: a decimal that binary numbers do not hold exactly must not decide.
    return edge + side * 1e-12 * abs(limit.value)


def _holds(
    values: tuple[float, ...],
    accepted: tuple[Interval, ...],
    scatter: Sequence[float],
    order: Order | None,
) -> bool | None:
    """Whether the numbers are what they must be; None if their scatter leaves it open."""
    halves = scatter or [0.0] * len(values)
    each = [_inside(*one) for one in zip(values, halves, accepted, strict=True)]
    following = values[::-1] if order is Order.FALLING else values
    ordered = order is None or all(a < b for a, b in itertools.pairwise(following))
    if not ordered or False in each:
        return False
    return None if None in each else True


def _inside(value: float, half: float, accepted: Interval) -> bool | None:
    low = -math.inf if accepted[0] is None else accepted[0]
    high = math.inf if accepted[1] is None else accepted[1]
    if value + half < low or value - half > high:
        return False
    return True if low <= value - half and value + half <= high else None


@functools.cache
def _table(paper: str) -> Mapping[str, Any]:
    return printed_document(f"{paper}_claims.toml", digits=True)


def _row(paper: str, number: str) -> dict[str, Any]:
    own = _table(paper)[number]
    return {**(_row(paper, own["as"]) if "as" in own else {}), **own}


def _floats(value: Any) -> tuple[float, ...]:
    return tuple(digits_of(entry).value for entry in several(value))


def _shown(id: str, value: Numbers) -> float | tuple[float, ...]:
    numbers = _floats(value)
    if not all(math.isfinite(number) for number in numbers):
        raise InputError(f"claim {id} has a number that is not finite: {numbers!r}")
    return numbers if isinstance(value, Sequence) else numbers[0]
