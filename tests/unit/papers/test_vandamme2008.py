"""Van Damme 2008: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.papers.claim import Verdict, evaluate
from pamsim.papers.vandamme2008 import delta, factor, preisach, shape
from pamsim.recordings.printed import Printed
from tests.unit.papers.judged import (
    assert_documented,
    assert_every_claim_can_fail,
    assert_identities_hold_whatever_is_printed,
    assert_repeats_name_a_claim_with_their_verdict,
    judged,
    with_verdict,
)

PAPER = "vandamme2008"


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
        Verdict.INDEPENDENT: [1, 3, 5, 15, 19, 25],
        Verdict.IDENTITY: [2, 10, 11, 12, 13, 14, 16, 17, 20, 21],
        Verdict.INCONSISTENT: [7],
        Verdict.NOT_REPRODUCIBLE: [26],
    }
    for verdict, expected in numbers.items():
        assert with_verdict(PAPER, verdict) == {f"{PAPER}-{n:02d}" for n in expected}


def test_numbers_derived_otherwise(found):
    assert found["vandamme2008-07"].recomputed == (-650.0, 2150.0)
    assert found["vandamme2008-01"].recomputed == pytest.approx(40.25, abs=0.01)
    assert found["vandamme2008-12"].recomputed == pytest.approx((0.1, -1.0), abs=1e-9)
    narrow, wide = found["vandamme2008-21"].recomputed
    assert wide / narrow == pytest.approx(0.299 / 0.139)


def test_half_the_swing_would_keep_the_muscle_pulling(monkeypatch):
    right = shape.printed_number

    def halved(paper, name):
        number = right(paper, name)
        return Printed(number.value / 2.0, 0.5) if name == "force_amplitude" else number

    monkeypatch.setattr(shape, "printed_number", halved)
    assert evaluate("vandamme2008-07").verdict is Verdict.INDEPENDENT


def test_another_weight_is_noticed(monkeypatch):
    right = preisach.printed_weight
    monkeypatch.setattr(preisach, "printed_weight", lambda a, b, c, d: right(a, b, -c, d))
    assert evaluate("vandamme2008-12").verdict is Verdict.INCONSISTENT
    assert evaluate("vandamme2008-10").verdict is Verdict.INCONSISTENT


def test_a_leading_factor_is_noticed(monkeypatch):
    # With delta negative the muscle would give energy round a loop.
    monkeypatch.setattr(factor, "printed_parameters", lambda fibres: np.array([-0.299, -0.1, -1.0]))
    assert evaluate("vandamme2008-19").verdict is Verdict.INCONSISTENT


def test_a_fit_to_another_loop_is_not_called_recovered(monkeypatch):
    right = delta._measured_ratio
    monkeypatch.setattr(delta, "_measured_ratio", lambda fibres: 1.0 + 1.05 * (right(fibres) - 1.0))
    assert evaluate("vandamme2008-25").verdict is Verdict.NOT_REPRODUCIBLE
