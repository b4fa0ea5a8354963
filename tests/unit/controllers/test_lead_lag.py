"""Lead-lag: the margins asked for, the filter that is run, and its limits."""

import dataclasses
import math

import control
import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.controllers.lead_lag_design import design_lead_lag
from pamsim.controllers.model_based import lead_lag
from pamsim.controllers.second_order_model import SecondOrderModel
from tests.unit.controllers.closed_loop import (
    MODEL,
    PERIOD,
    POINT,
    LinearPlant,
    observe,
    out_of_reach_and_back,
)
from tests.unit.core.refusals import all_refused

LAGS = SecondOrderModel(gain=3e-6, a1=0.09 + 0.58, a2=0.09 * 0.58)


def design(model, crossover, margin, **more):
    asked = {"crossover": crossover, "phase_margin": math.radians(margin)}
    return design_lead_lag(model, period=PERIOD, **asked, **more)


def margins(model, made, delay=0):
    """Phase margin [deg] and crossover [rad/s] by python-control from the loop's response."""
    a, b = model.matrices()
    plant = control.sample_system(control.ss(a, b, [[1.0, 0.0]], 0.0), PERIOD, method="zoh")
    omega = np.geomspace(0.2, 0.99 * np.pi / PERIOD, 400)
    z = np.exp(1j * omega * PERIOD)
    filtered = np.polyval(made.numerator, z) / np.polyval(made.denominator, z)
    loop = filtered * plant(z) * z**-delay
    turned = np.degrees(np.unwrap(np.angle(loop)))
    _, margin, _, crossed = control.margin(np.abs(loop), turned, omega)
    return margin, crossed


def test_the_margin_asked_is_the_margin_had():
    for model, crossover, margin, delay in (
        (LAGS, 10.0, 60.0, 0),
        (LAGS, 8.0, 60.0, 1),
        (MODEL, 14.0, 50.0, 0),
        (MODEL, 16.0, 40.0, 2),
    ):
        made = design(model, crossover, margin, delay=delay)
        found, crossed = margins(model, made, delay)
        assert found == pytest.approx(margin, abs=0.01)
        assert crossed == pytest.approx(crossover, rel=1e-4)
        assert math.degrees(made.phase_margin) == pytest.approx(margin, abs=1e-3)
        assert made.gain_margin > 1.0


def at_rest(made):
    return sum(made.numerator) / sum(made.denominator)


def test_the_lag_lifts_the_gain_at_rest_and_phase_beyond_the_margin_is_left_to_the_plant():
    much, little = (at_rest(design(LAGS, 4.0, 57.3, lag_ratio=ratio)) for ratio in (20.0, 2.0))
    assert much / little == pytest.approx(10.0, rel=0.2)
    assert design(LAGS, 1.0, 20.0).phase_margin > math.radians(60.0)
    bad = {
        "Nyquist": (90.0, 40.0, {}, "Nyquist"),
        "phase": (30.0, 86.0, {"delay": 2}, "at most 75: ask for a smaller"),
        "swings": (6.0, 40.0, {"delay": 3}, "the resonance of G2 is too strong"),
    }
    all_refused(bad, lambda crossover, margin, more: design(MODEL, crossover, margin, **more))


DESIGN = design(MODEL, 14.0, 50.0)
CONTROLLER = lead_lag(DESIGN, MODEL, POINT)


def test_it_runs_the_filter_of_the_design():
    errors = 0.02 * np.sin(np.arange(60) ** 1.3)
    rest = observe(angle=POINT.angle, pressure=POINT.pressures(0.0))
    memory, outputs = CONTROLLER.start(rest), []
    for error in errors.tolist():
        observation = observe(angle=POINT.angle - error, wanted=(POINT.angle, 0.0, 0.0))
        command, memory = CONTROLLER.step(observation, memory)
        outputs.append(command[0] - command[1] - POINT.difference)
    expected = lfilter(DESIGN.numerator, DESIGN.denominator, errors)
    np.testing.assert_allclose(outputs, expected, atol=1e-6)


def test_it_comes_back_from_the_limits_where_a_wound_up_one_does_not():
    wound = dataclasses.replace(CONTROLLER.design, correction=(0.0, 0.0))
    angles, left = (
        LinearPlant(PERIOD).close(one, out_of_reach_and_back, 350)[0]
        for one in (CONTROLLER, dataclasses.replace(CONTROLLER, design=wound))
    )
    assert abs(angles[-1] - 0.2) < 0.1 < 0.5 < abs(left[-1] - 0.2)
