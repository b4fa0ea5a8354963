"""Bode and step data: parity with python-control, bands that cover, dead time exact."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.discrete_fit import fit_oe
from pamsim.linear.first_second_order import first_order_step
from pamsim.linear.response_bands import frequency_response, step_response_band
from pamsim.linear.transfer_function import continuous, discrete, step_response
from tests.unit.linear.planted import record, refuses

W = np.geomspace(0.1, 50.0, 20)
TIME = 0.02 * np.arange(100)
GIVEN = [record(60, constants=(0.1, 0.5), noise=0.05)]


def test_continuous_data_are_those_of_python_control() -> None:
    fit = fit_continuous(GIVEN, order=2)
    system = continuous(fit)
    value = system(1j * W)
    bode = frequency_response(fit, W)
    np.testing.assert_allclose(bode.magnitude, np.abs(value), rtol=1e-10)
    np.testing.assert_allclose(bode.phase, np.unwrap(np.angle(value)), atol=1e-10)
    step = step_response_band(fit, TIME)
    np.testing.assert_allclose(step.output, step_response(system, TIME), atol=1e-8)
    assert sorted(p.real for p in fit.poles) == pytest.approx(sorted(system.poles().real))
    assert system.dcgain() == pytest.approx(fit.gain)


def test_discrete_data_are_those_of_python_control() -> None:
    fit = fit_oe(GIVEN, nb=2, nf=2, nk=1)
    system = discrete(fit)
    bode = frequency_response(fit, W)
    np.testing.assert_allclose(bode.magnitude, np.abs(system(np.exp(1j * W * 0.02))), rtol=1e-9)
    step = step_response_band(fit, TIME)
    np.testing.assert_allclose(step.output, step_response(system, TIME), atol=1e-8)


def test_dead_time_turns_the_phase_and_needs_pade_in_a_transfer_function() -> None:
    fit = fit_continuous([record(61, delay=0.06)], order=1, dead_time=True)
    bode = frequency_response(fit, W)
    np.testing.assert_allclose(bode.phase, -np.arctan(0.3 * W) - 0.06 * W, atol=1e-4)
    refuses("pade_order", continuous, fit)
    near = continuous(fit, pade_order=4)(1j * W[:15])
    np.testing.assert_allclose(np.abs(near), bode.magnitude[:15], rtol=1e-6)


def test_bands_cover_the_truth() -> None:
    runs, hits, w = 25, np.zeros(3), np.array([0.5, 10.0])
    exact = 2.0 / (1.0 + 0.3j * w)
    for seed in range(runs):
        fit = fit_continuous([record(3000 + seed, noise=0.2, n=300)], order=1)
        bode = frequency_response(fit, w)
        magnitude = (bode.magnitude_band[0] < abs(exact)) & (abs(exact) < bode.magnitude_band[1])
        phase = (bode.phase_band[0] < np.angle(exact)) & (np.angle(exact) < bode.phase_band[1])
        step = step_response_band(fit, np.array([0.0, 0.4]))
        truth = float(first_order_step(0.4, 0.3, 2.0))
        hits += [magnitude.all(), phase[1], step.band[0, 1] < truth < step.band[1, 1]]
    # Binomial(25, 0.95): at least 19; both magnitudes together reach at least 0.90.
    assert np.all(hits >= [17, 19, 19])


def test_the_band_of_a_short_record_ends_in_the_interval_of_the_gain() -> None:
    fit = fit_continuous([record(64, n=30, hold=4, noise=0.05, interval=0.1)], order=1)
    step = step_response_band(fit, np.linspace(0.0, 50.0, 3))
    assert step.band is not None
    assert tuple(step.band[:, -1]) == pytest.approx(fit["K"].interval95)


def test_step_band_is_closed_at_the_start() -> None:
    step = step_response_band(fit_continuous(GIVEN, order=2), TIME)
    assert step.band is not None
    assert step.band[1, 0] - step.band[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_a_fit_without_covariance_has_no_bands() -> None:
    fit = fit_continuous([record(63)], order=3, zeros=1)
    assert fit.covariance is None
    assert frequency_response(fit, W).phase_band is None
    assert step_response_band(fit, TIME).band is None


def test_bad_axes_are_refused() -> None:
    fit = fit_oe(GIVEN, nb=2, nf=2, nk=1)
    refuses("half the sampling rate", frequency_response, fit, [1.0, 200.0])
    refuses("rise", frequency_response, fit, [1.0, 1.0])
    refuses("own sample times", step_response_band, fit, [0.0, 0.1])
    refuses("start at 0", step_response_band, fit, [0.1, 0.2])
