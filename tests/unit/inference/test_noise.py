"""Noise: AR models of residuals, of trials and of channels, and the criteria that count with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.special import gamma

from pamsim.comparison.noise_floor import FloorRoute, noise_floor
from pamsim.core.errors import InputError
from pamsim.inference.coloured_noise import LONGEST_MEMORY, ArNoise, fit_ar_noise
from pamsim.inference.criteria import aicc_above_best, hannan_quinn
from pamsim.inference.noise_model import NoiseModel, pooled_deviation, repeat_scatter
from pamsim.inference.record_checks import uniform_interval
from pamsim.inference.simulator_fit import ResidualBlock, layout
from pamsim.inference.trial_noise import fit_trial_noise, same_rates
from tests.unit.identification.planted import coloured, fractional

REFLECTIONS = st.lists(st.floats(-0.95, 0.95), min_size=0, max_size=5)

TIMES = (0.005, 0.1, 0.005)
LAG = 0.05


@settings(max_examples=15, deadline=None)
@given(reflections=REFLECTIONS, variance=st.floats(0.1, 10.0))
def test_a_model_is_stationary_and_whitens_its_own_covariance(reflections, variance):
    noise = ArNoise(tuple(reflections), variance)
    for size in (30, 2):  # also of fewer samples than orders
        covariance = toeplitz(noise.autocovariance(size))
        whitener = noise.whiten(np.eye(size))
        white = whitener @ covariance @ whitener.T
        np.testing.assert_allclose(white, variance * np.eye(size), atol=1e-8 * covariance[0, 0])
    poles = np.roots([1.0, *(-c for c in noise.coefficients)])
    assert np.all(np.abs(poles) < 1.0)


def test_planted_ar2_is_found_from_several_trials() -> None:
    rng = np.random.default_rng(31)
    trials = [lfilter([0.5], [1.0, -1.5, 0.7], rng.standard_normal(3000)) for _ in range(3)]
    noise = fit_ar_noise(trials)
    assert noise.coefficients[:2] == pytest.approx((1.5, -0.7), abs=0.05)
    assert noise.variance == pytest.approx(0.25, rel=0.05)
    assert noise.standard_deviation == pytest.approx(np.std(np.concatenate(trials)), rel=0.05)


def test_white_noise_is_mostly_left_white_and_no_residual_has_no_variance():
    rng = np.random.default_rng(32)
    orders = [fit_ar_noise([rng.standard_normal(400)]).order for _ in range(60)]
    # AICc keeps a spurious coefficient in about one of four.
    assert np.mean(np.array(orders) == 0) > 0.5
    noise = fit_ar_noise([np.zeros(50)])
    assert (noise.order, noise.variance) == (0, 0.0)


@pytest.mark.parametrize("d", [0.3, 0.45])
def test_noise_with_a_long_memory_is_found_and_has_the_covariance_of_fractional_noise(d):
    rng = np.random.default_rng(35)
    noise = fit_ar_noise([fractional(rng, 2000, d) for _ in range(2)], long_memory=True)
    assert noise.memory == pytest.approx(d, abs=0.06)
    # Two coefficients instead of a dozen: its variance is that of the white noise it was made of.
    assert noise.variance == pytest.approx(1.0, rel=0.05)
    own = np.arange(1, LONGEST_MEMORY + 1)
    exact = ArNoise(tuple(-d / (own - d)), 1.0).autocovariance(LONGEST_MEMORY)
    # Hosking (1981): gamma(k) / gamma(k - 1) = (k - 1 + d) / (k - d).
    lags = np.arange(1, LONGEST_MEMORY)
    np.testing.assert_allclose(exact[1:] / exact[:-1], (lags - 1.0 + d) / (lags - d))
    assert exact[0] == pytest.approx(gamma(1.0 - 2.0 * d) / gamma(1.0 - d) ** 2, rel=0.02)


def test_noise_that_fades_has_no_memory():
    rng = np.random.default_rng(36)
    trials = [[coloured(rng, 2000, phi)] for phi in (0.0, 0.9) for _ in range(20)]
    found = [fit_ar_noise(trial, long_memory=True) for trial in trials]
    assert sum(noise.memory == 0.0 for noise in found) >= 34
    assert all(noise.memory < 0.1 for noise in found)
    assert fit_ar_noise([fractional(rng, 2000, 0.45)]).memory == 0.0  # where it is not asked for
    assert fit_ar_noise([np.zeros(50)], long_memory=True) == ArNoise((), 0.0)


def test_correlation_time_is_that_of_exponential_noise():
    rng = np.random.default_rng(33)
    for time in (0.1, 0.3):
        noise = fit_ar_noise([coloured(rng, 20_000, np.exp(-0.01 / time)) for _ in range(2)])
        assert noise.correlation_time(0.01) == pytest.approx(time, rel=0.2), time
    for variance in (2.0, 0.0):  # none is that of a perfect fit
        assert ArNoise((), variance).correlation_time(0.01) == 0.005


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


def drifting(seed):
    """Exponentially correlated noise of one time constant at every rate."""
    rng = np.random.default_rng(seed)
    return [coloured(rng, 2000, np.exp(-time / LAG)) for time in TIMES]


def test_trials_of_one_sample_time_share_a_model_that_whitens_them_to_one_variance():
    assert same_rates((0.01, 0.1, 0.010001)) == [[0, 2], [1]]
    trials = drifting(1)
    noise = fit_trial_noise(trials, TIMES)
    fast, slow, again = noise.models
    assert fast is again
    assert fast == fit_ar_noise([trials[0], trials[2]])
    assert fast.correlation_time(0.005) == pytest.approx(LAG, rel=0.3)
    assert slow == fit_ar_noise([trials[1]])
    for i, own in enumerate(trials):
        white = noise.whiten(own, i)
        assert np.mean(white**2) == pytest.approx(noise.variance, rel=0.1)
        assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.06
    assert noise.scaled(4.0).models[1].variance == pytest.approx(4.0 * noise.models[1].variance)
    alone = min(2000 * 0.1 / (2.0 * slow.correlation_time(0.1)), 2000)
    assert noise.independent([0, 2000, 0]) == pytest.approx(alone)
    assert noise.independent([2000, 0, 0]) == pytest.approx(2000 * 0.005 / (2.0 * LAG), rel=0.3)


def stack(*trials):
    """Layout and residual of (protocol, residual) each, channel angle."""
    blocks = [
        ResidualBlock(trial=f"t{i}", protocol=protocol, channel="angle", residual=residual)
        for i, (protocol, residual) in enumerate(trials)
    ]
    return layout(blocks), np.concatenate([b.residual for b in blocks])


def test_repeats_scatter_about_their_mean_cut_to_the_shortest():
    rng = np.random.default_rng(0)
    long, short = rng.standard_normal(50), rng.standard_normal(30)
    places, residual = stack(("a", long + 7.0), ("a", short + 7.0), ("b", long))
    ((key, part),) = repeat_scatter(places, residual).items()
    assert (key, part.freedom) == (("angle", "a"), 30)
    assert part.square == pytest.approx(0.5 * np.sum((long[:30] - short) ** 2))
    assert part.variance == pytest.approx(np.mean(np.var([long[:30], short], axis=0, ddof=1)))


def test_repeats_at_another_rate_are_compared_among_themselves():
    residuals = {f"{rate:g} Hz": np.sin(np.arange(50) / rate) for rate in (100.0, 200.0)}
    blocks = [
        ResidualBlock(
            trial=f"{rate} {k}",
            protocol="sine",
            channel="angle",
            residual=residual + k,
            sample_interval=1.0 / float(rate.partition(" ")[0]),
        )
        for rate, residual in residuals.items()
        for k in (0.0, 0.2)
    ]
    residual = np.concatenate([block.residual for block in blocks])
    (part,) = repeat_scatter(layout(blocks), residual).values()
    assert (part.freedom, part.variance) == (100, pytest.approx(0.02))


def test_calibrate_and_diagnose_take_the_same_noise_from_the_same_repeats():
    rng = np.random.default_rng(1)
    wave = 3.0 * np.sin(np.arange(400) / 9.0)  # what the simulator misses
    trials = [("a", wave + 0.1 * rng.standard_normal(400)) for _ in range(3)]
    trials += [("b", wave[:60] + 0.4 * rng.standard_normal(60)) for _ in range(2)]
    places, residual = stack(*trials)
    fitted = NoiseModel(places, residual).estimate(residual)["angle"]
    floor = noise_floor(places, residual)
    assert floor.sd["angle"] == pytest.approx(fitted, rel=1e-12)
    parts = list(repeat_scatter(places, residual).values())
    assert fitted == pytest.approx(pooled_deviation(parts), rel=1e-12)
    # 800 degrees of freedom of the one protocol against 60 of the other.
    assert fitted == pytest.approx(np.sqrt((800 * 0.01 + 60 * 0.16) / 860), rel=0.1)
    assert floor.variance["angle", "b"] == pytest.approx(0.16, rel=0.5)
    # A single trial counts its model error in a fit, and not in the floor.
    places, residual = stack(("a", wave + 0.1 * rng.standard_normal(400)))
    assert NoiseModel(places, residual).estimate(residual)["angle"] > 1.5
    floor = noise_floor(places, residual)
    assert floor.sd["angle"] < 0.3
    assert set(floor.routes.values()) == {FloorRoute.WITHIN_TRIALS}


def test_the_interval_that_differs_most_is_named_and_jitter_is_uniform():
    for odd in (0.004, 0.02):
        steps = np.full(50, 0.01)
        steps[17] = odd
        time = np.concatenate([[0.0], np.cumsum(steps)])
        with pytest.raises(InputError, match=rf"interval {odd:g} s after time\[17\]"):
            uniform_interval(time)
    time = 0.01 * np.arange(50) + 4e-5 * (np.arange(50) % 2)
    assert uniform_interval(time) == pytest.approx(0.01, rel=1e-3)


def slow_noise(seed, n=1000, phi=0.9):
    draw = np.random.default_rng(seed)
    return lfilter([1.0], [1.0, -phi], draw.normal(size=n + 200))[200:]


def test_criteria_are_those_of_the_textbooks():
    residual = np.random.default_rng(2).normal(size=500)
    found = hannan_quinn([residual], [0.01], 3)
    expected = 500 * np.log(np.mean(residual**2)) + 2.0 * np.log(np.log(500)) * 3
    assert found == pytest.approx(expected, rel=1e-12)
    found = aicc_above_best([2.0, 1.0, 0.99], [2.0, 3.0, 4.0], 50.0)
    stated = [
        50.0 * math.log(square) + 2.0 * k + 2.0 * k * (k + 1.0) / (50.0 - k - 1.0)
        for square, k in ((2.0, 2.0), (1.0, 3.0), (0.99, 4.0))
    ]
    assert found == pytest.approx([score - min(stated) for score in stated])
    assert found[1] == 0.0


def test_what_takes_up_slow_noise_is_not_preferred_but_a_real_effect_is():
    along = np.linspace(-1.0, 1.0, 1000)
    bends = np.vander(along, 8, increasing=True)
    preferred = detected = 0
    for seed in range(20):
        noise = slow_noise(seed)
        left = noise - bends @ np.linalg.lstsq(bends, noise, rcond=None)[0]
        preferred += hannan_quinn([left], [0.01], 8) < hannan_quinn([noise], [0.01], 1)
        effect = noise + 2.0 * np.sign(np.sin(40.0 * along))
        detected += hannan_quinn([noise], [0.01], 2) < hannan_quinn([effect], [0.01], 1)
    assert preferred <= 2
    assert detected == 20


def test_trials_are_pooled_and_rounding_is_equal():
    noise = slow_noise(3)
    apart = hannan_quinn([noise[:500], noise[500:]], [0.01, 0.01], 2)
    assert apart == pytest.approx(hannan_quinn([noise], [0.01], 2), abs=20.0)
    residual = 1e-12 * np.random.default_rng(2).normal(size=100)
    assert hannan_quinn([residual], [0.01], 2, rounding=1.0) > hannan_quinn(
        [0.1 * residual], [0.01], 1, 1.0
    )
    assert np.isfinite(hannan_quinn([np.zeros(100)], [0.01], 2))


def test_few_samples_prefer_few_unknowns_unless_they_miss_nearly_all():
    """The step of an arm is worth three samples: an integrator was best, with 40 % fit."""
    for samples in (0.5, 3.0, 30.0):
        first, second, third = aicc_above_best([1.0, 1.0, 1.0], [2.0, 3.0, 9.0], samples)
        assert first == 0.0 < second < third
    for samples in (3.0, 5.0, 9.0):
        scores = aicc_above_best([0.36, 2e-4, 1.9e-4], [2.0, 4.0, 12.0], samples)
        assert scores[1] == 0.0, samples
        assert aicc_above_best([1.0, 0.0], [1.0, 2.0], samples)[1] == 0.0  # no error at all


def test_noise_that_hardly_fades_has_a_finite_correlation_time():
    """Its coefficients sum to 1 to rounding, as if it never faded: its reflections do not."""
    slow = ArNoise((-0.9999,) * 6, 1.0)
    assert 1.0 - sum(slow.coefficients) == pytest.approx(0.0, abs=1e-15)
    assert slow.correlation_time(2.0) == pytest.approx((1.9999 / 1e-4) ** 6, rel=1e-9)
    for reflections in ((-0.5,), (-0.5, 0.3), (0.2, -0.4, 0.1)):
        own = ArNoise(reflections, 3.0)
        covariance = own.autocovariance(2000)
        total = covariance[0] + 2.0 * covariance[1:].sum()  # spectral density at frequency 0
        assert own.correlation_time(1.0) == pytest.approx(0.5 * total / covariance[0], rel=1e-9)
