"""Nguyen 2024: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.papers.claim import Verdict
from pamsim.papers.nguyen2024 import claims as paper_c
from pamsim.papers.nguyen2024 import geometry as paper_c_geometry
from pamsim.papers.nguyen2024 import loop as paper_c_loop
from pamsim.papers.nguyen2024 import results as paper_c_results
from pamsim.papers.nguyen2024 import search as paper_c_search
from pamsim.papers.printed_number import printed_number


@pytest.fixture(scope="module")
def found():
    return {claim.id: claim for claim in paper_c.claims()}


def test_ids_run_through_without_a_gap(found):
    assert list(found) == [f"C-{i:02d}" for i in range(1, len(found) + 1)]
    assert len(found) == 33


def test_verdicts(found):
    inconsistent = {id for id, claim in found.items() if claim.verdict is Verdict.INCONSISTENT}
    unknown = {id for id, claim in found.items() if claim.verdict is Verdict.NOT_REPRODUCIBLE}
    assert inconsistent == {"C-14", "C-17", "C-18", "C-25", "C-33"}
    assert unknown == {
        f"C-{i}" for i in ["02", "03", "16", "19", "26", "27", "29", "30", "31", "32"]
    }


def test_numbers_derived_by_hand(found):
    assert found["C-03"].recomputed == pytest.approx(34.24, abs=0.01)
    assert found["C-02"].recomputed == pytest.approx((341.69, 2.6032), rel=1e-4)
    assert found["C-17"].recomputed == pytest.approx((74.6, 75.0), abs=0.05)
    # |K*| = Ke u / |1 + u exp(j alpha pi/2)|, u = 4/3 9^alpha
    u = 4.0 / 3.0 * 9.0 ** np.array([0.8, 0.5, 0.2])
    turn = np.exp(0.5j * np.pi * np.array([0.8, 0.5, 0.2]))
    assert found["C-15"].recomputed == pytest.approx(tuple(150000.0 * u / np.abs(1.0 + u * turn)))


def test_least_squares_recovers_the_element_and_the_population_searches_do_not(found):
    assert found["C-28"].recomputed == pytest.approx(paper_c_search.element(), rel=1e-6)
    for id in ("C-29", "C-30"):
        assert found[id].recomputed != pytest.approx(paper_c_search.element(), rel=0.1)


def test_a_stiffer_element_fits_into_the_stroke(monkeypatch):
    monkeypatch.setattr(paper_c_results, "element", lambda: (0.27, 49.82, 22600.0))
    assert paper_c_results._stroke().verdict is Verdict.REPRODUCED


def test_softening_with_frequency_is_noticed(monkeypatch):
    # An element of negative order would soften; the claims on frequency must then fail.
    monkeypatch.setattr(paper_c_results, "element", lambda: (-0.27, 49.82, 2260.0))
    assert paper_c_results._stiffer().verdict is Verdict.INCONSISTENT
    assert paper_c_results._with_frequency().verdict is Verdict.INCONSISTENT


def test_a_wrong_loop_is_noticed(monkeypatch):
    # Simulated with the identified order, compared with the loop of another.
    right = paper_c_loop.loop_distance
    monkeypatch.setattr(
        paper_c_loop,
        "loop_distance",
        lambda x, f, f0, w, order, beta, k: right(x, f, f0, w, order + 0.02, beta, k),
    )
    assert paper_c_loop._ellipse().verdict is Verdict.INCONSISTENT
    assert paper_c_loop._points().verdict is Verdict.INCONSISTENT


def test_a_lost_sign_is_noticed(monkeypatch):
    right = paper_c_geometry.contractive_force
    monkeypatch.setattr(paper_c_geometry, "contractive_force", lambda *a: -right(*a))
    assert paper_c_geometry._contractive_sign().verdict is Verdict.INCONSISTENT
    assert paper_c_geometry._restoring_sign().verdict is Verdict.INCONSISTENT


def test_printed_digits_are_kept_and_names_are_checked():
    assert printed_number("C", "time_constant").half_unit == pytest.approx(0.005)
    with pytest.raises(InputError, match="time_constant"):
        printed_number("C", "time_constnt")
