"""Paper C (seed 001): the fractional Maxwell model, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.workflows.replication import (
    paper_c_geometry,
    paper_c_loop,
    paper_c_results,
    paper_c_search,
)
from pamsim.workflows.replication.claim import Claim


def claims() -> list[Claim]:
    """Recompute paper C; the searches for its three parameters take most of the time."""
    return [
        *paper_c_geometry.claims(),
        *paper_c_loop.claims(),
        *paper_c_results.claims(),
        *paper_c_search.claims(),
    ]
