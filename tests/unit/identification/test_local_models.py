"""Local models over operating points: planted dependence, its absence, untrusted fits."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from pamsim.core.encoding import to_dict
from pamsim.identification.local_models import (
    LocalModel,
    OperatingPoint,
    dependence,
    local_model_map,
)
from pamsim.identification.status import FitStatus
from pamsim.inference.estimate import Estimate
from tests.unit.identification.planted import fit_continuous, record, refuses

PRESSURES = (1e5, 1.5e5, 2e5, 2.5e5, 3e5, 3.5e5)


def test_gain_that_rises_with_pressure_is_found_and_load_is_not_blamed():
    given = [
        (
            record(30 + k, gain=2.0 + (p - 2e5) / 2e5, noise=0.05, n=400),
            OperatingPoint(p, load=(0.0, 1.2)[k % 2], direction=(1, -1, 1)[k % 3]),
        )
        for k, p in enumerate(PRESSURES)
    ]
    # What cannot be trusted stays in the table and out of the regression.
    lost = (record(50, gain=1e-3, noise=1.0, n=400), OperatingPoint(9e5))
    local = local_model_map(
        [LocalModel(point, fit_continuous([trial], order=1)) for trial, point in [*given, lost]]
    )
    assert [m.point.pressure for m in local.models] == [*PRESSURES, 9e5]
    found = {item.parameter: item for item in local.dependences}
    gain, lag, trend = found["K"], found["T"], found["K"].trends["pressure"]
    assert gain.points == 6
    assert trend.interval95[0] < 1.0 / 2e5 < trend.interval95[1]
    assert trend.p_value < 1e-3
    assert gain.trends["load"].p_value > 0.01
    assert gain.heterogeneity_p < 1e-6
    assert "rises" in gain.sentence
    assert "over the range of pressure (p < 0.0001)" in gain.sentence  # as in every other result
    assert lag.mean == np.clip(lag.mean, 0.294, 0.306)
    assert lag.heterogeneity_p > 1e-3
    json.dumps(to_dict(local.dependences), allow_nan=False)
    refuses("operating point", local_model_map, [])


def test_a_map_weights_each_parameter_by_its_own_interval():
    # Of time constants and dampings the logarithms; a zero may be negative.
    rows = {
        "K": ((2.0, (1.0, 3.0)), (3.0, (2.8, 3.2)), (9.0, None)),
        "Tz": ((-0.2, (-0.3, -0.1)), (0.1, (0.05, 0.15))),
        "L": ((0.1, (0.0, 0.2)), (0.2, (0.16, 0.24)), (0.0, (0.0, 0.1))),
        "T1": ((0.5, (0.25, 1.0)), (1.0, (0.8, 1.25)), (1.0, (0.0, np.inf))),
        "zeta": ((0.5, (0.4, 0.625)), (0.3, (0.15, 0.6))),
    }
    models = []
    for k in range(3):
        given = {name: row[k] for name, row in rows.items() if k < len(row)}
        estimates = [
            Estimate(name=name, unit="-", value=value, interval95=sides)
            for name, (value, sides) in given.items()
        ]
        fit = SimpleNamespace(status=FitStatus.CONVERGED, quantile=2.0 + k, estimates=estimates)
        models.append(LocalModel(OperatingPoint(1e5 * k), fit))
    for found in local_model_map(models).dependences:
        logs = found.parameter in ("T1", "zeta")
        ends = [(value, sides[1]) for value, sides in rows.pop(found.parameter)[:2]]
        value, upper = (np.log(ends) if logs else np.array(ends)).T
        errors, apart = (upper - value) / [2.0, 3.0], np.diff(value)[0] ** 2
        # Of two, the scatter between them is what their difference has beyond its own error.
        weights = 1.0 / (errors**2 + max(0.0, (apart - np.sum(errors**2)) / 2.0))
        mean = np.average(value, weights=weights)
        assert (found.points, found.logarithmic) == (2, logs)
        assert found.mean == pytest.approx(np.exp(mean) if logs else mean)
        assert found.heterogeneity_p == pytest.approx(chi2.sf(apart / np.sum(errors**2), 1))
    assert not rows


def test_trends_that_are_not_there_are_seldom_found():
    rng = np.random.default_rng(51)
    given = {"pressure": np.repeat([1e5, 2e5, 3e5], 4), "load": np.tile([0.0, 1.2], 6)}
    errors = rng.uniform(0.05, 0.15, 12)
    for scatter in (0.0, 0.2):
        alarms, spread = 0, 0
        for _ in range(300):
            values = 2.0 + scatter * rng.standard_normal(12) + errors * rng.standard_normal(12)
            local = dependence("K", values, errors, given, logarithmic=False)
            alarms += local.trends["pressure"].p_value < 0.05
            spread += local.heterogeneity_p < 0.05
        # Binomial(300, 0.05): 99.9 % of seeds give at most 28.
        assert alarms <= 28
        assert spread <= 28 if scatter == 0.0 else spread > 250


def test_planted_trends_are_covered_by_their_intervals():
    rng = np.random.default_rng(52)
    x, hits = np.linspace(0.0, 3.0, 10), 0
    for _ in range(200):
        errors = rng.uniform(0.05, 0.15, 10)
        values = 1.0 - 0.4 * x + 0.1 * rng.standard_normal(10) + errors * rng.standard_normal(10)
        local = dependence("K", values, errors, {"load": x}, logarithmic=False)
        low, high = local.trends["load"].interval95
        hits += low < -0.4 < high
    assert 178 <= hits <= 199  # Binomial(200, 0.95): 190 expected


def test_regressors_that_are_linearly_dependent_are_left_out():
    p = np.array([1e5, 2e5, 3e5, 4e5, 5e5])
    same = {"pressure": p, "load": p / 1e5, "direction": np.ones(5)}
    local = dependence("T", np.log(p), np.full(5, 0.1), same, logarithmic=True)
    assert set(local.trends) == {"pressure"}
    few = dependence("T", np.log(p[:2]), np.full(2, 0.1), {"pressure": p[:2]}, logarithmic=True)
    assert few.trends == {}
    assert "no regressor" in few.sentence
