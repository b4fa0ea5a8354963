"""The portmanteau test keeps its level under coloured noise and detects what a model is missing."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.discrete_fit import fit_arx_records, fit_oe
from pamsim.linear.residual_tests import residual_independence
from tests.unit.linear.planted import record, refuses


@pytest.mark.parametrize("phi", [0.0, 0.9])
def test_level_of_a_right_model(phi: float) -> None:
    chances = []
    for seed in range(25):
        given = [record(2000 + seed, noise=0.2, phi=phi, n=300)]
        chances.append(residual_independence(fit_continuous(given, order=1), given).p_value)
    # At 5 % of 25 more than five alarms have chance 1e-3. A test that never gives small p values
    # would be as wrong, so their mean is held too (sd 0.058).
    assert np.sum(np.array(chances) < 0.05) <= 5
    assert np.mean(chances) == pytest.approx(0.5, abs=0.18)


@pytest.mark.parametrize("phi", [0.0, 0.9])
@pytest.mark.parametrize("lack", ["lag", "dead time"])
def test_missing_dynamics_are_seen(lack: str, phi: float) -> None:
    options = {"constants": (0.1, 0.4)} if lack == "lag" else {"delay": 0.08}
    given = [record(21, noise=0.2, phi=phi, **options)]
    poor = residual_independence(fit_continuous(given, order=1), given)
    assert not poor.independent
    assert "missing" in poor.sentence
    rich = fit_continuous(given, order=2 if lack == "lag" else 1, dead_time=lack == "dead time")
    assert residual_independence(rich, given).p_value > 100.0 * poor.p_value


def test_discrete_models_are_tested_too() -> None:
    given = [
        record(22, constants=(0.1, 0.4), noise=0.1),
        record(23, constants=(0.1, 0.4), noise=0.1),
    ]
    # Right models fall below 5 % now and then; below 0.1 % is significant for one seed.
    assert residual_independence(fit_oe(given, nb=2, nf=2, nk=1), given).p_value > 1e-3
    assert not residual_independence(fit_oe(given, nb=1, nf=1, nk=1), given).independent
    poor = residual_independence(fit_arx_records(given, na=1, nb=1, nk=1), given)
    assert not poor.independent
    json.dumps(to_dict(poor), allow_nan=False)


def test_what_is_perfect_leaves_nothing_to_explain() -> None:
    given = [record(24)]
    result = residual_independence(fit_continuous(given, order=1), given)
    assert result.independent
    assert "to rounding" in result.sentence


def test_only_fitted_trials_can_be_asked() -> None:
    fit = fit_continuous([record(25, noise=0.1)], order=1)
    refuses("fitted trials", residual_independence, fit, [record(26)])
    refuses("lags = 0", residual_independence, fit, [record(25, noise=0.1)], lags=0)


def test_lags_reach_past_the_dead_time_and_the_slowest_decay() -> None:
    given = [record(21, noise=0.2, delay=0.08)]
    fit = fit_continuous(given, order=1, dead_time=True)
    decay = fit.structure.slowest(fit.coordinates)
    longest = residual_independence(fit, given).longest_lag
    assert longest < 0.25 * given[0].duration
    assert longest - fit.dead_time == pytest.approx(3.0 * decay, rel=1e-9)
