"""Alraouf 2025: arctangent pressure-length hysteresis, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.papers.alraouf2025 import arctangent as paper_b_arctangent
from pamsim.papers.alraouf2025 import scores as paper_b_scores
from pamsim.papers.alraouf2025 import sensors as paper_b_sensors
from pamsim.papers.alraouf2025 import table as paper_b_table
from pamsim.papers.claim import Claim


def claims() -> list[Claim]:
    """Recompute Alraouf 2025; fitting the Bouc-Wen loop takes most of the time."""
    return [
        *paper_b_arctangent.claims(),
        *paper_b_scores.claims(),
        *paper_b_table.claims(),
        *paper_b_sensors.claims(),
    ]
