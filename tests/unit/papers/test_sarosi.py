"""Sarosi: its claims, and that a verdict changes when what it rests on changes."""

import dataclasses

import pytest

from pamsim.papers.claim import Verdict, evaluate
from pamsim.papers.replicate import paper_claims
from pamsim.papers.sarosi import equations, fits, inverse
from pamsim.papers.sarosi.maps import measured


@pytest.fixture(scope="module")
def found():
    return {claim.id: claim for claim in paper_claims("sarosi")}


def test_ids_run_through_without_a_gap(found):
    assert list(found) == [f"sarosi-{i:02d}" for i in range(1, 22)]


def test_verdicts(found):
    reproduced = {id for id, claim in found.items() if claim.verdict is Verdict.REPRODUCED}
    inconsistent = {id for id, claim in found.items() if claim.verdict is Verdict.INCONSISTENT}
    assert reproduced == {
        f"sarosi-{i}" for i in ["01", "02", "04", "06", "09", "11", "14", "17", "21"]
    }
    assert inconsistent == {"sarosi-10"}


def test_numbers_known_from_elsewhere(found):
    # Points that pull, and the RMS errors of an independent fit with other code.
    assert measured("DMSP-20").force.size == 60
    assert found["sarosi-17"].recomputed == pytest.approx((31.38, 6.04), abs=0.05)
    assert found["sarosi-18"].recomputed == pytest.approx((104.35, 51.83), abs=0.01)
    assert found["sarosi-20"].recomputed == pytest.approx((73.41, 27.69), abs=0.01)
    assert (found["sarosi-07"].recomputed, found["sarosi-08"].recomputed) == (4.0, 7.0)


def test_a_wrong_ideal_law_is_noticed(monkeypatch):
    right = equations.ideal_force
    monkeypatch.setattr(equations, "ideal_force", lambda *a: 1.001 * right(*a))
    assert evaluate("sarosi-01").verdict is Verdict.INCONSISTENT


def test_constants_without_redundancy_count_as_determined():
    rank = inverse._rank(lambda v, p, kappa: v[0] * p + v[1] * kappa, (1.0, 2.0))
    assert rank.value == 2.0


def test_another_muscle_contracts_elsewhere(monkeypatch):
    law = inverse.PUBLISHED["DMSP-20-200"]
    softer = dataclasses.replace(law, f=law.f - 300.0)
    monkeypatch.setattr(inverse, "PUBLISHED", {"DMSP-20-200": softer})
    assert evaluate("sarosi-11").verdict is Verdict.NOT_REPRODUCIBLE


def test_a_better_two_factor_law_would_win(monkeypatch):
    right = fits.fitted_residual
    monkeypatch.setattr(
        fits,
        "fitted_residual",
        lambda law: 0.01 * right(law) if law == "corrected" else right(law),
    )
    assert evaluate("sarosi-17").verdict is Verdict.NOT_REPRODUCIBLE
