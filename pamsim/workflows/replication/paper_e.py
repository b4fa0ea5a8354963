"""Paper E (seed 004): static force models of a DMSP-20-200N, all its equations and claims."""

from __future__ import annotations

from pamsim.workflows.replication import paper_e_equations, paper_e_fits, paper_e_inverse
from pamsim.workflows.replication.claim import Claim


def claims() -> list[Claim]:
    """Recompute paper E."""
    return [*paper_e_equations.claims(), *paper_e_inverse.claims(), *paper_e_fits.claims()]
