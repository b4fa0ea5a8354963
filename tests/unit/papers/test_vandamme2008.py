"""Van Damme 2008: its claims, and that a verdict changes when what it rests on changes."""

import numpy as np
import pytest

from pamsim.papers.claim import Verdict
from pamsim.papers.vandamme2008 import claims as paper_d
from pamsim.papers.vandamme2008 import delta as paper_d_delta
from pamsim.papers.vandamme2008 import factor as paper_d_factor
from pamsim.papers.vandamme2008 import preisach as paper_d_preisach
from pamsim.papers.vandamme2008 import shape as paper_d_shape


@pytest.fixture(scope="module")
def found():
    return {claim.id: claim for claim in paper_d.claims()}


def test_ids_run_through_without_a_gap(found):
    assert list(found) == [f"D-{i:02d}" for i in range(1, 27)]


def test_verdicts(found):
    inconsistent = {id for id, claim in found.items() if claim.verdict is Verdict.INCONSISTENT}
    unknown = {id for id, claim in found.items() if claim.verdict is Verdict.NOT_REPRODUCIBLE}
    assert inconsistent == {"D-07"}
    assert unknown == {f"D-{i}" for i in ["04", "09", "18", "20", "22", "23", "24"]}


def test_numbers_derived_otherwise(found):
    assert found["D-07"].recomputed == (-650.0, 2150.0)
    assert found["D-01"].recomputed == pytest.approx(40.25, abs=0.01)
    assert found["D-12"].recomputed == pytest.approx((0.1, -1.0), abs=1e-9)
    narrow, wide = found["D-21"].recomputed
    assert wide / narrow == pytest.approx(0.299 / 0.139)


def test_half_the_swing_would_keep_the_muscle_pulling(monkeypatch):
    right = paper_d_shape.value
    monkeypatch.setattr(
        paper_d_shape, "value", lambda name: right(name) / (2 if name == "force_amplitude" else 1)
    )
    assert paper_d_shape._imposed_force().verdict is Verdict.REPRODUCED


def test_another_weight_is_noticed(monkeypatch):
    right = paper_d_preisach.seed_weight
    monkeypatch.setattr(paper_d_preisach, "seed_weight", lambda a, b, c, d: right(a, b, -c, d))
    assert paper_d_preisach._most_frequent().verdict is Verdict.INCONSISTENT
    assert paper_d_preisach._normalised().verdict is Verdict.INCONSISTENT


def test_a_leading_factor_is_noticed(monkeypatch):
    # With delta negative the muscle would give energy round a loop.
    monkeypatch.setattr(paper_d_factor, "truth", lambda fibres: np.array([-0.299, -0.1, -1.0]))
    assert paper_d_factor._loses_energy().verdict is Verdict.INCONSISTENT


def test_a_fit_to_another_loop_is_not_called_recovered(monkeypatch):
    right = paper_d_delta._measured_ratio
    monkeypatch.setattr(
        paper_d_delta, "_measured_ratio", lambda fibres: 1.0 + 1.05 * (right(fibres) - 1.0)
    )
    assert paper_d_delta._recovered().verdict is Verdict.NOT_REPRODUCIBLE
