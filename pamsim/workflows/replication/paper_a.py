"""Paper A (seed 003): the antagonistic MAS-20 actuator, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.workflows.replication import (
    paper_a_dynamics,
    paper_a_equations,
    paper_a_simulation,
    paper_a_statics,
    paper_a_stiffness,
    paper_a_tables,
)
from pamsim.workflows.replication.claim import Claim


def claims() -> list[Claim]:
    """Recompute paper A; simulates its rows once, which takes most of the time."""
    return [
        *paper_a_tables.claims(),
        *paper_a_statics.claims(),
        *paper_a_equations.claims(),
        *paper_a_stiffness.claims(),
        *paper_a_dynamics.claims(),
        *paper_a_simulation.claims(),
    ]
