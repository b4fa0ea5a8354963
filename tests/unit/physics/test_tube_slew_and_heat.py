"""Line, slow valves and heat exchange: each step is the exact solution and keeps what it must."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.chamber import Chamber, absolute_pressure, air_state, relaxing_rate
from pamsim.physics.muscle_valves import reached_opening, tube_step
from pamsim.physics.valves import PULSE, VALVE

WARM, VOLUME, RESISTANCE = 293.15, 6e-6, 8e7
TUBE = SimpleNamespace(
    valve=SimpleNamespace(tube_resistance=RESISTANCE, tube_volume=VOLUME),
    chamber=SimpleNamespace(temperature=WARM, atmosphere=1e5),
)


@pytest.mark.parametrize("step", [1e-5, 5e-4, 0.1])
@pytest.mark.parametrize("inflow", [-2e-4, 0.0, 3e-4])
def test_a_step_of_the_line_is_the_solution_and_loses_no_air(step, inflow):
    chamber, before = 3e5, 2.6e5

    def rate(_, state):
        out = (state[0] - chamber) / RESISTANCE
        return [GAS_CONSTANT * WARM / VOLUME * (inflow - out), out]

    found = solve_ivp(rate, (0.0, step), [before, 0.0], rtol=1e-11, atol=1e-13, method="LSODA")
    after, out = tube_step(TUBE, before, chamber, inflow, step)
    assert after == pytest.approx(found.y[0, -1], rel=1e-9)
    assert out * step == pytest.approx(found.y[1, -1], rel=1e-6, abs=1e-16)


def test_in_steady_flow_the_line_drops_its_resistance_times_the_flow():
    steady, _ = tube_step(TUBE, 1e5, 4e5, 2e-4, 10.0)
    assert steady == pytest.approx(4e5 + RESISTANCE * 2e-4, rel=1e-12)
    after, out = tube_step(TUBE, steady, 4e5, 2e-4, 1e-3)
    assert (after, out) == pytest.approx((steady, 2e-4), rel=1e-12)


def slewed_opening(opening, before, travel_time, timestep, hysteresis=0.0, command=VALVE):
    valve = SimpleNamespace(
        travel_time=travel_time,
        line_lag=0.0,
        line_slew_time=0.0,
        hysteresis=hysteresis,
        pulse_period=1.0,
    )
    m = SimpleNamespace(command=command, valve=valve, chamber=TUBE.chamber)
    return reached_opening(m, SimpleNamespace(opening=before), opening, 1e5, 0.0, timestep)


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


def test_a_valve_that_sticks_stays_at_a_reversal_for_all_of_its_hysteresis():
    opening, path = 0.0, []
    commands = [0.05, 0.5, 0.9, 0.8, 0.7, 0.6, -0.9, -0.8]
    for command in commands:
        opening = slewed_opening(command, opening, 0.0, 5e-4, 0.2)
        path.append(opening)
    assert path == pytest.approx([0.0, 0.4, 0.8, 0.8, 0.8, 0.7, -0.8, -0.8], abs=1e-12)
    assert math.isnan(slewed_opening(math.nan, 0.2, 0.0, 5e-4, 0.2))
    # Slow as well: it moves at its speed to where it would stick.
    assert slewed_opening(1.0, 0.0, 0.04, 5e-4, 0.2) == pytest.approx(5e-4 / 0.04, rel=1e-12)
    assert slewed_opening(0.1, 0.0, 0.04, 5e-4, 0.2) == 0.0


def test_valves_that_pulse_do_not_stick():
    assert slewed_opening(0.5, 0.0, 0.0, 5e-4, 0.2, PULSE) == 1.0
    assert slewed_opening(0.0, 1.0, 0.0, 5e-4, 0.2, PULSE) == 0.0


@pytest.mark.parametrize("index", [1.2, 1.4])
def test_heat_exchange_brings_warm_air_back_exponentially(index):
    volume, ambient, rate, step = 1e-4, 3e5, 2.0, 0.01
    chamber = Chamber(polytropic_index=index, temperature=WARM, dead_volume=0.0, heat_rate=rate)
    air = air_state(chamber, 3.6e5, volume)
    seen = []
    for _ in range(100):
        pressure = absolute_pressure(chamber, air, volume)
        seen.append(pressure)
        air += step * relaxing_rate(chamber, air, pressure, ambient, step)
    expected = ambient + 6e4 * np.exp(-rate * step * np.arange(100))
    np.testing.assert_allclose(seen, expected, rtol=1e-10)
    assert relaxing_rate(chamber, air, ambient, ambient, step) == 0.0
    assert relaxing_rate(chamber, air, 2e5, 3e5, step) > 0.0  # cold air warms up
