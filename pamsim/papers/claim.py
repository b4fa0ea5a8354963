"""A claim: a printed statement, what came out when it was recomputed, and the verdict on it.

A claim is a row of ``pamsim/data/<paper>_claims.toml`` and a function that recomputes it, joined by
the claim's id. Columns of a row:

    statement   the printed statement in a short sentence
    place       where the paper prints it
    printed     the printed number, numbers or words; ``$table.key`` quotes the paper's other file,
                ``<paper>.toml``; left out where the function reads them from a printed table
    unit        of both; ``1`` for a pure number, empty for words
    tolerance   largest difference that counts as reproduced; half a unit of the last printed digit
                if left out
    otherwise   ``inconsistent``: verdict if the statement does not hold, instead of ``not
                reproducible from printed data``
    reason      evidence and method; {names} are filled in with what the function computed, or with
                the file's ``[shared]`` texts
    as          number of the row from which columns that are left out are taken
    computed    ``false`` if there is nothing to compute; then ``recomputed`` may hold words

Verdicts follow from numbers at run time; none is written down beforehand where a number can decide.
"""

from __future__ import annotations

import functools
import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.store.printed import Printed, printed_document

Value = float | str | tuple[float, ...]
Numbers = float | Printed | Sequence[float | Printed]


class Verdict(StrEnum):
    """What recomputing a printed statement showed."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCIBLE = "not reproducible from printed data"
    INCONSISTENT = "inconsistent in the paper"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A printed statement and its recomputation.

    Attributes:
        id: name of the paper and a number that stays, such as ``matiskova2021-07``.
        paper: name of the paper.
        statement: in a short sentence.
        place: where the paper prints it.
        printed: number, numbers or words as printed.
        recomputed: the same, computed here; None if it cannot be.
        unit: of both.
        tolerance: largest difference that counts as reproduced; None where numbers do not decide.
        verdict: see `Verdict`.
        reason: evidence and method.
    """

    id: str
    paper: str
    statement: str
    place: str
    printed: Value
    recomputed: Value | None
    unit: str
    tolerance: float | tuple[float, ...] | None
    verdict: Verdict
    reason: str


class Recomputed:
    """The result of a function for its claim."""

    def __init__(
        self,
        value: float | str | Sequence[float] | None,
        *,
        holds: bool | None = None,
        printed: Numbers | None = None,
        tolerance: float | Sequence[float] | None = None,
        otherwise: Verdict | None = None,
        **evidence: Any,
    ) -> None:
        """Collect the result.

        Args:
            value: the recomputed number, numbers or words; None if there is none.
            holds: whether the statement holds; if left out, the difference from the printed numbers
                decides, and a statement in words does not hold.
            printed: in place of the row's.
            tolerance: in place of the row's.
            otherwise: in place of the row's.
            evidence: what the row's reason quotes.
        """
        self.value = value
        self.holds = holds
        self.printed = printed
        self.tolerance = tolerance
        self.otherwise = otherwise
        self.evidence = evidence


_RECOMPUTE: dict[str, Callable[[], Recomputed]] = {}


def recomputes(id: str, *arguments: Any) -> Callable[[Any], Any]:
    """Make a function the one that recomputes a claim.

    Args:
        id: of the claim, such as ``matiskova2021-07``.
        arguments: that it is called with.
    """

    def register(function: Callable[..., Recomputed]) -> Callable[..., Recomputed]:
        if id in _RECOMPUTE:
            raise InputError(f"claim {id} has two functions")
        _RECOMPUTE[id] = functools.partial(function, *arguments)
        return function

    return register


def claim_ids(paper: str) -> list[str]:
    """Ids of a paper's claims, in order."""
    return [f"{paper}-{number}" for number in _table(paper) if number != "shared"]


def evaluate(id: str) -> Claim:
    """Recompute one claim and judge it.

    Raises:
        InputError: if there is no such claim, its row and function do not fit each other, or a
            number is not finite.
    """
    paper, _, number = id.rpartition("-")
    ids = claim_ids(paper)
    if id not in ids:
        raise InputError(f"no claim {id!r}; {nearest(id, ids)}")
    _import_room(paper)
    row = _row(paper, number)
    if row.get("computed", True) != (id in _RECOMPUTE):
        raise InputError(f"claim {id} must have either a function or computed = false")
    result = _RECOMPUTE[id]() if id in _RECOMPUTE else Recomputed(row.get("recomputed"))
    return judge(id, row, result)


@functools.cache
def _import_room(paper: str) -> None:
    """Import every module of a paper's room, which registers its functions."""
    room = importlib.import_module(f"pamsim.papers.{paper}")
    for module in pkgutil.iter_modules(room.__path__):
        importlib.import_module(f"{room.__name__}.{module.name}")


