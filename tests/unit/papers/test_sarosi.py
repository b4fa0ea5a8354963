"""Sarosi: its claims, and that a verdict changes when what it rests on changes."""

import dataclasses

import pytest

from pamsim.core.errors import InputError
from pamsim.papers.claim import Verdict, evaluate
from pamsim.papers.sarosi import equations, fits
from tests.unit.papers.judged import judged

PAPER = "sarosi"


@pytest.fixture(scope="module")
def found():
    return judged(PAPER).claims


def test_numbers_known_from_elsewhere(found):
    # Points that pull, and the RMS errors of an independent fit with other code.
    assert fits.measured("DMSP-20").force.size == 60
    assert found["sarosi-17"].recomputed == pytest.approx((31.38, 6.04), abs=0.05)
    assert judged(PAPER).notes["sarosi-18"].recomputed == pytest.approx((104.35, 51.83), abs=0.01)
    assert judged(PAPER).notes["sarosi-20"].recomputed == pytest.approx((73.41, 27.69), abs=0.01)
    assert (found["sarosi-07"].recomputed, found["sarosi-08"].recomputed) == (4.0, 7.0)


def test_claims_on_laws_fitted_to_their_points_are_calibrated(found, monkeypatch):
    right = fits.fitted_residual

    def withheld(law):
        # (1) has nothing to fit; of (4) sarosi-14 takes only the scatter of the points.
        if law in ("strain", "corrected"):
            raise InputError("no fit")
        return right(law)

    monkeypatch.setattr(fits, "fitted_residual", withheld)
    resting = set()
    for id in found:
        try:
            evaluate(id)
        except InputError:
            resting.add(id)
    calibrated = {id for id, claim in found.items() if claim.kind is Verdict.CALIBRATED}
    assert resting == calibrated == {"sarosi-15", "sarosi-16", "sarosi-17"}


def test_a_wrong_ideal_law_is_noticed(monkeypatch):
    right = equations.ideal_force
    monkeypatch.setattr(equations, "ideal_force", lambda *a: 1.001 * right(*a))
    assert evaluate("sarosi-01").verdict is Verdict.INCONSISTENT


def test_constants_without_redundancy_count_as_determined():
    rank = equations._rank(lambda v, p, kappa: v[0] * p + v[1] * kappa, (1.0, 2.0))
    assert rank.value == 2.0


def test_another_muscle_contracts_elsewhere(monkeypatch):
    law = equations.PUBLISHED["DMSP-20-200"]
    softer = dataclasses.replace(law, f=law.f - 300.0)
    monkeypatch.setattr(equations, "PUBLISHED", {"DMSP-20-200": softer})
    assert evaluate("sarosi-11").verdict is Verdict.NOT_REPRODUCIBLE


def test_a_better_two_factor_law_would_win(monkeypatch):
    right = fits.fitted_residual
    monkeypatch.setattr(
        fits,
        "fitted_residual",
        lambda law: 0.01 * right(law) if law == "corrected" else right(law),
    )
    assert evaluate("sarosi-17").verdict is Verdict.NOT_REPRODUCIBLE
