"""One printed statement, what came out when it was recomputed, and the verdict on it.

A number counts as reproduced if it lies within half a unit of the last printed digit, unless the
claim says otherwise. Verdicts follow from numbers at run time; none is written down beforehand
where a number can decide.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pamsim.core.errors import InputError

Value = float | str | tuple[float, ...]


class Verdict(StrEnum):
    """What recomputing a printed statement showed."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCIBLE = "not reproducible from printed data"
    INCONSISTENT = "inconsistent in the paper"


CITATIONS: Mapping[str, str] = {
    "A": "Matiskova, D.; Cakurda, T.; Marasova, D.; Balara, A. Determination of the Function of the"
    " Course of the Static Property of PAMs as Actuators in Industrial Robotics. Appl. Sci. 2021,"
    " 11, 7288",
    "B": "Alraouf, D. A. A. A.; Abed, I. A.; Al-Ibadi, A. Proposed Design for Pneumatic Artificial"
    " Muscles in Soft Robotics System: An Experimental Study",
    "C": "Nguyen, M. K.; Trinh, V. C.; Vo, N. Y. P.; Le, T. D. Restoring Model of a Pneumatic"
    " Artificial Muscle with Structure Parameters: Analysis and Identification. Actuators 2024,"
    " 13, 355",
    "D": "Van Damme, M.; Beyl, P.; Vanderborght, B.; Van Ham, R.; Vanderniepen, I.; Versluys, R.;"
    " Daerden, F.; Lefeber, D. Modeling Hysteresis in Pleated Pneumatic Artificial Muscles",
    "E": "Matlab Models for Pneumatic Artificial Muscles",
}
"""Letter of a paper -> full citation, as far as its text prints one."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A printed statement and its recomputation.

    Attributes:
        id: letter of the paper and a number that stays, such as ``A-07``.
        what: the statement in a short sentence.
        printed: number, numbers or words as printed.
        recomputed: the same, computed here; None if it cannot be.
        unit: of both; ``1`` for a pure number, empty for words.
        verdict: see `Verdict`.
        reason: evidence and method in a sentence.
        tolerance: largest difference that counted as reproduced, in ``unit``; None for words.
    """

    id: str
    what: str
    printed: Value
    recomputed: Value | None
    unit: str
    verdict: Verdict
    reason: str
    tolerance: float | tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Refuse what no reader and no JSON file could use.

        Raises:
            InputError: for an id that is not a known letter and two digits, missing words, or a
                number that is not finite.
        """
        if not re.fullmatch(r"[A-Z]-\d\d", self.id) or self.id[0] not in CITATIONS:
            raise InputError(f"claim id {self.id!r} is not a paper's letter and two digits: A-07")
        if not self.what or not self.reason:
            raise InputError(f"claim {self.id} lacks its statement or its reason")
        for value in (self.printed, self.recomputed):
            numbers = value if isinstance(value, tuple) else (value,)
            if any(isinstance(n, float) and not math.isfinite(n) for n in numbers):
                raise InputError(f"claim {self.id} has a number that is not finite: {value!r}")

    @property
    def paper(self) -> str:
        """Letter of the paper."""
        return self.id[0]

    @property
    def citation(self) -> str:
        """The paper's full citation."""
        return CITATIONS[self.paper]

    def as_dict(self) -> dict[str, Any]:
        """JSON-safe: numbers, lists of numbers, words and None."""
        return {
            "id": self.id,
            "paper": self.paper,
            "what": self.what,
            "printed": _plain(self.printed),
            "recomputed": _plain(self.recomputed),
            "unit": self.unit,
            "verdict": self.verdict.value,
            "reason": self.reason,
        }


def half_unit(decimals: int) -> float:
    """Half a unit of the last printed digit.

    Args:
        decimals: digits printed after the point.
    """
    return 0.5 * 10.0**-decimals


def compare(
    id: str,
    what: str,
    printed: float | Sequence[float],
    recomputed: float | Sequence[float],
    tolerance: float | Sequence[float],
    *,
    unit: str,
    reason: str,
    otherwise: Verdict = Verdict.NOT_REPRODUCIBLE,
) -> Claim:
    """A claim whose verdict is decided by the difference of numbers.

    Args:
        id: see `Claim`.
        what: see `Claim`.
        printed: number or (n,) numbers as printed.
        recomputed: the same, computed.
        tolerance: one for all or (n,), see `half_unit`.
        unit: of all of them.
        reason: see `Claim`.
        otherwise: verdict if a difference is larger than its tolerance.
    """
    told, found = _tuple(printed), _tuple(recomputed)
    allowed = _tuple(tolerance) if isinstance(tolerance, Sequence) else (tolerance,) * len(told)
    # 1e-9: the tolerance itself is a decimal that binary numbers do not hold exactly.
    near = all(
        abs(a - b) <= limit * (1.0 + 1e-9) for a, b, limit in zip(told, found, allowed, strict=True)
    )
    return Claim(
        id=id,
        what=what,
        printed=told if isinstance(printed, Sequence) else told[0],
        recomputed=found if isinstance(recomputed, Sequence) else found[0],
        unit=unit,
        verdict=Verdict.REPRODUCED if near else otherwise,
        reason=reason,
        tolerance=allowed if isinstance(tolerance, Sequence) else allowed[0],
    )


def holds(condition: bool, otherwise: Verdict) -> Verdict:
    """`Verdict.REPRODUCED` if a condition holds, else the other verdict."""
    return Verdict.REPRODUCED if condition else otherwise


def _tuple(value: float | Sequence[float]) -> tuple[float, ...]:
    if isinstance(value, Sequence):
        return tuple(float(entry) for entry in value)
    return (float(value),)


def _plain(value: Value | None) -> Any:
    return list(value) if isinstance(value, tuple) else value
