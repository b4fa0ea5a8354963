"""What the replication page says of every claim, in words and finished numbers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pamsim.report.numbers import NONE, fixed, number_or_none, plain, significant, unit

VERDICTS: Mapping[str, tuple[str, str, str]] = {
    "reproduced": ("reproduced", "✓", "reproduced"),
    "not reproducible from printed data": ("open", "○", "not reproducible"),
    "inconsistent in the paper": ("inconsistent", "≠", "inconsistent"),
}
"""Verdict -> name in the page's code, mark, short word."""

_UNKNOWN = ("other", "?", "unknown verdict")
_LEAST_DIGITS = 3  # of a recomputed number, however few digits were printed


@dataclass(frozen=True)
class ClaimView:
    """One line of the table."""

    id: str
    what: str
    printed: str
    recomputed: str
    unit: str
    kind: str
    mark: str
    word: str
    reason: str


@dataclass(frozen=True)
class PaperView:
    """The claims of one paper: how many there are of each kind, in the order of `VERDICTS`."""

    letter: str
    citation: str
    claims: list[ClaimView]
    counts: list[int]
    failure: str


def paper_views(result: Mapping[str, Any]) -> list[PaperView]:
    """Group the claims by paper, papers in their order of appearance.

    Args:
        result: of schema ``pamsim-replicate/1``.

    Returns:
        One entry for every paper named or with claims, also if it has none.
    """
    claims = list(result.get("claims") or ())
    citations: dict[str, Any] = dict(result.get("papers") or {})
    failures = {str(each["paper"]): str(each["error"]) for each in result.get("failures") or ()}
    letters = dict.fromkeys([*citations, *(str(claim["paper"]) for claim in claims)])
    views: list[PaperView] = []
    for letter in letters:
        own = [claim for claim in claims if str(claim["paper"]) == letter]
        counted = Counter(str(claim.get("verdict")) for claim in own)
        views.append(
            PaperView(
                letter=letter,
                citation=str(citations.get(letter) or ""),
                claims=[_claim_view(claim) for claim in own],
                counts=[counted[verdict] for verdict in VERDICTS],
                failure=failures.get(letter, ""),
            )
        )
    return views


def verdict_sentence(papers: Sequence[PaperView]) -> str:
    """Say how many statements came out how, in one sentence without judging words."""
    total = sum(len(paper.claims) for paper in papers)
    sums = [sum(paper.counts[i] for paper in papers) for i in range(len(VERDICTS))]
    listed = [f"{number} {verdict}" for number, verdict in zip(sums, VERDICTS, strict=True)]
    many = "paper" if len(papers) == 1 else "papers"
    text = f"{total} printed statements of {len(papers)} {many} recomputed: "
    text += ", ".join(listed[:-1]) + f" and {listed[-1]}."
    failed = [paper.letter for paper in papers if paper.failure]
    if failed:
        text += f" Not evaluated: paper {', '.join(failed)}."
    return text


def printed_text(value: Any) -> str:
    """A printed value: number, list of numbers, words; a dash for none."""
    if isinstance(value, list | tuple):
        return ", ".join(plain(entry) for entry in value)
    return plain(value)


def recomputed_text(value: Any, printed: Any) -> str:
    """A recomputed value with one digit more than was printed, so that both can be compared.

    Args:
        value: number, list of numbers, words or None.
        printed: what stands beside it.

    Returns:
        For example ``11.547`` beside a printed ``20.13``; a dash for None.
    """
    if isinstance(value, list | tuple):
        # Two lists of one length correspond entry by entry.
        alike = isinstance(printed, list | tuple) and len(printed) == len(value)
        beside = list(printed) if alike else [None] * len(value)
        return ", ".join(recomputed_text(v, p) for v, p in zip(value, beside, strict=True))
    number = number_or_none(value)
    if number is None:
        return NONE if value is None else str(value)
    if number.is_integer() and abs(number) < 1e6:
        return fixed(number, 0)
    digits = _LEAST_DIGITS
    told = number_or_none(printed)
    if told is not None:
        decimals = len(f"{told:.10f}".rstrip("0").partition(".")[2]) + 1
        digits = max(digits, decimals + math.floor(math.log10(abs(number))) + 1)
    return significant(number, min(digits, 8))


def _claim_view(claim: Mapping[str, Any]) -> ClaimView:
    kind, mark, word = VERDICTS.get(str(claim.get("verdict")), _UNKNOWN)
    return ClaimView(
        id=str(claim["id"]),
        what=str(claim.get("what") or ""),
        printed=printed_text(claim.get("printed")),
        recomputed=recomputed_text(claim.get("recomputed"), claim.get("printed")),
        unit=unit(claim.get("unit") or None),
        kind=kind,
        mark=mark,
        word=word,
        reason=str(claim.get("reason") or ""),
    )
