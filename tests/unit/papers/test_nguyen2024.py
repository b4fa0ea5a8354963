"""Nguyen 2024: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.papers.claim import Verdict, evaluate, printed_number
from pamsim.papers.nguyen2024 import geometry, loop, search
from tests.unit.papers.judged import judged

PAPER = "nguyen2024"


@pytest.fixture(scope="module")
def found():
    return judged(PAPER).claims


def test_numbers_derived_by_hand(found):
    assert found["nguyen2024-03"].recomputed == pytest.approx(34.24, abs=0.01)
    fibre = judged(PAPER).notes["nguyen2024-02"]
    assert fibre.recomputed == pytest.approx((341.69, 2.6032), rel=1e-4)
    assert found["nguyen2024-17"].recomputed == pytest.approx(149.2, abs=0.1)
    # |K*| = Ke u / |1 + u exp(j alpha pi/2)|, u = 4/3 9^alpha
    u = 4.0 / 3.0 * 9.0 ** np.array([0.8, 0.5, 0.2])
    turn = np.exp(0.5j * np.pi * np.array([0.8, 0.5, 0.2]))
    assert found["nguyen2024-15"].recomputed == pytest.approx(
        tuple(150000.0 * u / np.abs(1.0 + u * turn))
    )


def test_least_squares_recovers_the_element_and_the_population_searches_do_not(found):
    assert found["nguyen2024-28"].recomputed == pytest.approx(search.element(), rel=1e-6)
    for each in (judged(PAPER).notes["nguyen2024-29"], found["nguyen2024-30"]):
        assert each.recomputed != pytest.approx(search.element(), rel=0.1)


def test_a_stiffer_element_fits_into_the_stroke(monkeypatch):
    monkeypatch.setattr(loop, "element", lambda: (0.27, 49.82, 22600.0))
    assert evaluate("nguyen2024-17").verdict is Verdict.INDEPENDENT


def test_softening_with_frequency_is_noticed(monkeypatch):
    # An element of negative order would soften; the claims on frequency must then fail.
    monkeypatch.setattr(loop, "element", lambda: (-0.27, 49.82, 2260.0))
    assert evaluate("nguyen2024-22").verdict is Verdict.INCONSISTENT
    assert evaluate("nguyen2024-21").verdict is Verdict.INCONSISTENT


def test_a_wrong_loop_is_noticed(monkeypatch):
    # Simulated with the identified order, compared with the loop of another.
    right = loop.loop_distance
    monkeypatch.setattr(
        loop,
        "loop_distance",
        lambda x, f, f0, w, order, beta, k: right(x, f, f0, w, order + 0.03, beta, k),
    )
    assert evaluate("nguyen2024-12").verdict is Verdict.INCONSISTENT
    assert evaluate("nguyen2024-13").verdict is Verdict.TEXT_DAMAGED


def test_a_lost_sign_is_noticed(monkeypatch):
    right = geometry.ideal_tension
    monkeypatch.setattr(geometry, "ideal_tension", lambda *a: -right(*a))
    assert evaluate("nguyen2024-04").verdict is Verdict.TEXT_DAMAGED
    assert evaluate("nguyen2024-05").verdict is Verdict.TEXT_DAMAGED


def test_printed_digits_are_kept_and_names_are_checked():
    assert printed_number("nguyen2024", "time_constant").half_unit == pytest.approx(0.005)
    with pytest.raises(InputError, match="time_constant"):
        printed_number("nguyen2024", "time_constnt")
