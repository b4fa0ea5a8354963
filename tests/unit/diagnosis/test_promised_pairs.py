"""What two effects promise together: least squares of their signatures."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.diagnosis.method.screen import Screened, Trace, promised_pairs
from pamsim.diagnosis.method.signature import TangentSpace, signature
from tests.unit.diagnosis.toy_arm import BIAS, DRY, LEAK

_RNG = np.random.default_rng(3)
ONE, TWO, OTHER = np.linalg.qr(_RNG.standard_normal((60, 3)))[0].T
FREE = TangentSpace(np.zeros((60, 1)))


def screened(candidate, change):
    """An effect whose first probe leaves this change."""
    probe = candidate.probes[0]
    trace = Trace(probe=probe, change=change, signature=signature(FREE, change, probe.size))
    return Screened(candidate=candidate, traces=(trace,), similarity=0.0, gain=0.0)


def test_two_that_explain_all_come_before_one_that_is_similar_to_both():
    misfit = 2.0 * ONE + 1.5 * TWO
    mixed = ONE + TWO + 0.3 * OTHER
    found = promised_pairs([screened(DRY, ONE), screened(LEAK, TWO), screened(BIAS, mixed)], misfit)
    assert {s.candidate.name for s in found[0].effects} == {"dry", "leak"}
    assert found[0].gain == pytest.approx(misfit @ misfit, rel=1e-9)
    single = (mixed @ misfit) ** 2 / (mixed @ mixed)
    assert single > max((ONE @ misfit) ** 2, (TWO @ misfit) ** 2)
    (dry,), (leak,) = DRY.parameters, LEAK.parameters
    at = {s.candidate.name: s.traces[0].probe.values for s in found[0].effects}
    assert found[0].start["dry"] == pytest.approx(2.0 * at["dry"][dry.name], rel=1e-6)
    assert found[0].start["leak"] == pytest.approx(1.5 * at["leak"][leak.name], rel=1e-6)


def test_gains_are_those_of_least_squares():
    misfit = _RNG.standard_normal(60)
    tilted = ONE + 0.8 * TWO
    for pair in promised_pairs([screened(BIAS, ONE), screened(LEAK, tilted)], misfit):
        columns = np.stack([s.traces[0].signature.projected for s in pair.effects], axis=1)
        shares, *_ = np.linalg.lstsq(columns, misfit, rcond=None)
        left = misfit - columns @ shares
        assert pair.gain == pytest.approx(misfit @ misfit - left @ left, rel=1e-9)


def test_an_effect_of_the_wrong_sign_makes_no_pair_nor_do_two_of_one_signature():
    assert not promised_pairs([screened(DRY, ONE), screened(LEAK, TWO)], ONE - TWO)
    beside = screened(BIAS, ONE + 0.01 * TWO)
    assert not promised_pairs([screened(DRY, ONE), beside], ONE + 0.005 * TWO)
