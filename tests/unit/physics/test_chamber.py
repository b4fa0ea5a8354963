"""Air in a chamber: the equation its algebraic state stands for, heat, and leaks."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import (
    ATMOSPHERE,
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
)
from pamsim.physics.chamber import (
    Chamber,
    absolute_pressure,
    air_state,
    air_state_rate,
    relaxing_rate,
)
from pamsim.physics.muscle_valves import cross_flow, flow_through_valves, leak_flow
from pamsim.physics.record import pack, parameters
from pamsim.physics.valves import ValvePair
from tests.unit.physics.flat import air_flow, chamber_pressure, kernel, static_muscle
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, charged, make

WARM, TENDON = 293.15, 0.19
LEAK, GAP = 5e-11, 2e-10


def chamber(index: float, **changes: float) -> Chamber:
    return Chamber(polytropic_index=index, temperature=WARM, dead_volume=0.0, floor=1e3, **changes)


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
        heat = GAS_CONSTANT * WARM * mass_rate(time)
        return [index * (heat - p[0] * volume_rate(time)) / volume(time)]

    def state_rate(time, y):
        p = absolute_pressure(air, y[0], volume(time))
        return [air_state_rate(air, p, mass_rate(time))]

    times = np.linspace(0.0, 1.0, 21)
    tight = {"t_eval": times, "method": "DOP853", "rtol": 1e-11}
    direct = solve_ivp(pressure_rate, (0.0, 1.0), [3e5], atol=1e-5, **tight)
    filled = air_state(air, 3e5, volume(0.0))
    state = solve_ivp(state_rate, (0.0, 1.0), [filled], atol=1e-11 * filled, **tight)
    pressures = [
        absolute_pressure(air, float(y), volume(float(t)))
        for t, y in zip(times, state.y[0], strict=True)
    ]
    assert direct.y[0].max() > 1.5 * direct.y[0].min()  # the motion asks something of the law
    assert pressures == pytest.approx(direct.y[0], rel=1e-8)
    assert math.isnan(absolute_pressure(air, math.nan, 1e-4))


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
        flowed += step * flow * GAS_CONSTANT * WARM
        moved += step * abs(flow) * GAS_CONSTANT * WARM
    assert moved > 2.0 * before  # the cycle did fill and vent
    assert air - before == pytest.approx(flowed, abs=1e-9 * moved)


@pytest.mark.parametrize("index", [1.2, 1.4])
def test_heat_exchange_brings_warm_air_back_exponentially(index):
    held, ambient, rate, step = 1e-4, 3e5, 2.0, 0.01
    inside = chamber(index, heat_rate=rate)
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


def test_poiseuille_in_thin_slices_gives_the_flow_through_a_narrow_gap():
    """In each slice the volume flow g N (p_k - p_k+1) at its own density; one mass passes all."""
    slices, cold, inside, outside = 2000, 290.0, 5e5, 1e5
    m = parameters(leaking(0.0, 1.0, GAP, temperature=cold))
    m.chamber.atmosphere = outside
    given = leak_flow(m, inside)
    pressure = inside
    for _ in range(slices):  # the slice's fall of pressure that passes the given mass
        per_mass = GAS_CONSTANT * cold / (slices * GAP)
        middle = pressure - 0.5 * given * per_mass / pressure
        pressure -= given * per_mass / middle
    assert pressure == pytest.approx(outside, rel=1e-4)
    m.chamber.atmosphere = inside
    assert leak_flow(m, outside) == -given


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
