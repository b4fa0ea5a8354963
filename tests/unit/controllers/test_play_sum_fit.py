"""Play sums fitted to loops: planted weights come back, and the inverse undoes the loop."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.controllers.hysteresis import identify_play_sum
from pamsim.core.errors import InputError
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from pamsim.recordings.excitation import triangle

INPUT = 0.4 * triangle(np.linspace(0.0, 6.0, 1200), 1.0, 0.75)


def run(operator, values):
    memory, found = operator.virgin(), []
    for x in values:
        memory, y = operator.step(memory, float(x))
        found.append(y)
    return np.array(found)


@pytest.fixture
def planted():
    largest = float(np.max(np.abs(INPUT)))
    kept = [0, 2, 5]
    return PlaySum(
        linear=0.6,
        thresholds=tuple(largest * (k + 0.5) / 8 for k in kept),
        weights=(0.3, 0.15, 0.2),
    )


def test_planted_weights_come_back_and_nothing_else(planted):
    found = identify_play_sum(INPUT, run(planted, INPUT), plays=8)
    assert found.operator.linear == pytest.approx(planted.linear, abs=1e-9)
    assert found.operator.thresholds == pytest.approx(planted.thresholds)
    assert found.operator.weights == pytest.approx(planted.weights, abs=1e-9)
    assert found.rms < 1e-12


def test_the_inverse_of_what_was_identified_undoes_it(planted):
    noise = 2e-3 * np.random.default_rng(3).standard_normal(INPUT.size)
    found = identify_play_sum(INPUT, run(planted, INPUT) + noise, plays=8)
    assert found.rms == pytest.approx(2e-3, rel=0.1)
    unseen = 0.3 * np.sin(np.linspace(0.0, 20.0, 700)) * np.cos(np.linspace(0.0, 3.0, 700))
    back = run(found.operator.inverse(), run(found.operator, unseen))
    np.testing.assert_allclose(back, unseen, atol=1e-12)
    lag = np.max(np.abs(run(planted, unseen) - unseen))
    assert np.max(np.abs(run(found.operator.inverse(), run(planted, unseen)) - unseen)) < 0.05 * lag


def test_a_loop_that_leads_gets_no_plays():
    leading = PlaySum(linear=2.0, thresholds=(0.1,), weights=(-1.0,))
    found = identify_play_sum(INPUT, run(leading, INPUT), plays=8)
    assert found.operator.weights == ()
    assert run(found.operator.inverse(), found.operator.linear * INPUT) == pytest.approx(INPUT)


def test_what_has_no_inverse_is_refused():
    with pytest.raises(InputError, match="stays at 0"):
        identify_play_sum(np.zeros(9), np.zeros(9))
    with pytest.raises(InputError, match="one for each"):
        identify_play_sum(INPUT, INPUT[1:])
    with pytest.raises(InputError, match="no inverse"):
        identify_play_sum(INPUT, -INPUT)
