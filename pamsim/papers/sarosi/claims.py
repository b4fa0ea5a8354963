"""Sarosi: static force models of a DMSP-20-200N, all its equations and claims."""

from __future__ import annotations

from pamsim.papers.claim import Claim
from pamsim.papers.sarosi import equations as paper_e_equations
from pamsim.papers.sarosi import fits as paper_e_fits
from pamsim.papers.sarosi import inverse as paper_e_inverse


def claims() -> list[Claim]:
    """Recompute Sarosi."""
    return [*paper_e_equations.claims(), *paper_e_inverse.claims(), *paper_e_fits.claims()]
