"""Orifice and chamber: laws that hold at every pressure, volume and opening."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pamsim.physics.air import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    flow_function,
    mass_flow,
)
from pamsim.physics.chamber import Chamber, absolute_pressure, air_state, air_state_rate
from tests.properties.strategies import SHARES, between

ORIFICES = st.tuples(between(0.0, 0.9), between(0.95, 0.9999))
"""Critical and laminar pressure ratio, over the whole range that the parameters allow."""
PRESSURES = between(1e3, 2e6)
PAIRS = st.one_of(
    st.tuples(PRESSURES, PRESSURES),
    st.tuples(PRESSURES, between(0.9, 1.1)).map(lambda drawn: (drawn[0], drawn[0] * drawn[1])),
)
"""Two pressures, far from each other or close: what goes wrong there are the roles of the sides."""
CONDUCTANCE = 6e-9
TEMPERATURES = between(200.0, 400.0)
VOLUMES = between(1e-6, 1e-2)
INDICES = between(1.0, 1.4)
FLOOR = 1.0


def chamber(index: float, temperature: float = 293.15, floor: float = FLOOR) -> Chamber:
    air = {"polytropic_index": index, "temperature": temperature, "floor": floor}
    return Chamber(dead_volume=0.0, **air)


@given(PAIRS, ORIFICES, TEMPERATURES)
def test_flow_is_odd_under_swapping_the_sides_and_never_uphill(pair, orifice, temperature):
    one, other = pair
    there = mass_flow(one, other, CONDUCTANCE, *orifice, temperature)
    assert mass_flow(other, one, CONDUCTANCE, *orifice, temperature) == -there
    assert math.isfinite(there)
    assert there * (one - other) >= 0.0
    assert mass_flow(one, one, CONDUCTANCE, *orifice, temperature) == 0.0


@given(PRESSURES, SHARES, ORIFICES, TEMPERATURES)
def test_flow_is_choked_up_to_the_critical_ratio_and_then_the_iso_6358_ellipse(
    upstream, share, orifice, temperature
):
    critical, laminar = orifice
    cold = math.sqrt(REFERENCE_TEMPERATURE / temperature)
    choked = CONDUCTANCE * REFERENCE_DENSITY * upstream * cold
    flow = mass_flow(upstream, share * critical * upstream, CONDUCTANCE, *orifice, temperature)
    assert flow == pytest.approx(choked, rel=1e-14)
    ratio = critical + share * (laminar - critical)
    assume(critical < ratio < laminar)
    depth = (ratio - critical) / (1.0 - critical)
    flow = mass_flow(upstream, ratio * upstream, CONDUCTANCE, *orifice, temperature)
    assert flow == pytest.approx(choked * math.sqrt(1.0 - depth**2), rel=1e-9)


@given(SHARES, SHARES, ORIFICES, between(1e-12, 1e-5))
def test_flow_function_falls_with_a_bounded_slope_right_up_to_equal_pressures(
    one, other, orifice, gap
):
    """Lipschitz up to ratio 1, where the bare ellipse is not; so it is continuous at its joints."""
    critical, laminar = orifice
    depth = (laminar - critical) / (1.0 - critical)
    steepest = math.sqrt((1.0 + depth) / (1.0 - depth)) / (1.0 - critical)  # the straight piece
    low, high = min(one, other), max(one, other)
    drop = flow_function(low, *orifice) - flow_function(high, *orifice)
    assert 0.0 <= drop <= steepest * (high - low) + 1e-12
    assert 0.0 < flow_function(1.0 - gap, *orifice) <= 1.001 * steepest * gap
    for joint in orifice:
        if joint > 0.0:
            beside = [flow_function(joint + side, *orifice) for side in (-1e-13, 1e-13)]
            assert beside == pytest.approx([flow_function(joint, *orifice)] * 2, abs=1e-9)


@given(PRESSURES, VOLUMES, VOLUMES, INDICES, between(1.0, 3e4))
def test_sealed_motion_keeps_p_v_to_the_n_down_to_the_floor(pressure, before, after, index, floor):
    air = air_state(chamber(index), pressure, before)
    assert absolute_pressure(chamber(index), air, before) == pytest.approx(pressure, rel=1e-12)
    moved = absolute_pressure(chamber(index, floor=floor), air, after)
    free = pressure * (before / after) ** index
    assert moved == pytest.approx(max(floor, free), rel=1e-12)


@given(PRESSURES, VOLUMES, INDICES, TEMPERATURES, between(-1e-2, 1e-2))
def test_state_rate_is_the_air_that_flows_in_at_the_pressure(
    pressure, volume, index, temperature, flow
):
    """dy = (y / V) R T dm / P: what a gram adds to y per volume it fills; isothermal, y is mass."""
    inside = chamber(index, temperature)
    air = air_state(inside, pressure, volume)
    added = air / volume * GAS_CONSTANT * temperature * flow / pressure
    assert air_state_rate(inside, pressure, flow) == pytest.approx(added, rel=1e-12)
    isothermal = air_state(chamber(1.0), pressure, volume)
    assert isothermal == pytest.approx(pressure * volume, rel=1e-12)
