"""Sarosi: its claims, and that a verdict changes when what it rests on changes."""

import dataclasses

import pytest

from pamsim.core.errors import InputError
from pamsim.papers.claim import Verdict, evaluate
from pamsim.papers.sarosi import equations, fits, inverse
from pamsim.papers.sarosi.maps import measured
from tests.unit.papers.judged import (
    assert_documented,
    assert_every_claim_can_fail,
    assert_identities_hold_whatever_is_printed,
    assert_repeats_name_a_claim_with_their_verdict,
    judged,
    with_verdict,
)

PAPER = "sarosi"


@pytest.fixture(scope="module")
def found():
    return judged(PAPER).claims


def test_every_claim_fails_on_wrong_numbers():
    assert_every_claim_can_fail(PAPER)


def test_repeated_facts_and_documented_counts():
    assert_repeats_name_a_claim_with_their_verdict(PAPER)
    assert_documented(PAPER)


def test_ids_run_through_without_a_gap(found):
    numbered = sorted([*found, *judged(PAPER).notes])
    assert numbered == [f"{PAPER}-{i:02d}" for i in range(1, len(numbered) + 1)]


def test_identities_hold_whatever_is_printed(monkeypatch):
    assert_identities_hold_whatever_is_printed(PAPER, monkeypatch)


def test_verdicts_are_those_of_the_evidence():
    numbers = {
        Verdict.INDEPENDENT: [11, 14],
        Verdict.IDENTITY: [1, 2, 4, 6, 9],
        Verdict.CALIBRATED: [15, 17],
        Verdict.NOT_REPRODUCIBLE: [7, 8, 16],
    }
    for verdict, expected in numbers.items():
        assert with_verdict(PAPER, verdict) == {f"{PAPER}-{n:02d}" for n in expected}


def test_numbers_known_from_elsewhere(found):
    # Points that pull, and the RMS errors of an independent fit with other code.
    assert measured("DMSP-20").force.size == 60
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
