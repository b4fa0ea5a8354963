"""Paper D (seed 002): Preisach hysteresis of pleated muscles, all its numbers and claims."""

from __future__ import annotations

from pamsim.workflows.replication import (
    paper_d_delta,
    paper_d_factor,
    paper_d_preisach,
    paper_d_shape,
)
from pamsim.workflows.replication.claim import Claim


def claims() -> list[Claim]:
    """Recompute paper D; fitting the noisy loops takes most of the time."""
    return [
        *paper_d_shape.claims(),
        *paper_d_preisach.claims(),
        *paper_d_factor.claims(),
        *paper_d_delta.claims(),
    ]
