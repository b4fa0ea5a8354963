"""A paper's claims, recomputed once for all tests."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

from pamsim.papers import claim as room
from pamsim.papers.claim import Claim, Note, judge, note


@dataclass
class Judged:
    """Claims and notes of a paper, with the rows and results they come from."""

    claims: dict[str, Claim] = field(default_factory=dict)
    notes: dict[str, Note] = field(default_factory=dict)
    sources: dict[str, tuple] = field(default_factory=dict)


@functools.cache
def judged(paper) -> Judged:
    found = Judged()
    for id in room.claim_ids(paper):
        row, result = room.recomputed(id)
        found.sources[id] = row, result
        if row.get("note"):
            found.notes[id] = note(id, row, result)
        else:
            found.claims[id] = judge(id, row, result)
    return found


def with_verdict(paper, *verdicts) -> set[str]:
    return {id for id, claim in judged(paper).claims.items() if claim.verdict in verdicts}
