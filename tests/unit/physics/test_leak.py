"""A leaking muscle loses its air as orifice or narrow gap let it, and none when empty."""

from __future__ import annotations

import dataclasses
import math

import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.air import GAS_CONSTANT, REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from pamsim.physics.muscle_valves import cross_flow, leak_flow
from pamsim.physics.record import pack, parameters
from tests.unit.physics.flat import air_flow, chamber_pressure, kernel, static_muscle
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, charged, make

TENDON = 0.19
LEAK = 5e-11


GAP = 2e-10


def leaking(conductance: float = LEAK, index: float = 1.0, gap: float = 0.0):
    base = make(**LASTING, valve=PLAIN_VALVE)
    chamber = dataclasses.replace(
        base.chamber,
        polytropic_index=index,
        leak_conductance=conductance,
        laminar_leak_conductance=gap,
    )
    return dataclasses.replace(base, chamber=chamber)


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


@pytest.mark.parametrize("index", [1.0, 1.2, 1.4])
def test_choked_leak_empties_a_still_muscle_exponentially(index):
    """dP/dt = n R T mdot / V with mdot in proportion to P: rate n R T C rho sqrt(T0/T) / V."""
    muscle = leaking(index=index)
    row, chamber = pack(muscle), muscle.chamber
    cold = math.sqrt(REFERENCE_TEMPERATURE / chamber.temperature)
    speed = index * GAS_CONSTANT * chamber.temperature * LEAK * REFERENCE_DENSITY * cold
    speed /= static_muscle.static_volume(row, TENDON, 0.0)
    duration = 0.3 / speed
    start = 6e5 + chamber.atmosphere
    end = emptied(muscle, 6e5, duration)
    assert chamber.atmosphere < muscle.valve.critical_ratio * end, "choked to the end"
    assert end == pytest.approx(start * math.exp(-0.3), rel=1e-7)


@pytest.mark.parametrize("index", [1.0, 1.4])
def test_a_narrow_gap_empties_a_still_muscle_as_riccati_has_it(index):
    """dP/dt = -n g (P^2 - P_a^2) / (2 V): (P - P_a) / (P + P_a) falls at the rate n g P_a / V."""
    muscle = leaking(0.0, index, GAP)
    row, outside = pack(muscle).tolist(), muscle.chamber.atmosphere
    speed = index * GAP * outside / static_muscle.static_volume(row, TENDON, 0.0)
    start = 5e5 + outside
    share = (start - outside) / (start + outside) * math.exp(-0.8)
    end = emptied(muscle, 5e5, 0.8 / speed)
    assert end == pytest.approx(outside * (1.0 + share) / (1.0 - share), rel=1e-7)


def test_poiseuille_in_thin_slices_gives_the_flow_through_a_narrow_gap():
    """In each slice the volume flow g N (p_k - p_k+1) at its own density; one mass passes all."""
    slices, cold, inside, outside = 2000, 290.0, 5e5, 1e5
    chamber = dataclasses.replace(leaking(0.0, 1.0, GAP).chamber, temperature=cold)
    m = parameters(dataclasses.replace(leaking(), chamber=chamber))
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
def test_it_ends_at_the_atmosphere(muscle):
    assert emptied(muscle, 3e5, 100.0) == pytest.approx(muscle.chamber.atmosphere, rel=1e-6)
    assert emptied(muscle, 0.0, 1.0) == pytest.approx(muscle.chamber.atmosphere, rel=1e-12)


@pytest.mark.parametrize("muscle", [leaking(), leaking(0.0, 1.0, GAP)], ids=["orifice", "gap"])
def test_what_the_valve_brings_comes_on_top(muscle):
    """Net flow is the valve's less the leak's, which the command does not touch."""
    tight, leaky = pack(leaking(0.0)).tolist(), pack(muscle).tolist()
    for pressure in (1.5e5, 4e5, 6.5e5):
        lost = air_flow(leaky, pressure, 0.0, 0.0)
        assert lost < 0.0
        for command in (-0.7, 0.3, 1.0):
            valve = air_flow(tight, pressure, command, 0.0)
            both = air_flow(leaky, pressure, command, 0.0)
            assert both - valve == pytest.approx(lost, rel=1e-9)


def joined(size: float, temperature: float):
    base = leaking(0.0)
    chamber = dataclasses.replace(
        base.chamber, cross_leak_conductance=size, temperature=temperature
    )
    return parameters(dataclasses.replace(base, chamber=chamber))


def test_what_one_muscle_loses_to_the_other_that_one_gains():
    one, other = joined(GAP, 290.0), joined(0.0, 310.0)
    for inside, beyond in ((5e5, 2e5), (1e5, 6e5), (3e5, 3e5)):
        assert cross_flow(one, other, inside, beyond) == -cross_flow(other, one, beyond, inside)
    assert cross_flow(one, other, 3e5, 3e5) == 0.0
    assert cross_flow(other, other, 5e5, 2e5) == 0.0


def test_a_leak_to_a_muscle_at_the_atmosphere_is_one_to_the_atmosphere():
    one = joined(GAP, 300.0)
    outside = one.chamber.atmosphere
    to_the_air = parameters(leaking(0.0, 1.0, GAP))
    to_the_air.chamber.temperature = 300.0
    expected = -leak_flow(to_the_air, 4e5)
    assert cross_flow(one, one, 4e5, outside) == pytest.approx(expected, rel=1e-13)
