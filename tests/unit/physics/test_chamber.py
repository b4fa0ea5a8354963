"""Air in a chamber: the equation its algebraic state stands for, heat, and leaks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import GAS_CONSTANT, REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from pamsim.physics.chamber import Chamber, absolute_pressure, air_state, relaxing_rate
from pamsim.physics.muscle_valves import cross_flow, leak_flow
from pamsim.physics.record import pack, parameters
from tests.unit.physics.flat import air_flow, chamber_pressure, kernel, static_muscle
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, charged, make

TENDON, LEAK, GAP = 0.19, 5e-11, 2e-10


@pytest.mark.parametrize("index", [1.2, 1.4])
def test_heat_exchange_brings_warm_air_back_exponentially(index):
    held, ambient, rate, step = 1e-4, 3e5, 2.0, 0.01
    warm = {"temperature": 293.15, "dead_volume": 0.0, "heat_rate": rate}
    inside = Chamber(polytropic_index=index, **warm)
    air = air_state(inside, 3.6e5, held)
    seen = []
    for _ in range(100):
        seen.append(absolute_pressure(inside, air, held))
        air += step * relaxing_rate(inside, air, seen[-1], ambient, step)
    expected = ambient + 6e4 * np.exp(-rate * step * np.arange(100))
    np.testing.assert_allclose(seen, expected, rtol=1e-10)
    assert relaxing_rate(inside, air, ambient, ambient, step) == 0.0
    assert relaxing_rate(inside, air, 2e5, 3e5, step) > 0.0  # cold air warms up


# --- leaks ---------------------------------------------------------------------------------------


def leaking(conductance: float = LEAK, index: float = 1.0, gap: float = 0.0, **changes: float):
    base = make(**LASTING, valve=PLAIN_VALVE)
    leak = {"leak_conductance": conductance, "laminar_leak_conductance": gap}
    air = dataclasses.replace(base.chamber, polytropic_index=index, **leak, **changes)
    return dataclasses.replace(base, chamber=air)


def emptied(muscle, pressure: float, duration: float) -> float:
    """Absolute pressure [Pa] in a still muscle on shut valves after a time [s]."""
    row = pack(muscle).tolist()
    *still, air = charged(muscle, TENDON, pressure)

    def rate(time, state):
        act = [*still, float(state[0])]
        out = [0.0] * len(act)
        kernel.state_rates(row, act, out, TENDON, 0.0, 0.0, time, 1e-3)
        return out[-1:]

    found = solve_ivp(rate, (0.0, duration), [air], rtol=1e-10, atol=1e-10)
    return chamber_pressure(row, [*still, float(found.y[0, -1])], TENDON)


@pytest.mark.parametrize("index", [1.0, 1.4])
def test_a_still_muscle_empties_exponentially_through_a_choked_orifice_and_as_riccati_in_a_gap(
    index,
):
    """dP/dt = n R T mdot / V with mdot in proportion to P: rate n R T C rho sqrt(T0/T) / V.

    Through a gap dP/dt = -n g (P^2 - P_a^2) / (2 V), of which (P - P_a) / (P + P_a) falls at the
    rate n g P_a / V.
    """
    muscle = leaking(index=index)
    inside, outside = muscle.chamber, muscle.chamber.atmosphere
    room = static_muscle.static_volume(pack(muscle).tolist(), TENDON, 0.0)
    cold = math.sqrt(REFERENCE_TEMPERATURE / inside.temperature)
    speed = index * GAS_CONSTANT * inside.temperature * LEAK * REFERENCE_DENSITY * cold / room
    end = emptied(muscle, 6e5, 0.3 / speed)
    assert outside < muscle.valve.critical_ratio * end, "choked to the end"
    assert end == pytest.approx((6e5 + outside) * math.exp(-0.3), rel=1e-7)
    speed, start = index * GAP * outside / room, 5e5 + outside
    share = (start - outside) / (start + outside) * math.exp(-0.8)
    end = emptied(leaking(0.0, index, GAP), 5e5, 0.8 / speed)
    assert end == pytest.approx(outside * (1.0 + share) / (1.0 - share), rel=1e-7)


@pytest.mark.parametrize("muscle", [leaking(), leaking(0.0, 1.0, GAP)], ids=["orifice", "gap"])
def test_a_leak_ends_at_the_atmosphere_and_what_the_valve_brings_comes_on_top(muscle):
    outside = muscle.chamber.atmosphere
    assert emptied(muscle, 3e5, 100.0) == pytest.approx(outside, rel=1e-6)
    assert emptied(muscle, 0.0, 1.0) == pytest.approx(outside, rel=1e-12)
    tight, leaky = pack(leaking(0.0)).tolist(), pack(muscle).tolist()
    for pressure in (1.5e5, 4e5, 6.5e5):
        lost = air_flow(leaky, pressure, 0.0, 0.0)
        assert lost < 0.0
        for command in (-0.7, 0.3, 1.0):
            valve = air_flow(tight, pressure, command, 0.0)
            both = air_flow(leaky, pressure, command, 0.0)
            assert both - valve == pytest.approx(lost, rel=1e-9)


def test_what_one_muscle_loses_to_the_other_that_one_gains():
    def joined(size, temperature):
        return parameters(leaking(0.0, cross_leak_conductance=size, temperature=temperature))

    one, other = joined(GAP, 290.0), joined(0.0, 310.0)
    for inside, beyond in ((5e5, 2e5), (1e5, 6e5), (3e5, 3e5)):
        assert cross_flow(one, other, inside, beyond) == -cross_flow(other, one, beyond, inside)
    assert cross_flow(one, other, 3e5, 3e5) == 0.0
    assert cross_flow(other, other, 5e5, 2e5) == 0.0
    # To a muscle at the atmosphere it is a leak to the atmosphere, with the means of both.
    alone = parameters(leaking(0.0, 1.0, 0.5 * GAP, temperature=300.0))
    found = cross_flow(one, other, 4e5, one.chamber.atmosphere)
    assert found == pytest.approx(-leak_flow(alone, 4e5), rel=1e-13)
