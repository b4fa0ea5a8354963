"""Sarosi: its claims, and that a verdict changes when what it rests on changes."""

import dataclasses

import pytest

from pamsim.papers.claim import Verdict
from pamsim.papers.nguyen2024 import claims as paper_c
from pamsim.papers.replicate import PAPERS
from pamsim.papers.sarosi import claims as paper_e
from pamsim.papers.sarosi import equations as paper_e_equations
from pamsim.papers.sarosi import fits as paper_e_fits
from pamsim.papers.sarosi import inverse as paper_e_inverse
from pamsim.papers.sarosi.maps import measured
from pamsim.papers.vandamme2008 import claims as paper_d


@pytest.fixture(scope="module")
def found():
    return {claim.id: claim for claim in paper_e.claims()}


def test_ids_run_through_without_a_gap(found):
    assert list(found) == [f"E-{i:02d}" for i in range(1, 22)]


def test_verdicts(found):
    reproduced = {id for id, claim in found.items() if claim.verdict is Verdict.REPRODUCED}
    inconsistent = {id for id, claim in found.items() if claim.verdict is Verdict.INCONSISTENT}
    assert reproduced == {f"E-{i}" for i in ["01", "02", "04", "06", "09", "11", "14", "17", "21"]}
    assert inconsistent == {"E-10"}


def test_numbers_known_from_elsewhere(found):
    # Points that pull, and the RMS errors of an independent fit with other code.
    assert measured("DMSP-20").force.size == 60
    assert found["E-17"].recomputed == pytest.approx((31.38, 6.04), abs=0.05)
    assert found["E-18"].recomputed == pytest.approx((104.35, 51.83), abs=0.01)
    assert found["E-20"].recomputed == pytest.approx((73.41, 27.69), abs=0.01)
    assert (found["E-07"].recomputed, found["E-08"].recomputed) == (4.0, 7.0)


def test_a_wrong_ideal_law_is_noticed(monkeypatch):
    right = paper_e_equations.ideal_force
    monkeypatch.setattr(paper_e_equations, "ideal_force", lambda *a: 1.001 * right(*a))
    assert paper_e_equations._virtual_work().verdict is Verdict.INCONSISTENT


def test_constants_without_redundancy_count_as_determined():
    claim = paper_e_inverse._rank(
        "E-07", "a line", lambda v, p, kappa: v[0] * p + v[1] * kappa, (1.0, 2.0)
    )
    assert claim.verdict is Verdict.REPRODUCED


def test_another_muscle_contracts_elsewhere(monkeypatch):
    law = paper_e_inverse.PUBLISHED["DMSP-20-200"]
    softer = dataclasses.replace(law, f=law.f - 300.0)
    monkeypatch.setattr(paper_e_inverse, "PUBLISHED", {"DMSP-20-200": softer})
    assert paper_e_inverse._published_largest().verdict is Verdict.NOT_REPRODUCIBLE


def test_a_better_two_factor_law_would_win(monkeypatch):
    right = paper_e_fits.fitted_residual
    monkeypatch.setattr(
        paper_e_fits,
        "fitted_residual",
        lambda law: 0.01 * right(law) if law == "corrected" else right(law),
    )
    assert paper_e_fits._better().verdict is Verdict.NOT_REPRODUCIBLE


def test_the_registry_has_the_papers():
    assert (PAPERS["C"], PAPERS["D"], PAPERS["E"]) == (
        paper_c.claims,
        paper_d.claims,
        paper_e.claims,
    )
