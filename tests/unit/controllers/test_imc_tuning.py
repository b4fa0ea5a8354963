"""IMC gains make the loop one lag of the wanted time constant."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.controllers.imc_tuning import imc_gains, imc_gains_of_fit
from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.core.errors import InputError
from pamsim.linear.continuous_fit import fit_continuous
from tests.unit.linear.planted import record

MODEL = SecondOrderModel(gain=3e-6, a1=0.07, a2=0.009)


@pytest.mark.parametrize("late", [0.0, 0.03])
def test_the_open_loop_is_an_integrator_of_the_wanted_speed(late):
    gains = imc_gains(MODEL, closed_loop_time=0.1, dead_time=late)
    s = 1j * np.geomspace(0.1, 100.0, 20)
    plant = MODEL.gain / (MODEL.a2 * s**2 + MODEL.a1 * s + 1.0)
    pid = gains.gain * (1.0 + 1.0 / (gains.integral_time * s) + gains.derivative_time * s)
    np.testing.assert_allclose(pid * plant, 1.0 / ((0.1 + late) * s), rtol=1e-12)


def test_a_fit_is_tuned_by_its_own_numbers():
    fit = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=1)
    gains = imc_gains_of_fit(fit, closed_loop_time=0.2)
    assert gains.integral_time == fit.time_constants[0]
    assert gains.gain == pytest.approx(fit.time_constants[0] / (0.2 * fit.gain))
    two = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=2)
    assert imc_gains_of_fit(two, closed_loop_time=0.2).integral_time == pytest.approx(
        sum(two.time_constants)
    )


def test_what_is_no_g1_or_g2_or_not_stable_is_refused():
    fit = fit_continuous([record(1, gain=2.0, noise=0.01, n=300)], order=2, zeros=1)
    with pytest.raises(InputError, match="no zero"):
        imc_gains_of_fit(fit, closed_loop_time=0.2)
    with pytest.raises(InputError, match="closed-loop"):
        imc_gains(MODEL, closed_loop_time=0.0)
    for name in ("gain", "a1", "a2"):
        with pytest.raises(InputError, match="above 0"):
            dataclasses.replace(MODEL, **{name: -1.0})
