"""Lead-lag: the margins asked for, the filter that is run, and its limits."""

from __future__ import annotations

import dataclasses
import math

import control
import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.controllers.lead_lag_design import design_lead_lag
from pamsim.controllers.model_based import lead_lag
from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.core.errors import InputError
from tests.unit.controllers.closed_loop import (
    MODEL,
    PERIOD,
    POINT,
    LinearPlant,
    observe,
    out_of_reach_and_back,
)

LAGS = SecondOrderModel(gain=3e-6, a1=0.09 + 0.58, a2=0.09 * 0.58)


def margins(model, design, delay=0):
    """Phase margin [deg] and crossover [rad/s] by python-control from the loop's response."""
    a, b = model.matrices()
    plant = control.sample_system(control.ss(a, b, [[1.0, 0.0]], 0.0), design.period, method="zoh")
    omega = np.geomspace(0.2, 0.99 * np.pi / design.period, 400)
    z = np.exp(1j * omega * design.period)
    filtered = np.polyval(design.numerator, z) / np.polyval(design.denominator, z)
    loop = filtered * plant(z) * z**-delay
    _, margin, _, crossed = control.margin(
        np.abs(loop), np.degrees(np.unwrap(np.angle(loop))), omega
    )
    return margin, crossed


@pytest.mark.parametrize(
    ("model", "crossover", "margin", "delay"),
    [(LAGS, 10.0, 60.0, 0), (LAGS, 8.0, 60.0, 1), (MODEL, 14.0, 50.0, 0), (MODEL, 16.0, 40.0, 2)],
)
def test_the_margin_asked_is_the_margin_had(model, crossover, margin, delay):
    design = design_lead_lag(
        model, period=PERIOD, crossover=crossover, phase_margin=math.radians(margin), delay=delay
    )
    found, crossed = margins(model, design, delay)
    assert found == pytest.approx(margin, abs=0.01)
    assert crossed == pytest.approx(crossover, rel=1e-4)
    assert math.degrees(design.phase_margin) == pytest.approx(margin, abs=1e-3)
    assert design.gain_margin > 1.0


def test_the_lag_lifts_the_gain_at_rest_and_phase_beyond_the_margin_is_left_to_the_plant():
    def at_rest(ratio):
        asked = {"period": PERIOD, "crossover": 4.0, "phase_margin": 1.0, "lag_ratio": ratio}
        design = design_lead_lag(LAGS, **asked)
        return sum(design.numerator) / sum(design.denominator)

    assert at_rest(20.0) / at_rest(2.0) == pytest.approx(10.0, rel=0.2)
    easy = design_lead_lag(LAGS, period=PERIOD, crossover=1.0, phase_margin=math.radians(20.0))
    assert easy.phase_margin > math.radians(60.0)


def test_an_impossible_design_is_refused():
    for asked, message in (
        ({"crossover": 90.0, "phase_margin": 0.7}, "Nyquist"),
        ({"crossover": 30.0, "phase_margin": 1.5, "delay": 2}, "at most 75: ask for a smaller"),
        ({"crossover": 6.0, "phase_margin": 0.7, "delay": 3}, "swings too"),
    ):
        with pytest.raises(InputError, match=message):
            design_lead_lag(MODEL, period=PERIOD, **asked)


DESIGN = design_lead_lag(MODEL, period=PERIOD, crossover=14.0, phase_margin=math.radians(50.0))
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


def test_a_disturbance_is_held_down_by_the_gain_at_rest():
    plant = LinearPlant(PERIOD, disturbance=lambda time: 1e4)
    wanted = POINT.angle + 0.1
    angles, _ = plant.close(CONTROLLER, lambda time: (wanted, 0.0, 0.0), 1500)
    at_rest = sum(DESIGN.numerator) / sum(DESIGN.denominator)
    left = MODEL.gain * 1e4 / (1.0 + MODEL.gain * at_rest)
    assert angles[-1] - wanted == pytest.approx(left, rel=1e-3)


def test_it_comes_back_from_the_limits_where_a_wound_up_one_does_not():
    design = dataclasses.replace(CONTROLLER.design, correction=(0.0, 0.0))
    angles, left = (
        LinearPlant(PERIOD).close(one, out_of_reach_and_back, 350)[0]
        for one in (CONTROLLER, dataclasses.replace(CONTROLLER, design=design))
    )
    assert abs(angles[-1] - 0.2) < 0.1 < 0.5 < abs(left[-1] - 0.2)
