"""Models fitted to a frequency response: planted ones come back, with intervals that hold."""

import control
import numpy as np
import pytest

from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.records import FrequencyRecord
from pamsim.identification.status import FitStatus
from pamsim.identification.transfer_function import continuous
from tests.unit.core.refusals import all_refused
from tests.unit.identification.planted import lags

W = np.geomspace(0.1, 100.0, 50)
PAIR = [1.0 / 25.0, 2.0 * 0.1 / 5.0, 1.0]  # wn = 5 rad/s, zeta = 0.1
PAIR_AND_LAG = np.polymul(PAIR, [1.0, 1.0])
TWO_PAIRS_AND_LAG = np.polymul(PAIR_AND_LAG, [1.0 / 400.0, 0.002, 1.0])
TWO_LAGS = {"order": 2, "real_lags": True}
LATE = {"order": 3, "zeros": 1, "dead_time": True}

# Numerator, denominator, dead time, and how it is asked for.
PLANTS = {
    "late lag": ([-2.0], lags(0.3), 0.04, {"order": 1, "dead_time": True}),
    "two lags": ([2.0], lags(0.1, 1.0), 0.0, TWO_LAGS),
    "pair": ([2.0], PAIR, 0.0, {"order": 2}),
    "poles beyond what is measured": ([2.0], lags(0.003, 30.0), 0.0, TWO_LAGS),
    "zero on the right": ([-0.3, 2.0], lags(0.1, 1.0), 0.0, {"order": 2, "zeros": 1}),
    "late, pair, lag, zero": ([0.2, 2.0], PAIR_AND_LAG, 0.05, LATE),
    "two pairs and a lag": ([0.02, 0.3, 2.0], TWO_PAIRS_AND_LAG, 0.0, {"order": 5, "zeros": 2}),
}


def planted(numerator, denominator, delay=0.0, *, noise=0.0, seed=1):
    """Response by python-control, with independent relative errors."""
    draw = np.random.default_rng(seed).normal(size=(2, W.size))
    response = np.array([control.tf(numerator, denominator)(1j * w) for w in W])
    return response * np.exp(-1j * W * delay) * (1.0 + noise * (draw[0] + 1j * draw[1]))


def fit_frequency_response(frequency, response, **which):
    structure = ContinuousStructure(**{"real_lags": False, **which})
    return fit_model(FrequencyRecord(frequency, response), structure)


@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_plant_comes_back(name):
    numerator, denominator, delay, asked = PLANTS[name]
    exact = planted(numerator, denominator, delay)
    fit = fit_frequency_response(W, exact, **asked)
    np.testing.assert_allclose(fit.numerator, numerator, rtol=1e-4)
    np.testing.assert_allclose(fit.denominator, denominator, rtol=1e-4)
    assert fit.dead_time == pytest.approx(delay, abs=1e-6)
    assert fit.fit_percent > 99.999
    if not delay:
        found = continuous(fit)
        np.testing.assert_allclose([found(1j * w) for w in W], exact, rtol=1e-3)
    noisy = fit_frequency_response(W, planted(numerator, denominator, delay, noise=0.01), **asked)
    assert noisy.status is FitStatus.CONVERGED
    assert noisy.fit_percent == pytest.approx(100.0 - np.sqrt(2.0), abs=0.3)
    np.testing.assert_allclose(noisy.denominator, denominator, rtol=0.1)


def test_intervals_contain_the_planted_numbers_as_often_as_they_say():
    inside, count = np.zeros(4), 50
    for seed in range(count):
        response = planted([0.4, 2.0], lags(0.1, 1.0), noise=0.05, seed=seed)
        fit = fit_frequency_response(W, response, order=2, zeros=1, real_lags=True)
        for i, (name, value) in enumerate((("K", 2.0), ("T1", 0.1), ("T2", 1.0), ("Tz", 0.2))):
            low, high = fit[name].interval95
            inside[i] += low < value < high
    # 200 intervals: 95 % less three standard deviations of a count.
    assert np.mean(inside) / count > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / (4 * count))


def test_a_pole_that_the_response_does_not_show_is_not_trusted():
    fit = fit_frequency_response(W, planted([2.0], lags(0.1, 1.0), noise=0.01), order=3)
    assert fit.status is FitStatus.DEGENERATE
    assert "far outside the measured frequencies (0.1 to 100 rad/s)" in fit.sentence
    hidden = fit_frequency_response(W[:20], planted([2.0], lags(0.3), noise=0.05)[:20], order=2)
    assert hidden.status is FitStatus.DEGENERATE


@pytest.mark.parametrize("factor", [0.95, 1.05])
@pytest.mark.parametrize("edge", [W[-1] * 10.0, W[0] / 10.0])
def test_a_pole_may_lie_ten_times_beyond_what_is_measured(edge, factor):
    pole = edge * factor if edge > 1.0 else edge / factor
    fit = fit_frequency_response(W, planted([2.0], lags(1.0 / pole, 1.0)), **TWO_LAGS)
    assert (fit.status is FitStatus.CONVERGED) is (factor < 1.0)
    assert (f"a pole at {pole:.3g} rad/s lies far outside" in fit.sentence) is (factor > 1.0)


def test_a_response_that_leads_has_no_dead_time():
    fit = fit_frequency_response(
        W, planted([2.0], lags(0.3), -9e-4, noise=1e-3), order=1, dead_time=True
    )
    assert (fit.status, fit["L"].interval95) == (FitStatus.DEGENERATE, (0.0, 0.0))
    assert "no dead time is detected" in fit.sentence


def test_what_is_no_response_is_refused():
    good = planted([2.0], lags(0.3))
    bad = {
        "few": (W[:7], good[:7], {}, "7 frequencies are too few; give 8"),
        "unknowns": (W[:9], good[:9], {"order": 4, "zeros": 3}, "too few for 8 unknowns"),
        "not rising": (W[::-1], good, {}, "sort them"),
        "from 0": (np.append(0.0, W[1:]), good, {}, "must be above 0"),
        "no response": (W, 0.0 * good, {}, "is 0 or not finite"),
        "shape": (W, good[:9], {}, "a response of shape"),
        "zeros": (W, good, {"order": 2, "zeros": 3}, "zeros = 3 of 2 poles"),
    }
    all_refused(
        bad, lambda w, given, asked: fit_frequency_response(w, given, **{"order": 1} | asked)
    )
