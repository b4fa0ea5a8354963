"""Line, slow valves and heat exchange: each step is the exact solution and keeps what it must."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.chamber import absolute_pressure, air_state, relaxing_rate
from pamsim.physics.tube import line_outflow, near_end_pressure
from pamsim.physics.valves import slewed_opening

WARM, VOLUME, RESISTANCE = 293.15, 6e-6, 8e7


@pytest.mark.parametrize("step", [1e-5, 5e-4, 0.1])
@pytest.mark.parametrize("inflow", [-2e-4, 0.0, 3e-4])
def test_a_step_of_the_line_is_the_solution_and_loses_no_air(step, inflow):
    chamber, before = 3e5, 2.6e5

    def rate(_, state):
        out = (state[0] - chamber) / RESISTANCE
        return [GAS_CONSTANT * WARM / VOLUME * (inflow - out), out]

    found = solve_ivp(rate, (0.0, step), [before, 0.0], rtol=1e-11, atol=1e-13, method="LSODA")
    after = near_end_pressure(before, chamber, inflow, RESISTANCE, VOLUME, WARM, step)
    assert after == pytest.approx(found.y[0, -1], rel=1e-9)
    out = line_outflow(inflow, after - before, VOLUME, WARM, step)
    assert out * step == pytest.approx(found.y[1, -1], rel=1e-6, abs=1e-16)


def test_in_steady_flow_the_line_drops_its_resistance_times_the_flow():
    steady = near_end_pressure(1e5, 4e5, 2e-4, RESISTANCE, VOLUME, WARM, 10.0)
    assert steady == pytest.approx(4e5 + RESISTANCE * 2e-4, rel=1e-12)
    assert line_outflow(2e-4, 0.0, VOLUME, WARM, 1e-3) == 2e-4


def test_a_slow_valve_moves_at_its_speed_and_stops_where_it_is_wanted():
    opening, path = -0.3, []
    for _ in range(200):
        opening = slewed_opening(0.5, opening, 0.04, 5e-4)
        path.append(opening)
    assert np.diff(path[:60]) == pytest.approx(5e-4 / 0.04, rel=1e-9)
    assert path[63] == pytest.approx(0.5, abs=1e-12)
    assert path[64:] == [0.5] * 136
    assert slewed_opening(-1.0, 0.2, 0.04, 5e-4) == pytest.approx(0.2 - 5e-4 / 0.04, rel=1e-12)
    assert slewed_opening(-1.0, 0.2, 0.0, 5e-4) == -1.0
    assert math.isnan(slewed_opening(math.nan, 0.2, 0.04, 5e-4))


@pytest.mark.parametrize("index", [1.2, 1.4])
def test_heat_exchange_brings_warm_air_back_exponentially(index):
    volume, ambient, rate, step = 1e-4, 3e5, 2.0, 0.01
    air = air_state(3.6e5, volume, index)
    seen = []
    for _ in range(100):
        pressure = absolute_pressure(air, volume, index, 1e3)
        seen.append(pressure)
        air += step * relaxing_rate(air, pressure, ambient, index, rate, step)
    expected = ambient + 6e4 * np.exp(-rate * step * np.arange(100))
    np.testing.assert_allclose(seen, expected, rtol=1e-10)
    assert relaxing_rate(air, ambient, ambient, index, rate, step) == 0.0
    assert relaxing_rate(air, 2e5, 3e5, index, rate, step) > 0.0  # cold air warms up
