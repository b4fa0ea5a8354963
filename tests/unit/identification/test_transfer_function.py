"""python-control of fitted models, Bode and step data with bands, and plants drawn from a fit."""

from dataclasses import replace

import control
import numpy as np
import pytest

from pamsim.identification.curves import frequency_response, step_response_band
from pamsim.identification.transfer_function import (
    continuous,
    discrete,
    sampled_plants,
    state_space,
    with_held_input,
)
from tests.unit.identification.planted import (
    arx,
    first_order_step,
    fit_continuous,
    fit_oe,
    record,
    refuses,
)

TIME = np.linspace(0.0, 5.0, 501)
W = np.geomspace(0.1, 50.0, 20)
SAMPLES = 0.02 * np.arange(100)


@pytest.fixture(scope="module")
def two():
    """Two lags, by a continuous fit and by output error."""
    given = [record(60, constants=(0.1, 0.5), noise=0.05)]
    return fit_continuous(given, order=2), fit_oe(given, nb=2, nf=2, nk=1)


def test_bode_and_step_data_are_those_of_python_control(two):
    for fit, system, at in zip(
        two, (continuous(two[0]), discrete(two[1])), (1j * W, np.exp(1j * W * 0.02)), strict=True
    ):
        bode, step = frequency_response(fit, W), step_response_band(fit, SAMPLES)
        value = system(at)
        np.testing.assert_allclose(bode.magnitude, np.abs(value), rtol=1e-9)
        np.testing.assert_allclose(bode.phase, np.unwrap(np.angle(value)), atol=1e-9)
        for form in (system, state_space(fit)):
            by_control = control.step_response(form, T=SAMPLES, squeeze=True).outputs
            np.testing.assert_allclose(step.output, by_control, atol=1e-8)
        assert step.band[1, 0] - step.band[0, 0] == pytest.approx(0.0, abs=1e-12)  # at the start
    fit, system = two[0], continuous(two[0])
    assert sorted(p.real for p in fit.poles) == pytest.approx(sorted(system.poles().real))
    assert system.dcgain() == pytest.approx(fit.gain)


def test_a_discrete_step_is_that_of_control_whatever_the_delay(two):
    for delay in (0, 1, 3):
        structure, coefficients = arx((-1.2, 0.5), (0.3, -0.1), 0.01, delay)
        model = replace(two[1], structure=structure, coordinates=coefficients)
        transfer = discrete(model)
        assert transfer.dt == 0.01
        by_control = control.step_response(transfer, T=0.01 * np.arange(200)).outputs
        found = structure.step_response(coefficients, 200, 0.01)
        np.testing.assert_allclose(found, np.ravel(by_control), atol=1e-9)
    refuses("is discrete; use discrete", continuous, two[1])
    refuses("is continuous; use continuous", discrete, two[0])


def test_dead_time_turns_the_phase_and_needs_pade_in_a_transfer_function():
    given = record(61, delay=0.06)
    fit = fit_continuous([given], order=1, dead_time=True)
    bode = frequency_response(fit, W)
    np.testing.assert_allclose(bode.phase, -np.arctan(0.3 * W) - 0.06 * W, atol=1e-4)
    refuses("pade_order", continuous, fit)
    near = continuous(fit, pade_order=4)(1j * W[:15])
    np.testing.assert_allclose(np.abs(near), bode.magnitude[:15], rtol=1e-6)
    turned = np.unwrap(np.angle(near))
    np.testing.assert_allclose(turned, bode.phase[:15], atol=1e-3)
    # A held input sees the dead time itself.
    times = np.arange(given.time.size) * given.sample_time
    for delay in (0.0, 0.004, 0.06, 0.07, 0.1234):
        late = replace(fit, coordinates=np.array([fit.coordinates[0], delay, 2.0]))
        plant = with_held_input(late, given.sample_time)
        output = control.forced_response(plant, times, given.input).outputs
        expected = 2.0 * fit.structure.responses(late.coordinates, given)[:, 0]
        np.testing.assert_allclose(output, expected, atol=1e-9)
    refuses("period = 0 s must be above 0", with_held_input, fit, 0.0)


