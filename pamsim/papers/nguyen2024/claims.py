"""Nguyen 2024: the fractional Maxwell model, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.papers.claim import Claim
from pamsim.papers.nguyen2024 import geometry as paper_c_geometry
from pamsim.papers.nguyen2024 import loop as paper_c_loop
from pamsim.papers.nguyen2024 import results as paper_c_results
from pamsim.papers.nguyen2024 import search as paper_c_search


def claims() -> list[Claim]:
    """Recompute Nguyen 2024; the searches for its three parameters take most of the time."""
    return [
        *paper_c_geometry.claims(),
        *paper_c_loop.claims(),
        *paper_c_results.claims(),
        *paper_c_search.claims(),
    ]
