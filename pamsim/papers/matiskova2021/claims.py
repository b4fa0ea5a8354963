"""Matiskova 2021: the antagonistic MAS-20 actuator, all its printed numbers and claims."""

from __future__ import annotations

from pamsim.papers.claim import Claim
from pamsim.papers.matiskova2021 import dynamics as paper_a_dynamics
from pamsim.papers.matiskova2021 import equations as paper_a_equations
from pamsim.papers.matiskova2021 import simulation as paper_a_simulation
from pamsim.papers.matiskova2021 import statics as paper_a_statics
from pamsim.papers.matiskova2021 import stiffness as paper_a_stiffness
from pamsim.papers.matiskova2021 import tables as paper_a_tables


def claims() -> list[Claim]:
    """Recompute Matiskova 2021; simulates its rows once, which takes most of the time."""
    return [
        *paper_a_tables.claims(),
        *paper_a_statics.claims(),
        *paper_a_equations.claims(),
        *paper_a_stiffness.claims(),
        *paper_a_dynamics.claims(),
        *paper_a_simulation.claims(),
    ]
