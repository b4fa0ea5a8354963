"""Van Damme 2008: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.papers.claim import Verdict, evaluate
from pamsim.papers.vandamme2008 import loop, shape
from pamsim.recordings.printed import Printed
from tests.unit.papers.judged import judged

PAPER = "vandamme2008"


@pytest.fixture(scope="module")
def found():
    return judged(PAPER).claims


def test_numbers_derived_otherwise(found):
    assert found["vandamme2008-07"].recomputed == (-650.0, 2150.0)
    assert found["vandamme2008-01"].recomputed == pytest.approx(40.25, abs=0.01)
    assert found["vandamme2008-12"].recomputed == pytest.approx((0.1, -1.0), abs=1e-9)
    narrow, wide = found["vandamme2008-21"].recomputed
    assert wide / narrow == pytest.approx(0.299 / 0.139)


def test_half_the_swing_would_keep_the_muscle_pulling(monkeypatch):
    right = shape.digits

    def halved(name):
        number = right(name)
        return Printed(number.value / 2.0, 0.5) if name == "force_amplitude" else number

    monkeypatch.setattr(shape, "digits", halved)
    assert evaluate("vandamme2008-07").verdict is Verdict.INDEPENDENT


def test_another_weight_is_noticed(monkeypatch):
    right = loop.printed_weight
    monkeypatch.setattr(loop, "printed_weight", lambda a, b, c, d: right(a, b, -c, d))
    assert evaluate("vandamme2008-12").verdict is Verdict.INCONSISTENT
    assert evaluate("vandamme2008-10").verdict is Verdict.INCONSISTENT


def test_a_leading_factor_is_noticed(monkeypatch):
    # With delta negative the muscle would give energy round a loop.
    monkeypatch.setattr(loop, "printed_parameters", lambda fibres: np.array([-0.299, -0.1, -1.0]))
    assert evaluate("vandamme2008-19").verdict is Verdict.INCONSISTENT


def test_a_fit_to_another_loop_is_not_called_recovered(monkeypatch):
    right = loop._measured_ratio
    monkeypatch.setattr(loop, "_measured_ratio", lambda fibres: 1.0 + 1.05 * (right(fibres) - 1.0))
    assert evaluate("vandamme2008-25").verdict is Verdict.NOT_REPRODUCIBLE
