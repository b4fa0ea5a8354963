"""Every printed statement of the five source papers, recomputed, and their figures' curves."""

from __future__ import annotations

import importlib
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pamsim.core.computation import Progress, versions
from pamsim.core.encoding import fields_to_dict, to_dict, write_json
from pamsim.core.errors import InputError, PamsimError, nearest
from pamsim.papers.claim import Claim, Note, Verdict, claim_ids, evaluate
from pamsim.recordings.printed import printed_document

SCHEMA = "pamsim-replicate/3"

PAPERS: Mapping[str, str] = {
    "matiskova2021": "Matiskova 2021",
    "alraouf2025": "Alraouf 2025",
    "nguyen2024": "Nguyen 2024",
    "vandamme2008": "Van Damme 2008",
    "sarosi": "Sarosi",
}
"""Name of a paper's room and files -> its name in sentences."""


@dataclass(frozen=True, kw_only=True)
class Replication:
    """The claims of some papers, judged.

    Attributes:
        papers: name -> full citation.
        claims: paper by paper.
        notes: what the papers do not state or print, paper by paper.
        failures: papers that could not be evaluated, and why.
        wall_s: time it took [s].
        versions: of the software that computed it.
    """

    papers: Mapping[str, str]
    claims: tuple[Claim, ...]
    notes: tuple[Note, ...]
    failures: tuple[Mapping[str, str], ...]
    wall_s: float
    versions: Mapping[str, str] = field(default_factory=versions)

    @property
    def counts(self) -> dict[str, int]:
        """Verdict -> number of facts: claims that repeat a fact with its verdict count once."""
        return _facts(self.claims)

    def summary(self) -> str:
        """How many claims and facts there are and how they were judged, in a line."""
        listed = ", ".join(f"{count} {verdict}" for verdict, count in self.counts.items())
        return (
            f"{len(self.claims)} claims of {sum(self.counts.values())} facts: {listed};"
            f" {len(self.notes)} notes"
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything, JSON-safe."""
        counts = {
            "counts": self.counts,
            "counts_by_paper": {
                paper: _facts(claim for claim in self.claims if claim.paper == paper)
                for paper in self.papers
            },
        }
        return to_dict({"schema": SCHEMA, **fields_to_dict(self), **counts})

    def save(self, folder: Path) -> None:
        """Write ``replication.json`` into a folder."""
        write_json(folder / "replication.json", self.to_dict())


def _facts(claims: Iterable[Claim]) -> dict[str, int]:
    counted = Counter(verdict for _, verdict in {claim.fact for claim in claims})
    return {verdict.value: counted[verdict] for verdict in Verdict}


def citation(paper: str) -> str:
    """Full citation of a paper, as far as its text prints one."""
    return str(printed_document(f"{paper}.toml")["citation"])


def replicate(
    papers: Iterable[str] | None = None, *, progress: Progress | None = None
) -> Replication:
    """Recompute what papers print. A paper that fails does not hide the others.

    Args:
        papers: names of the papers wanted, see `PAPERS`; all if left out.
        progress: called before each paper and at the end.

    Raises:
        InputError: for a name that is not known.
    """
    began = time.monotonic()
    wanted = list(PAPERS) if papers is None else list(dict.fromkeys(papers))
    for paper in wanted:
        if paper not in PAPERS:
            raise InputError(f"no paper {paper!r}; {nearest(paper, PAPERS)}")
    report: Progress = progress or (lambda done, total, what: None)
    found: list[Claim | Note] = []
    failures: list[dict[str, str]] = []
    for index, paper in enumerate(wanted):
        report(index, len(wanted), PAPERS[paper])
        try:
            found += paper_claims(paper)
        # The other papers still count. What else is raised may be an interrupted import.
        except (PamsimError, ValueError, ArithmeticError) as error:
            failures.append({"paper": paper, "error": f"{type(error).__name__}: {error}"})
    report(len(wanted), len(wanted), "done")
    return Replication(
        papers={paper: citation(paper) for paper in wanted},
        claims=tuple(each for each in found if isinstance(each, Claim)),
        notes=tuple(each for each in found if isinstance(each, Note)),
        failures=tuple(failures),
        wall_s=time.monotonic() - began,
    )


def paper_claims(paper: str) -> list[Claim | Note]:
    """Recompute and judge all claims of one paper, notes among them."""
    return [evaluate(id) for id in claim_ids(paper)]


def replication_figures(papers: Iterable[str]) -> dict[str, Mapping[str, Any]]:
    """Curves of every figure of some papers, computed from what is printed.

    Returns:
        Name of the paper -> plain arrays (n,) by name, in the units of that paper's axes; a key
        ends with its unit where it has one. What the engine gives on the bench is under ``bench``.
        What a paper does not print is assumed, and named in the figure's caption.
    """
    return {
        paper: importlib.import_module(f"pamsim.papers.{paper}.figures").curves()
        for paper in papers
    }
