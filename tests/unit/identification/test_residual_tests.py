"""The portmanteau test keeps its level under coloured noise and detects what a model is missing."""

import json

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.identification import residual_tests
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import residual_independence, residual_nonlinearity
from tests.unit.identification.planted import fit_arx, fit_continuous, fit_oe, record


@pytest.mark.parametrize("phi", [0.0, 0.9])
def test_level_of_a_right_model(phi):
    chances = []
    for seed in range(25):
        given = [record(2000 + seed, noise=0.2, phi=phi, n=300)]
        chances.append(residual_independence(fit_continuous(given, order=1), given).p_value)
    # At 5 % of 25 more than five alarms have chance 1e-3. A test that never gives small p values
    # would be as wrong, so their mean is held too (sd 0.058).
    assert np.sum(np.array(chances) < 0.05) <= 5
    assert np.mean(chances) == pytest.approx(0.5, abs=0.18)


def test_missing_dynamics_are_seen():
    for lack, options in (("lag", {"constants": (0.1, 0.4)}), ("dead time", {"delay": 0.08})):
        for phi in (0.0, 0.9):
            given = [record(21, noise=0.2, phi=phi, **options)]
            poor = residual_independence(fit_continuous(given, order=1), given)
            assert not poor.independent, (lack, phi)
            assert "missing" in poor.sentence
            asked = {"order": 2} if lack == "lag" else {"order": 1, "dead_time": True}
            fit = fit_continuous(given, **asked)
            rich = residual_independence(fit, given)
            assert rich.p_value > 100.0 * poor.p_value
            if phi == 0.0 and lack == "dead time":  # lags reach past it and the slowest decay
                decay = fit.structure.slowest(fit.coordinates)
                assert rich.longest_lag < 0.25 * given[0].duration
                assert rich.longest_lag - fit.dead_time == pytest.approx(3.0 * decay, rel=1e-9)


def test_discrete_models_are_tested_too():
    given = [record(seed, constants=(0.1, 0.4), noise=0.1) for seed in (22, 23)]
    # Right models fall below 5 % now and then; below 0.1 % is significant for one seed.
    assert residual_independence(fit_oe(given, nb=2, nf=2, nk=1), given).p_value > 1e-3
    assert not residual_independence(fit_oe(given, nb=1, nf=1, nk=1), given).independent
    poor = residual_independence(fit_arx(given, na=1, nb=1, nk=1), given)
    assert not poor.independent
    json.dumps(to_dict(poor), allow_nan=False)


def test_tests_of_blocks_of_rows_are_those_of_all_rows(monkeypatch):
    """Under coloured noise a row depends on rows of the block before; ARX begins later."""
    given = [record(seed, noise=0.2, phi=0.9, n=n) for seed, n in ((27, 300), (28, 410))]
    lag, arx = fit_continuous(given, order=1), fit_arx(given, na=2, nb=1, nk=1)
    tests = (residual_independence, lag), (residual_nonlinearity, lag), (residual_independence, arx)
    found = []
    for rows in (1000, 64):
        monkeypatch.setattr(residual_tests, "_BLOCK", rows)
        found.append([test(fit, given).statistic for test, fit in tests])
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_what_is_perfect_leaves_nothing_to_explain():
    given = [record(24)]
    fit = fit_continuous(given, order=1)
    result = residual_independence(fit, given)
    assert result.independent
    assert "to rounding" in result.sentence


def test_fewer_samples_than_lags_are_tested_in_the_directions_that_they_have():
    given = [record(24, noise=0.05, n=28, hold=2)]  # moves in its last eight samples
    result = residual_independence(fit_continuous(given, order=1), given)
    assert 0 < result.degrees_of_freedom[0] <= 8


def row_by_row(seed, *, early=False, feedback=0.0, n=400, interval=0.02, constant=0.1):
    """A lag of gain 2 under levels, or under a controller that reads the output of its row."""
    draw = np.random.default_rng(seed)
    level, noise = np.repeat(draw.uniform(-1.0, 1.0, n // 10), 10), 0.02 * draw.normal(size=n)
    level[:10] = 0.0
    u, y, x, decay = np.zeros(n), np.zeros(n), 0.0, np.exp(-interval / constant)
    for k in range(n):
        y[k] = x + noise[k]
        u[k] = feedback * (level[k] - y[k]) if feedback else level[k]
        x = decay * x + 2.0 * (1.0 - decay) * u[k]
        y[k] = x + noise[k] if early else y[k]
    return [SignalRecord("rows", interval * np.arange(n), u, y)]


def test_an_output_read_after_its_input_acted_is_seen_and_a_controller_is_not_blamed():
    given = row_by_row(1, early=True)
    fit = fit_continuous(given, order=1)
    assert not fit["K"].interval95[0] < 2.0 < fit["K"].interval95[1]  # what is missing biases it
    assert not residual_independence(fit, given).independent
    chances = []
    for seed in range(15):
        given = row_by_row(seed, feedback=1.0, n=800)
        chances.append(residual_independence(fit_continuous(given, order=1), given).p_value)
    # More than four alarms of 15 have chance 6e-4.
    assert np.sum(np.array(chances) < 0.05) <= 4