def judge(id: str, row: Mapping[str, Any], result: Recomputed) -> Claim:
    """Join a row and what was recomputed.

    Args:
        id: of the claim.
        row: its columns.
        result: what its function returned.

    Raises:
        InputError: for a number that is not finite, or no tolerance where numbers decide.
    """
    paper = id.rpartition("-")[0]
    printed = _quoted(paper, row["printed"]) if result.printed is None else result.printed
    given = row.get("tolerance") if result.tolerance is None else result.tolerance
    tolerance = None if given is None else _numbers(given)
    value = result.value
    holds = result.holds
    if holds is None:
        holds = False
        if not isinstance(printed, str) and value is not None:
            tolerance = _half_units(id, printed) if tolerance is None else tolerance
            holds = within(_numbers(printed), _numbers(value), tolerance)
    otherwise = Verdict.INCONSISTENT if "otherwise" in row else Verdict.NOT_REPRODUCIBLE
    shared = _table(paper).get("shared", {})
    return Claim(
        id=id,
        paper=paper,
        statement=row["statement"],
        place=row["place"],
        printed=_value(id, printed),
        recomputed=None if value is None else _value(id, value),
        unit=row["unit"],
        tolerance=tolerance,
        verdict=Verdict.REPRODUCED if holds else result.otherwise or otherwise,
        reason=row["reason"].format_map({**shared, **result.evidence}),
    )


def within(
    printed: float | Sequence[float],
    recomputed: float | Sequence[float],
    tolerance: float | Sequence[float],
) -> bool:
    """Whether every number lies within its tolerance of the printed one.

    Args:
        printed: number or (n,) numbers.
        recomputed: the same, computed.
        tolerance: one for all or (n,).
    """
    wanted, computed = _several(printed), _several(recomputed)
    limits = _several(tolerance) if isinstance(tolerance, Sequence) else (tolerance,) * len(wanted)
    # 1e-9: the tolerance itself is a decimal that binary numbers do not hold exactly.
    return all(
        abs(a - b) <= limit * (1.0 + 1e-9)
        for a, b, limit in zip(wanted, computed, limits, strict=True)
    )


def half_unit(decimals: int) -> float:
    """Half a unit of the last printed digit.

    Args:
        decimals: digits printed after the point.
    """
    return 0.5 * 10.0**-decimals


def printed_number(paper: str, name: str) -> Printed:
    """A single printed number that claims and computations use, in its printed unit.

    Args:
        paper: name of the paper.
        name: of the entry in table ``number`` of ``<paper>.toml``.

    Raises:
        InputError: if there is no such entry.
    """
    (number,) = printed_numbers(paper, name)
    return number


def printed_numbers(paper: str, name: str) -> tuple[Printed, ...]:
    """As `printed_number`, for an entry with any count of numbers."""
    entries = _document(paper)["number"]
    if name not in entries:
        raise InputError(f"{paper} prints no {name!r}; {nearest(name, entries)}")
    value = entries[name]["value"]
    return tuple(map(_digits, value if isinstance(value, list) else [value]))


def printed_values(paper: str, name: str) -> tuple[float, ...]:
    """As `printed_numbers`, without their digits."""
    return tuple(number.value for number in printed_numbers(paper, name))


@functools.cache
def _table(paper: str) -> Mapping[str, Any]:
    return printed_document(f"{paper}_claims.toml", digits=True)


@functools.cache
def _document(paper: str) -> Mapping[str, Any]:
    return printed_document(f"{paper}.toml", digits=True)


def _row(paper: str, number: str) -> dict[str, Any]:
    own = _table(paper)[number]
    return {**(_row(paper, own["as"]) if "as" in own else {}), **own}


def _quoted(paper: str, printed: Any) -> Any:
    """A row's printed numbers with their digits, or its words."""
    if isinstance(printed, list):
        return [_quoted(paper, entry) for entry in printed]
    if isinstance(printed, str):
        if not printed.startswith("$"):
            return printed
        entry: Any = _document(paper)
        for key in printed[1:].split("."):
            entry = entry[key]
        return _quoted(paper, entry["value"] if isinstance(entry, Mapping) else entry)
    return _digits(printed)


def _digits(number: int | Printed) -> Printed:
    return number if isinstance(number, Printed) else Printed(float(number), 0.5)


def _half_units(id: str, printed: Any) -> float | tuple[float, ...]:
    entries = printed if isinstance(printed, list | tuple) else [printed]
    if not all(isinstance(entry, Printed) for entry in entries):
        raise InputError(f"claim {id} has no tolerance")
    units = tuple(entry.half_unit for entry in entries)
    return units if isinstance(printed, list | tuple) else units[0]


def _numbers(value: Any) -> Any:
    """Floats of a number or of numbers, whatever they are given as."""
    if isinstance(value, Sequence):
        return tuple(_numbers(entry) for entry in value)
    return value.value if isinstance(value, Printed) else float(value)


def _several(value: float | Sequence[float]) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, Sequence) else (value,)


def _value(id: str, value: Any) -> Value:
    if isinstance(value, str):
        return value
    numbers = _numbers(value)
    if not all(math.isfinite(number) for number in _several(numbers)):
        raise InputError(f"claim {id} has a number that is not finite: {numbers!r}")
    return numbers
