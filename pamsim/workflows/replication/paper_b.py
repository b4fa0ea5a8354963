"""Paper B (seed 000): arctangent pressure-length hysteresis, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.workflows.replication import (
    paper_b_arctangent,
    paper_b_scores,
    paper_b_sensors,
    paper_b_table,
)
from pamsim.workflows.replication.claim import Claim


def claims() -> list[Claim]:
    """Recompute paper B; fitting the Bouc-Wen loop takes most of the time."""
    return [
        *paper_b_arctangent.claims(),
        *paper_b_scores.claims(),
        *paper_b_table.claims(),
        *paper_b_sensors.claims(),
    ]
