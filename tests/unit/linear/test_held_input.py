"""Exact sampling: parity with closed forms and with scipy, any fraction of a sample delay."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim

from pamsim.linear.first_second_order import second_order_step
from pamsim.linear.held_input import chain_derivatives, chain_modes
from tests.unit.linear.planted import lags, sampled, steps

U = steps(np.random.default_rng(41), 300, 12)


@settings(max_examples=25, deadline=None)
@given(
    ratio=st.sampled_from([0.01, 0.16, 1.0 - 1e-9, 1.0]),
    delay=st.floats(0.0, 0.2),
)
def test_step_with_any_delay_is_the_closed_form(ratio: float, delay: float) -> None:
    step = np.append(0.0, np.ones(200))
    time = 0.01 * np.arange(-1, 200)
    y = chain_derivatives(np.array([0.5 * ratio, 0.5]), step, 0.01, count=1, dead_time=delay)
    np.testing.assert_allclose(
        y[:, 0], second_order_step(time - delay, 0.5 * ratio, 0.5), atol=1e-12
    )


@pytest.mark.parametrize("constants", [(0.3,), (0.05, 0.4), (0.2, 0.2, 0.2), (0.004, 0.05, 0.4, 2)])
def test_any_input_agrees_with_scipy_zero_order_hold(constants: tuple[float, ...]) -> None:
    response = chain_derivatives(np.array(constants, dtype=float), U, 0.02, count=1)
    np.testing.assert_allclose(response[:, 0], sampled([1.0], lags(*constants), U, 0.02), atol=1e-9)


def test_fraction_of_a_sample_delay_agrees_with_fine_sampling() -> None:
    response = chain_derivatives(np.array([0.05, 0.4]), U, 0.02, count=1, dead_time=0.037)
    fine = sampled([1.0], lags(0.05, 0.4), U, 0.02, delay=0.037)
    np.testing.assert_allclose(response[:, 0], fine, atol=1e-10)


def test_derivatives_make_zeros_and_pairs_make_oscillations() -> None:
    wn, zeta = 6.0, 0.3
    root = -zeta * wn + 1j * wn * np.sqrt(1.0 - zeta**2)
    response = chain_derivatives(-1.0 / np.array([root, np.conj(root)]), U, 0.02, count=2)
    below = [1.0 / wn**2, 2.0 * zeta / wn, 1.0]
    np.testing.assert_allclose(response[:, 0], sampled([1.0], below, U, 0.02), atol=1e-10)
    np.testing.assert_allclose(response[:, 1], sampled([1.0, 0.0], below, U, 0.02), atol=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.033])
def test_first_order_hold_agrees_with_scipy_lsim(delay: float) -> None:
    smooth = np.sin(0.4 * np.arange(300)) * np.linspace(0.0, 1.0, 300)
    response = chain_derivatives(
        np.array([0.05, 0.4]), smooth, 0.02, count=1, dead_time=delay, hold="foh"
    )
    fine = 0.001 * np.arange(300 * 20 - 19)
    late = np.interp(fine - delay, 0.02 * np.arange(300), smooth)
    _, y, _ = lsim(([1.0], lags(0.05, 0.4)), late, fine)
    np.testing.assert_allclose(response[:, 0], y[::20], atol=1e-10)


def test_modes_span_every_free_response() -> None:
    time = 0.02 * np.arange(100)
    modes = chain_modes(np.array([0.1, 0.4]), 100, 0.02)
    for free in (np.exp(-time / 0.1), np.exp(-time / 0.4)):
        left = free - modes @ np.linalg.lstsq(modes, free, rcond=None)[0]
        assert np.max(np.abs(left)) < 1e-12
