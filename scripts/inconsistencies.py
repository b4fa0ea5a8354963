"""Write docs/inconsistencies.md: what does not add up in the source papers, from their claims.

python scripts/inconsistencies.py
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pamsim
from pamsim.papers.claim import Claim, Value, Verdict
from pamsim.papers.replicate import PAPERS

PAGE = Path(__file__).resolve().parents[1] / "docs" / "inconsistencies.md"

INTRODUCTION = """# What does not add up in the papers

Every printed statement that `pamsim replicate` judges inconsistent in its paper, damaged in our
text of it, or not reproducible from what the paper prints, with the recomputed numbers and the
reason. Written by `scripts/inconsistencies.py`. What each verdict means, and how many statements
hold: [papers](papers.md). A claim that repeats the fact of another is left out.
"""

HEADINGS = {
    Verdict.INCONSISTENT: "Inconsistent in the paper",
    Verdict.TEXT_DAMAGED: "Damaged in our text",
    Verdict.NOT_REPRODUCIBLE: "Not reproducible from what is printed",
}
SHOWN = 4  # numbers of a claim; longer columns are in the reason


def section(paper: str, claims: Iterable[Claim]) -> str:
    """The part of the page on one paper."""
    parts = [f"\n## {PAPERS[paper]}\n"]
    own = [claim for claim in claims if claim.paper == paper and claim.same_as is None]
    for verdict, heading in HEADINGS.items():
        found = [_item(claim) for claim in own if claim.verdict is verdict]
        if found:
            parts += [f"\n**{heading}**\n\n", *found]
    return "".join(parts)


def _item(claim: Claim) -> str:
    place = "" if claim.statement.startswith(claim.place) else f" ({claim.place})"
    numbers = ""
    if len(_listed(claim.recomputed)) <= SHOWN:
        unit = "" if claim.unit in ("", "1") else f" {claim.unit}"
        printed = " and ".join(_listed(claim.printed))
        numbers = f" Printed: {printed}; recomputed: {', '.join(_listed(claim.recomputed))}{unit}."
    first = claim.reason.split()[0]  # a symbol stays as it is
    word = first == "a" or (first.isalpha() and len(first) > 1)
    reason = claim.reason[0].upper() + claim.reason[1:] if word else claim.reason
    text = f"- `{claim.id}`{place}: {claim.statement}.{numbers} {reason}."
    return text.replace("*", "\\*").replace("<", "&lt;") + "\n"


def _listed(value: Value) -> list[str]:
    values = value if isinstance(value, tuple | list) else [value]
    return [one if isinstance(one, str) else f"{one:.4g}" for one in values]


def main() -> None:
    """Recompute all claims and write the page."""
    claims = pamsim.replicate().claims
    PAGE.write_text(INTRODUCTION + "".join(section(paper, claims) for paper in PAPERS), "utf-8")


if __name__ == "__main__":
    main()