def test_bands_cover_the_planted_response():
    runs, hits, w = 25, np.zeros(3), np.array([0.5, 10.0])
    exact, planted = 2.0 / (1.0 + 0.3j * w), float(first_order_step(0.4, 0.3, 2.0))
    for seed in range(runs):
        fit = fit_continuous([record(3000 + seed, noise=0.2, n=300)], order=1)
        bode = frequency_response(fit, w)
        magnitude = (bode.magnitude_band[0] < abs(exact)) & (abs(exact) < bode.magnitude_band[1])
        phase = (bode.phase_band[0] < np.angle(exact)) & (np.angle(exact) < bode.phase_band[1])
        step = step_response_band(fit, np.array([0.0, 0.4]))
        hits += [magnitude.all(), phase[1], step.band[0, 1] < planted < step.band[1, 1]]
    # Binomial(25, 0.95): at least 19; both magnitudes together reach at least 0.90.
    assert np.all(hits >= [17, 19, 19])
    fit = fit_continuous([record(64, n=30, hold=4, noise=0.05, interval=0.1)], order=1)
    step = step_response_band(fit, np.linspace(0.0, 50.0, 3))
    assert tuple(step.band[:, -1]) == pytest.approx(fit["K"].interval95)


def test_a_fit_without_covariance_has_no_bands():
    fit = fit_continuous([record(63)], order=3, zeros=1)
    assert fit.covariance is None
    assert frequency_response(fit, W).phase_band is None
    assert step_response_band(fit, SAMPLES).band is None


def test_drawn_plants_have_the_covariance_of_the_fit(two):
    fit = two[0]
    plants = sampled_plants(fit, 600, np.random.default_rng(1))
    poles = np.sort([-plant.poles().real for plant in plants], axis=1)[:, ::-1]
    gains = [float(plant.dcgain()) for plant in plants]
    found = np.cov(np.column_stack([-np.log(poles), gains]).T)
    order = [*np.argsort(fit.coordinates[:2]), 2]
    expected = fit.covariance[np.ix_(order, order)]
    error = np.sqrt(np.diag(expected))
    each = np.outer(error, error)
    # Of 600 draws: 1/sqrt(600) = 4 % of an error, four times.
    np.testing.assert_allclose(found / each, expected / each, atol=0.16)
    mean = np.mean(np.log(poles), axis=0)
    np.testing.assert_allclose(mean, -fit.coordinates[order[:2]], atol=0.16 * error[:2].max())


def test_drawn_plants_differ_by_as_much_as_the_prediction_errs():
    """Closed loops of the planted lag, against those predicted from noisy records of it."""
    times, errors = 0.02 * np.arange(1, 30), []

    def closed(gain, lag):
        around = 1.0 + 3.0 * gain  # a controller of gain 3
        return first_order_step(times, lag / around, 3.0 * gain / around)

    for seed in range(15):
        fit = fit_continuous([record(seed, noise=0.3, n=200)], order=1)
        plants = sampled_plants(fit, 25, np.random.default_rng(seed))
        steps = [closed(float(p.dcgain()), -1.0 / float(p.poles()[0].real)) for p in plants]
        errors.append((closed(2.0, 0.3) - np.mean(steps, axis=0)) / np.std(steps, axis=0))
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.4


def test_drawn_plants_are_as_stable_as_the_fit_and_never_early():
    fit = fit_oe([record(4, constants=(0.3, 1.0), noise=0.02)], nb=2, nf=2, nk=1)
    wide = replace(fit, covariance=1e4 * fit.covariance)
    plants = sampled_plants(wide, 20, np.random.default_rng(2))
    assert all(np.all(np.abs(plant.poles()) <= 1.0) for plant in plants)
    for covariance, words in (
        (1e10 * fit.covariance, "draws are as stable"),
        (None, "no covariance"),
    ):
        other = replace(fit, covariance=covariance)
        refuses(words, sampled_plants, other, 20, np.random.default_rng(2))
    late = fit_continuous([record(5, delay=0.02, noise=0.3)], order=1, dead_time=True)
    wide = replace(late, covariance=np.diag([0.0, 0.1, 0.0]) ** 2)
    plants = sampled_plants(wide, 30, np.random.default_rng(3), period=0.02)
    states = [plant.nstates for plant in plants]
    assert min(states) == 1  # without a dead time
    assert max(states) > 3
