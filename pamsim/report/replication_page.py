"""The page of the replication: every claim of every paper, and the papers' figures redrawn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pamsim.papers.replicate import PAPERS, SCHEMA
from pamsim.report.numbers import fixed, number_or_none, plain, significant
from pamsim.report.page import write_page
from pamsim.report.replication_figures import FIGURES

VERDICTS: Mapping[str, tuple[str, str, str]] = {
    "independent": ("independent", "✓", "agrees: independent"),
    "calibrated": ("calibrated", "⚙", "agrees: calibrated"),
    "not significant": ("scatter", "≈", "not significant"),
    "inconsistent in the paper": ("inconsistent", "≠", "inconsistent"),
    "text damaged": ("damaged", "✂", "text damaged"),
    "not reproducible from printed data": ("open", "○", "not reproducible"),
}
"""Verdict -> name in the page's code, mark, short words."""

AGREEING = ("independent", "calibrated")
"""Verdicts of what a paper prints and the recomputation agrees with."""

_LEAST_DIGITS = 3  # of a recomputed number, however few digits were printed


def write_replication(
    result: Mapping[str, Any], curves: Mapping[str, Mapping[str, Any]], out: Path
) -> Path:
    """Write page and figures of a replication as `write_page` does; return the page.

    The curves are what a paper's figures draw; papers left out get no figures.
    """
    return write_page(
        out,
        "replication.html",
        result,
        lambda: {
            name: draw(curves[paper])
            for paper, drawings in FIGURES.items()
            if paper in curves
            for name, draw in drawings.items()
        },
        schema=SCHEMA,
        names=PAPERS,
        verdicts=VERDICTS,
        curves=curves,
        sentence=verdict_sentence,
        counts_in_words=counts_in_words,
        printed_text=printed_text,
        recomputed_text=recomputed_text,
        accepted_text=accepted_text,
    )


def verdict_sentence(result: Mapping[str, Any]) -> str:
    """How many statements came out how, and which papers could not be evaluated."""
    counts = result["counts"]
    papers = len(result["papers"])
    text = f"{len(result['claims'])} printed statements of {papers}"
    text += f" paper{'' if papers == 1 else 's'} recomputed, {sum(counts.values())} facts: "
    text += ", ".join(counts_in_words(counts)) + "."
    failed = [PAPERS[failure["paper"]] for failure in result["failures"]]
    return text + (f" Not evaluated: {', '.join(failed)}." if failed else "")


def counts_in_words(counts: Mapping[str, int]) -> list[str]:
    """How many facts agree, and for what reasons the others do not: ``8 not significant``."""
    agreeing = ", ".join(f"{counts[verdict]} {verdict}" for verdict in AGREEING)
    agree = f"{sum(counts[verdict] for verdict in AGREEING)} agree ({agreeing})"
    others = (one for one in VERDICTS if one not in AGREEING and counts[one])
    return [agree, *(f"{counts[one]} {one}" for one in others)]


def printed_text(value: Any) -> str:
    """A printed value: number, list of numbers, words; a dash for none."""
    if isinstance(value, list | tuple):
        return ", ".join(plain(entry) for entry in value)
    return plain(value)


def accepted_text(claim: Mapping[str, Any]) -> str:
    """What a claim's recomputed number must be: interval, order; empty for several intervals."""
    parts = [f"must be {claim['order']}"] if claim["order"] else []
    if len(claim["accepted"]) == 1:
        low, high = claim["accepted"][0]
        parts += [f"at least {significant(low, 6)}"] if high is None and low is not None else []
        parts += [f"at most {significant(high, 6)}"] if low is None and high is not None else []
        if None not in (low, high):
            parts.append(f"accepted {significant(low, 6)} to {significant(high, 6)}")
        parts += [f"95 % ±{significant(half, 3)}" for half in claim["scatter"]]
    return ", ".join(parts)


def recomputed_text(value: Any, printed: Any) -> str:
    """A recomputed value with one digit more than was printed, so that both can be compared.

    For example ``11.547`` beside a printed ``20.13``.
    """
    if isinstance(value, list | tuple):
        # Two lists of one length correspond entry by entry.
        same_length = isinstance(printed, list | tuple) and len(printed) == len(value)
        beside = list(printed) if same_length else [None] * len(value)
        return ", ".join(recomputed_text(v, p) for v, p in zip(value, beside, strict=True))
    number = float(value)
    if number.is_integer() and abs(number) < 1e6:
        return fixed(number, 0)
    digits = _LEAST_DIGITS
    beside = number_or_none(printed)
    if beside is not None:
        decimals = len(f"{beside:.10f}".rstrip("0").partition(".")[2]) + 1
        digits = max(digits, decimals + math.floor(math.log10(abs(number))) + 1)
    return significant(number, min(digits, 8))
