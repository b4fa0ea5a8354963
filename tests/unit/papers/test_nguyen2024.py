"""Nguyen 2024: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.papers.claim import Verdict, evaluate, printed_number
from pamsim.papers.nguyen2024 import geometry, loop, results, search
from pamsim.papers.replicate import paper_claims


@pytest.fixture(scope="module")
def found():
    return {claim.id: claim for claim in paper_claims("nguyen2024")}


def test_ids_run_through_without_a_gap(found):
    assert list(found) == [f"nguyen2024-{i:02d}" for i in range(1, len(found) + 1)]
    assert len(found) == 33


def test_verdicts(found):
    inconsistent = {id for id, claim in found.items() if claim.verdict is Verdict.INCONSISTENT}
    unknown = {id for id, claim in found.items() if claim.verdict is Verdict.NOT_REPRODUCIBLE}
    assert inconsistent == {
        "nguyen2024-14",
        "nguyen2024-17",
        "nguyen2024-18",
        "nguyen2024-25",
        "nguyen2024-33",
    }
    assert unknown == {
        f"nguyen2024-{i}" for i in ["02", "03", "16", "19", "26", "27", "29", "30", "31", "32"]
    }


def test_numbers_derived_by_hand(found):
    assert found["nguyen2024-03"].recomputed == pytest.approx(34.24, abs=0.01)
    assert found["nguyen2024-02"].recomputed == pytest.approx((341.69, 2.6032), rel=1e-4)
    assert found["nguyen2024-17"].recomputed == pytest.approx((74.6, 75.0), abs=0.05)
    # |K*| = Ke u / |1 + u exp(j alpha pi/2)|, u = 4/3 9^alpha
    u = 4.0 / 3.0 * 9.0 ** np.array([0.8, 0.5, 0.2])
    turn = np.exp(0.5j * np.pi * np.array([0.8, 0.5, 0.2]))
    assert found["nguyen2024-15"].recomputed == pytest.approx(
        tuple(150000.0 * u / np.abs(1.0 + u * turn))
    )


def test_least_squares_recovers_the_element_and_the_population_searches_do_not(found):
    assert found["nguyen2024-28"].recomputed == pytest.approx(search.element(), rel=1e-6)
    for id in ("nguyen2024-29", "nguyen2024-30"):
        assert found[id].recomputed != pytest.approx(search.element(), rel=0.1)


def test_a_stiffer_element_fits_into_the_stroke(monkeypatch):
    monkeypatch.setattr(results, "element", lambda: (0.27, 49.82, 22600.0))
    assert evaluate("nguyen2024-17").verdict is Verdict.REPRODUCED


def test_softening_with_frequency_is_noticed(monkeypatch):
    # An element of negative order would soften; the claims on frequency must then fail.
    monkeypatch.setattr(results, "element", lambda: (-0.27, 49.82, 2260.0))
    assert evaluate("nguyen2024-22").verdict is Verdict.INCONSISTENT
    assert evaluate("nguyen2024-21").verdict is Verdict.INCONSISTENT


def test_a_wrong_loop_is_noticed(monkeypatch):
    # Simulated with the identified order, compared with the loop of another.
    right = loop.loop_distance
    monkeypatch.setattr(
        loop,
        "loop_distance",
        lambda x, f, f0, w, order, beta, k: right(x, f, f0, w, order + 0.02, beta, k),
    )
    assert evaluate("nguyen2024-12").verdict is Verdict.INCONSISTENT
    assert evaluate("nguyen2024-13").verdict is Verdict.INCONSISTENT


def test_a_lost_sign_is_noticed(monkeypatch):
    right = geometry.contractive_force
    monkeypatch.setattr(geometry, "contractive_force", lambda *a: -right(*a))
    assert evaluate("nguyen2024-04").verdict is Verdict.INCONSISTENT
    assert evaluate("nguyen2024-05").verdict is Verdict.INCONSISTENT


def test_printed_digits_are_kept_and_names_are_checked():
    assert printed_number("nguyen2024", "time_constant").half_unit == pytest.approx(0.005)
    with pytest.raises(InputError, match="time_constant"):
        printed_number("nguyen2024", "time_constnt")
