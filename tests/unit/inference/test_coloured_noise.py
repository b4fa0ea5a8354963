"""AR models of residuals: planted models, exact whitening, stationarity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise
from tests.unit.linear.planted import coloured

REFLECTIONS = st.lists(st.floats(-0.95, 0.95), min_size=0, max_size=5)


@settings(max_examples=30, deadline=None)
@given(reflections=REFLECTIONS, variance=st.floats(0.1, 10.0))
def test_whitening_turns_the_models_own_covariance_into_white(
    reflections: list[float], variance: float
) -> None:
    noise = ArNoise(tuple(reflections), variance)
    covariance = toeplitz(noise.autocovariance(30))
    whitener = noise.whiten(np.eye(30))
    white = whitener @ covariance @ whitener.T
    np.testing.assert_allclose(white, variance * np.eye(30), atol=1e-8 * covariance[0, 0])


@settings(max_examples=30, deadline=None)
@given(reflections=REFLECTIONS)
def test_any_reflections_make_a_stationary_model(reflections: list[float]) -> None:
    noise = ArNoise(tuple(reflections), 1.0)
    poles = np.roots([1.0, *(-c for c in noise.coefficients)])
    assert np.all(np.abs(poles) < 1.0)


def test_planted_ar2_is_found_from_several_trials() -> None:
    rng = np.random.default_rng(31)
    trials = [lfilter([0.5], [1.0, -1.5, 0.7], rng.standard_normal(3000)) for _ in range(3)]
    noise = fit_ar_noise(trials)
    assert noise.coefficients[:2] == pytest.approx((1.5, -0.7), abs=0.05)
    assert noise.variance == pytest.approx(0.25, rel=0.05)
    assert noise.standard_deviation == pytest.approx(np.std(np.concatenate(trials)), rel=0.05)


def test_white_noise_is_mostly_left_white() -> None:
    rng = np.random.default_rng(32)
    orders = [fit_ar_noise([rng.standard_normal(400)]).order for _ in range(60)]
    # AICc keeps a spurious coefficient in about one of four.
    assert np.mean(np.array(orders) == 0) > 0.5


@pytest.mark.parametrize("time", [0.1, 0.3])
def test_correlation_time_is_that_of_exponential_noise(time: float) -> None:
    rng = np.random.default_rng(33)
    phi = np.exp(-0.01 / time)
    noise = fit_ar_noise([coloured(rng, 20_000, phi) for _ in range(2)])
    assert noise.correlation_time(0.01) == pytest.approx(time, rel=0.2)
    assert ArNoise((), 2.0).correlation_time(0.01) == 0.005
    assert ArNoise((), 0.0).correlation_time(0.01) == 0.005  # of a perfect fit


def test_no_residual_is_white_noise_of_no_variance() -> None:
    noise = fit_ar_noise([np.zeros(50)])
    assert (noise.order, noise.variance) == (0, 0.0)


def test_noise_that_a_fit_took_up_is_not_lost() -> None:
    # A polynomial of degree 8 takes up slow noise, most of what AR(1) with 0.9 has.
    rng = np.random.default_rng(34)
    samples, truth = 120, ArNoise((-0.9,), 1.0)
    covariance = toeplitz(truth.autocovariance(samples))
    columns = np.vander(np.linspace(-1.0, 1.0, samples), 9)
    white = truth.whiten(columns)
    basis, triangle = np.linalg.qr(white)
    spread = columns @ np.linalg.inv(triangle)
    noise = np.linalg.cholesky(covariance) @ rng.standard_normal((samples, 400))
    left = list((noise - spread @ (basis.T @ truth.whiten(noise))).T)
    found = fit_ar_noise(left, most=1, absorbed=[spread] * len(left))
    assert found.coefficients[0] == pytest.approx(0.9, abs=0.005)
    assert found.variance == pytest.approx(1.0, rel=0.02)
    assert fit_ar_noise(left, most=1).coefficients[0] < 0.88
