"""Closed-form step responses against python-control, their own equations, and the T1 = T2 limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pamsim.linear.first_second_order import first_order_step, second_order_step
from tests.unit.linear.planted import refuses

CONSTANTS = st.floats(1e-3, 1e2)
TIME = np.linspace(0.0, 5.0, 501)


@settings(max_examples=60, deadline=None)
@given(t1=CONSTANTS, t2=CONSTANTS)
def test_second_order_is_symmetric_monotone_and_below_the_slow_lag(t1: float, t2: float) -> None:
    y = second_order_step(TIME, t1, t2)
    np.testing.assert_array_equal(y, second_order_step(TIME, t2, t1))
    assert np.all(np.diff(y) >= -1e-15)
    assert np.all(y <= first_order_step(TIME, max(t1, t2)) + 1e-15)
    assert np.all(second_order_step(-TIME, t1, t2) == 0.0)


@pytest.mark.parametrize("relative", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15])
def test_merging_time_constants_are_continuous(relative: float) -> None:
    t = 0.3
    limit = 1.0 - np.exp(-TIME / t) * (1.0 + TIME / t)  # textbook double lag
    np.testing.assert_allclose(second_order_step(TIME, t, t), limit, atol=1e-15)
    near = second_order_step(TIME, t * (1.0 - relative), t * (1.0 + relative))
    # Symmetric spreading moves the response only at second order: no 1/(T1 - T2) noise is left.
    np.testing.assert_allclose(near, limit, atol=relative**2 + 2e-15)


def test_separated_time_constants_match_the_textbook_form() -> None:
    t1, t2 = 0.090314, 0.57873
    textbook = 1.0 - (t1 * np.exp(-TIME / t1) - t2 * np.exp(-TIME / t2)) / (t1 - t2)
    np.testing.assert_allclose(second_order_step(TIME, t1, t2, 2.5), 2.5 * textbook, atol=1e-14)


def test_vanishing_lag_leaves_first_order_and_gain_scales() -> None:
    np.testing.assert_allclose(
        second_order_step(TIME[1:], 1e-9, 0.6), first_order_step(TIME[1:], 0.6), atol=1e-8
    )
    assert first_order_step(0.6, 0.6, -3.0) == pytest.approx(-3.0 * (1.0 - np.exp(-1.0)))


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_time_constants_must_be_positive(bad: float) -> None:
    refuses("time constant T", first_order_step, TIME, bad)
    refuses("T2", second_order_step, TIME, 0.1, bad)
