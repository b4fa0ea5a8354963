"""python-control transfer functions of fitted models agree with what was fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.linear.arx import ArxModel, simulate_arx
from pamsim.linear.first_second_order import first_order_step, second_order_step
from pamsim.linear.step_fit import fit_step
from pamsim.linear.transfer_function import continuous, discrete, step_response

TIME = np.linspace(0.0, 5.0, 501)


@pytest.mark.parametrize(("t1", "t2"), [(0.090314, 0.57873), (0.5, 0.5), (0.01, 2.0)])
def test_second_order_closed_form_is_the_step_of_control(t1: float, t2: float) -> None:
    fit = replace(
        fit_step(TIME, second_order_step(TIME, 0.1, 0.6), order=2),
        coordinates=np.array([np.log(t1), np.log(t2), 3.0]),
    )
    expected = second_order_step(TIME, t1, t2, 3.0)
    np.testing.assert_allclose(step_response(continuous(fit), TIME), expected, atol=1e-9)


def test_first_order_closed_form_is_the_step_of_control() -> None:
    fit = fit_step(TIME, first_order_step(TIME, 0.64595, 2.0), order=1, gain=None)
    response = step_response(continuous(fit), TIME)
    np.testing.assert_allclose(response, first_order_step(TIME, 0.64595, 2.0), atol=1e-9)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_discrete_step_is_the_simulated_arx(delay: int) -> None:
    interval = 1.0 / 300.0  # its times, written with six decimals, are not its multiples
    model = ArxModel((-1.2, 0.5), (0.3, -0.1), delay, interval, 0.0, 0)
    transfer = discrete(model)
    assert transfer.dt == interval
    np.testing.assert_allclose(
        step_response(transfer, np.round(np.arange(501) * interval, 6)),
        simulate_arx(model, np.ones(501)),
        atol=1e-9,
    )


def test_arx_of_a_sampled_lag_becomes_that_lag() -> None:
    pole = np.exp(-0.01 / 0.4)
    model = ArxModel((-pole,), (2.0 * (1.0 - pole),), 1, 0.01, 0.0, 0)
    expected = first_order_step(TIME, 0.4, 2.0)
    np.testing.assert_allclose(step_response(continuous(model), TIME), expected, atol=1e-9)
    np.testing.assert_allclose(step_response(discrete(model), TIME), expected, atol=1e-9)


def test_dead_time_needs_a_pade_order() -> None:
    late = second_order_step(TIME - 0.2, 0.1, 0.6)
    fit = fit_step(TIME, late, order=2, dead_time=True)
    with pytest.raises(InputError, match="pade_order"):
        continuous(fit)
    response = step_response(continuous(fit, pade_order=5), TIME)
    np.testing.assert_allclose(response, late, atol=2e-3)


def test_refusals() -> None:
    ringing = ArxModel((-1.8, 0.9), (0.1,), 1, 0.01, 0.0, 0)
    with pytest.raises(InputError, match="oscillates"):
        continuous(ringing)
    with pytest.raises(InputError, match="sampled at"):
        step_response(discrete(ringing), 2.0 * TIME)
    with pytest.raises(InputError, match="start at 0"):
        step_response(discrete(ringing), TIME + 1.0)
    with pytest.raises(InputError, match="not uniform"):
        step_response(discrete(ringing), TIME**2)
