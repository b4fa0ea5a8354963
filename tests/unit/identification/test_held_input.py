"""Exact sampling: parity with closed forms and with scipy, any fraction of a sample delay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim

from pamsim.identification.held_input import chain_derivatives, chain_modes
from pamsim.identification.step_response import step_of_lags
from tests.unit.identification.planted import (
    lags,
    refuses,
    sampled,
    second_order_step,
    steps,
)

U = steps(np.random.default_rng(41), 300, 12)
TIME = np.linspace(0.0, 5.0, 501)


def test_a_step_of_lags_is_the_textbook_form_and_continuous_where_lags_merge():
    t1, t2 = 0.090314, 0.57873
    textbook = 1.0 - (t1 * np.exp(-TIME / t1) - t2 * np.exp(-TIME / t2)) / (t1 - t2)
    for pair in ((t1, t2), (t2, t1)):
        found = step_of_lags(TIME, *pair, gain=2.5)
        np.testing.assert_allclose(found, 2.5 * textbook, atol=1e-12)
    double = 1.0 - np.exp(-TIME / 0.3) * (1.0 + TIME / 0.3)
    for relative in (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3):
        near = step_of_lags(TIME, 0.3 * (1.0 - relative), 0.3 * (1.0 + relative))
        # Spreading moves the response at second order only: no 1/(T1 - T2) noise is left.
        np.testing.assert_allclose(near, double, atol=relative**2 + 1e-12)
    single = step_of_lags(TIME, 0.6, gain=-3.0)
    np.testing.assert_allclose(single, 3.0 * np.expm1(-TIME / 0.6), atol=1e-12)
    for bad in (0.0, -1.0, float("nan"), float("inf")):
        refuses("finite ones above 0", step_of_lags, TIME, 0.1, bad)


@settings(max_examples=15, deadline=None)
@given(ratio=st.sampled_from([0.01, 0.16, 1.0 - 1e-9, 1.0]), delay=st.floats(0.0, 0.2))
def test_step_with_any_delay_is_the_closed_form(ratio, delay):
    step, time = np.append(0.0, np.ones(200)), 0.01 * np.arange(-1, 200)
    y = chain_derivatives(np.array([0.5 * ratio, 0.5]), step, 0.01, count=1, dead_time=delay)
    expected = second_order_step(time - delay, 0.5 * ratio, 0.5)
    np.testing.assert_allclose(y[:, 0], expected, atol=1e-12)


def test_any_held_input_agrees_with_scipy():
    for constants, delay in (
        ((0.3,), 0.0),
        ((0.2, 0.2, 0.2), 0.0),
        ((0.004, 0.05, 0.4, 2.0), 0.0),
        ((0.05, 0.4), 0.037),  # a fraction of a sample
    ):
        found = chain_derivatives(np.array(constants), U, 0.02, count=1, dead_time=delay)
        expected = sampled([1.0], lags(*constants), U, 0.02, delay)
        np.testing.assert_allclose(found[:, 0], expected, atol=1e-9)
    # Derivatives make zeros and pairs make oscillations.
    wn, zeta = 6.0, 0.3
    root = -zeta * wn + 1j * wn * np.sqrt(1.0 - zeta**2)
    found = chain_derivatives(-1.0 / np.array([root, np.conj(root)]), U, 0.02, count=2)
    below = [1.0 / wn**2, 2.0 * zeta / wn, 1.0]
    for k, above in enumerate(([1.0], [1.0, 0.0])):
        np.testing.assert_allclose(found[:, k], sampled(above, below, U, 0.02), atol=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.033])
def test_first_order_hold_agrees_with_scipy_lsim(delay):
    smooth = np.sin(0.4 * np.arange(300)) * np.linspace(0.0, 1.0, 300)
    found = chain_derivatives(
        np.array([0.05, 0.4]), smooth, 0.02, count=1, dead_time=delay, hold="foh"
    )
    fine = 0.001 * np.arange(300 * 20 - 19)
    late = np.interp(fine - delay, 0.02 * np.arange(300), smooth)
    _, y, _ = lsim(([1.0], lags(0.05, 0.4)), late, fine)
    np.testing.assert_allclose(found[:, 0], y[::20], atol=1e-10)


@settings(max_examples=12, deadline=None)
@given(
    integrators=st.integers(0, 2),
    constants=st.lists(st.floats(0.02, 2.0), max_size=3),
    zeros=st.integers(0, 5),
)
def test_any_chain_of_lags_and_integrators_agrees_with_scipy(integrators, constants, zeros):
    zeros = min(zeros, len(constants) + integrators)
    smooth = np.sin(0.3 * np.arange(80)) * np.linspace(0.0, 1.0, 80)
    columns = chain_derivatives(
        np.array(constants), smooth, 0.05, count=zeros + 1, hold="foh", integrators=integrators
    )
    below = np.append(lags(*constants), np.zeros(integrators))
    for k in range(zeros + 1):
        if below.size == 1:
            expected = smooth / below[0]
        else:
            _, expected, _ = lsim(([1.0] + [0.0] * k, below), smooth, 0.05 * np.arange(80))
        np.testing.assert_allclose(columns[:, k], expected, atol=1e-7 * max(np.ptp(expected), 1.0))


def test_modes_of_a_long_record_have_their_values_and_end():
    constants, time = np.array([0.1, 0.4]), 0.02 * np.arange(5000)
    modes = chain_modes(constants, time.size, 0.02)
    rates = np.exp(-time[:, np.newaxis] / constants)
    early = slice(0, 900)  # 45 times the longer one
    left = modes[early] - rates[early] @ np.linalg.lstsq(rates[early], modes[early], rcond=None)[0]
    assert np.max(np.abs(left)) < 1e-12
    slow = np.abs(modes[700:1300, 0])
    np.testing.assert_allclose(slow[1:] / slow[:-1], np.exp(-0.02 / 0.4), rtol=1e-6)
    assert not np.any(modes[1500:])


def test_an_input_that_is_to_act_before_the_record_is_its_last_value():
    given = np.linspace(0.0, 1.0, 50)
    run = chain_derivatives(np.empty(0), given, 0.01, count=1, dead_time=-2.0)
    np.testing.assert_array_equal(run, np.ones((50, 1)))
