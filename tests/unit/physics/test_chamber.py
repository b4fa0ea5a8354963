"""The chamber's algebraic state against the differential equation it stands for."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import ATMOSPHERE, GAS_CONSTANT
from pamsim.physics.chamber import Chamber, absolute_pressure, air_state, air_state_rate
from pamsim.physics.muscle_valves import flow_through_valves
from pamsim.physics.valves import ValvePair

TEMPERATURE = 293.15
FLOOR = 1e3
START = 3e5


def chamber(index: float) -> Chamber:
    return Chamber(polytropic_index=index, temperature=TEMPERATURE, dead_volume=0.0, floor=FLOOR)


def volume(time: float) -> float:
    return 1e-4 * (1.0 + 0.3 * math.sin(7.0 * time) + 0.1 * math.sin(23.0 * time))


def volume_rate(time: float) -> float:
    return 1e-4 * (2.1 * math.cos(7.0 * time) + 2.3 * math.cos(23.0 * time))


def mass_rate(time: float) -> float:
    return 5e-4 * math.sin(11.0 * time) + 1e-4


@pytest.mark.parametrize("index", [1.0, 1.2, 1.4])
def test_state_obeys_the_pressure_equation(index):
    """dP/dt = n (R T mdot - P dV/dt) / V along a motion and a flow, both integrated tightly."""
    air = chamber(index)

    def pressure_rate(time, p):
        heat = GAS_CONSTANT * TEMPERATURE * mass_rate(time)
        return [index * (heat - p[0] * volume_rate(time)) / volume(time)]

    def state_rate(time, y):
        p = absolute_pressure(air, y[0], volume(time))
        return [air_state_rate(air, p, mass_rate(time))]

    times = np.linspace(0.0, 2.0, 41)
    tight = {"t_eval": times, "method": "DOP853", "rtol": 1e-11}
    direct = solve_ivp(pressure_rate, (0.0, 2.0), [START], atol=1e-5, **tight)
    filled = air_state(air, START, volume(0.0))
    state = solve_ivp(state_rate, (0.0, 2.0), [filled], atol=1e-11 * filled, **tight)
    pressures = [
        absolute_pressure(air, float(y), volume(float(t)))
        for t, y in zip(times, state.y[0], strict=True)
    ]
    assert direct.y[0].max() > 1.5 * direct.y[0].min()  # the motion asks something of the law
    assert pressures == pytest.approx(direct.y[0], rel=1e-8)


def test_fill_vent_cycle_neither_makes_nor_loses_air():
    """n = 1: y / (R T) is the mass, so explicit Euler conserves it at any step size."""
    valve = ValvePair(
        conductance_fill=6e-9,
        conductance_exhaust=6e-9,
        critical_ratio=0.3,
        supply_pressure=7e5 - ATMOSPHERE,
    )
    m = SimpleNamespace(valve=valve, chamber=chamber(1.0))
    step, air = 1e-3, air_state(m.chamber, ATMOSPHERE, volume(0.0))
    before, flowed, moved = air, 0.0, 0.0
    for k, opening in enumerate(np.repeat([1.0, 0.0, -1.0, 0.3, -0.6], 120).tolist()):
        pressure = absolute_pressure(m.chamber, air, volume(k * step))
        flow = flow_through_valves(m, pressure, opening, 0.0)
        air += step * air_state_rate(m.chamber, pressure, flow)
        flowed += step * flow * GAS_CONSTANT * TEMPERATURE
        moved += step * abs(flow) * GAS_CONSTANT * TEMPERATURE
    assert moved > 2.0 * before  # the cycle did fill and vent
    assert air - before == pytest.approx(flowed, abs=1e-9 * moved)


def test_nan_air_gives_nan_pressure():
    assert math.isnan(absolute_pressure(chamber(1.2), math.nan, 1e-4))
