"""The pair of valves, the ways to drive it, and what lies between command, valve and muscle."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from pamsim.physics.air import GAS_CONSTANT
from pamsim.physics.muscle_valves import (
    flow_through_valves,
    line_rate,
    reached_opening,
    tube_step,
    wanted_opening,
)
from pamsim.physics.record import COMMON, pack
from pamsim.physics.step_limits import regulator_time_constant
from pamsim.physics.supply import VALVE as VALVE_NUMBERS
from pamsim.physics.supply import fill_valve_of
from pamsim.physics.valves import (
    PRESSURE_SET,
    PULSE,
    VALVE,
    ValvePair,
    clamped_opening,
    flow_share,
    largest_factor,
    past_dead_zone,
)
from tests.unit.physics.flat import gauge_pressure, kernel, rest_state
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, make
from tests.unit.physics.splines import by_scipy

SUPPLY, EXHAUST = 701325.0, 101325.0
FILL, VENT = 6e-9, 9e-9
AIR = (0.3, 0.999, 293.15)  # critical ratio, laminar ratio, temperature [K]
PERIOD = 0.02


def made(command: float = VALVE, **changes: float) -> SimpleNamespace:
    """Parameters of valves on a chamber, with a command."""
    given = {
        "conductance_fill": FILL,
        "conductance_exhaust": VENT,
        "critical_ratio": AIR[0],
        "laminar_ratio": AIR[1],
        "supply_pressure": SUPPLY - EXHAUST,
        "pulse_period": PERIOD,
    }
    valve = ValvePair(**(given | changes))
    chamber = SimpleNamespace(atmosphere=EXHAUST, temperature=AIR[2])
    return SimpleNamespace(command=command, valve=valve, chamber=chamber)


def flow(opening: float, chamber: float) -> float:
    return flow_through_valves(made(), chamber, opening, 0.0)


def regulated(set_point: float, pressure: float, band: float, dead_band: float) -> float:
    m = made(PRESSURE_SET, regulator_band=band, regulator_dead_band=dead_band)
    return wanted_opening(m, set_point, pressure, 0.0)


def past(opening: float, zone: float, asymmetry: float) -> float:
    return past_dead_zone(made(dead_zone=zone, dead_zone_asymmetry=asymmetry).valve, opening)


LEARNED = dict(zip((f"learned_{k}" for k in range(1, 9)), range(-2, 6), strict=True))
CURVED = {"learned_low": -1.0, "learned_high": 0.8} | {n: 0.2 * c for n, c in LEARNED.items()}


def test_a_learned_curve_changes_the_flow_by_its_share_of_it_and_turns_none_around():
    curved = made(dead_zone=0.1, **CURVED)
    control = 0.2 * np.arange(-2.0, 6.0)
    for opening in np.linspace(-1.0, 1.0, 21).tolist():
        factor = 1.0 + by_scipy(control, (-1.0, 0.8), min(opening, 0.8))
        left = past_dead_zone(curved.valve, opening)
        assert flow_share(curved.valve, opening) == pytest.approx(left * factor, abs=1e-12)
        through = flow_through_valves(curved, 3e5, opening, 0.0)
        without = flow_through_valves(made(dead_zone=0.1), 3e5, opening, 0.0)
        assert through == pytest.approx(without * factor, abs=1e-15)
        assert factor <= largest_factor(curved.valve) == 2.0
    seen_by_supply, states = [0.0] * VALVE_NUMBERS, SimpleNamespace(opening=0.0)
    fill_valve_of(curved, states, 3e5, 0.5, 0.0, 1e-3, seen_by_supply)
    assert seen_by_supply[2] == pytest.approx(flow_share(curved.valve, 0.5) * FILL)
    shut = made(**{**CURVED, "learned_1": -3.0}).valve
    assert flow_share(shut, -1.0) == 0.0
    assert math.isnan(flow_share(curved.valve, math.nan))
    without_ends = made(**{name: 0.2 * c for name, c in LEARNED.items()}).valve
    assert flow_share(without_ends, 0.3) == 0.3
    assert largest_factor(without_ends) == 1.0


def test_nan_is_not_hidden():
    least = made(PRESSURE_SET, least_set_point=1e4)
    for name, value in {
        "clamp": clamped_opening(math.nan),
        "pulse": wanted_opening(made(PULSE), math.nan, 0.0, 0.001),
        "set point": regulated(math.nan, 1e5, 1e4, 0.0),
        "least set point": wanted_opening(least, math.nan, 1e5, 0.0),
        "pressure": regulated(1e5, math.nan, 1e4, 5e3),
        "dead zone": past(math.nan, 0.1, 0.0),
        "opening": flow(math.nan, 3e5),
        "chamber, filling": flow(0.5, math.nan),
        "chamber, venting": flow(-0.5, math.nan),
        "slow valve": reached(math.nan, 0.2, travel_time=0.04),
        "valve that sticks": reached(math.nan, 0.2, hysteresis=0.2),
        "line": line(math.nan, 0.0, 1e-3, line_lag=0.05, line_slew_time=0.2),
    }.items():
        assert math.isnan(value), name


def test_pulses_have_the_duty_for_their_mean():
    times = PERIOD * (7 + (np.arange(500) + 0.5) / 500)
    for duty in (0.0, 0.001, 0.25, 1.0 / 3.0, 0.9995, 1.0):
        for sign in (1.0, -1.0):
            m = made(PULSE)
            openings = np.array([wanted_opening(m, sign * duty, 0.0, t) for t in times.tolist()])
            assert set(openings) <= {0.0, sign}  # the sign of the duty selects the one valve
            assert abs(openings.mean() - sign * duty) <= 1.0 / 500
            assert np.all(np.diff(np.abs(openings)) <= 0.0)  # open first, then shut


@pytest.mark.parametrize("steps", [0.3, 1.0, 7.0, 40.0, 41.7])
def test_pulses_have_the_duty_for_their_mean_at_any_time_step(steps):
    """Of so many steps in a period: as many periods as make whole steps."""
    timestep, count = PERIOD / steps, round(10 * steps)
    for duty in (0.0, 0.001, 0.31, 0.9995, 1.0):
        m = made(PULSE)
        means = [wanted_opening(m, -duty, 0.0, k * timestep, timestep) for k in range(count)]
        assert -np.mean(means) == pytest.approx(duty, abs=1e-12)
        assert np.all((np.array(means) <= 0.0) & (np.array(means) >= -1.0 - 1e-12))


@pytest.mark.parametrize("dead", [0.0, 2e3])
def test_regulator_is_odd_continuous_and_opens_a_band_beyond_its_dead_band(dead):
    band = 1e4
    errors = np.linspace(-2e4, 2e4, 1001)
    openings = np.array([regulated(1e5 + e, 1e5, band, dead) for e in errors])
    swapped = np.array([regulated(1e5, 1e5 + e, band, dead) for e in errors])
    assert np.array_equal(openings, -swapped)
    slopes = np.diff(openings)
    assert np.all(slopes >= -1e-12)
    assert np.all(slopes <= (errors[1] - errors[0]) / band + 1e-9)  # no jump anywhere
    for error in (-dead, -0.5 * dead, 0.0, dead):
        assert regulated(1e5 + error, 1e5, band, dead) == 0.0
    assert regulated(1e5 + dead + 0.5 * band, 1e5, band, dead) == pytest.approx(0.5)
    assert regulated(1e5 + dead + band, 1e5, band, dead) == pytest.approx(1.0)
    assert regulated(1e5 - dead - 2.0 * band, 1e5, band, dead) == -1.0


def test_a_regulator_keeps_to_its_least_set_point_where_a_lower_one_is_sent():
    m = made(PRESSURE_SET, regulator_band=1e5, least_set_point=3e4)
    for pressure in (0.0, 2e4, 8e4):
        for sent in (1e4, -5e3, 3e4):
            found = wanted_opening(m, sent, pressure, 0.0)
            assert found == pytest.approx((3e4 - pressure) / 1e5)
    assert wanted_opening(m, 4e4, 2e4, 0.0) == pytest.approx(0.2)
    assert regulated(-5e3, 0.0, 1e5, 0.0) == pytest.approx(-0.05)  # into vacuum, without it


def test_a_dead_zone_shuts_the_middle_and_keeps_the_ends():
    """Odd, shut up to the zone, without a jump, straight, fully open at the end."""
    half = np.linspace(0.0, 1.0, 501)
    openings = np.concatenate([-half[:0:-1], half])
    for zone in (0.01, 0.2, 0.9):
        left = np.array([past(u, zone, 0.0) for u in openings.tolist()])
        assert np.array_equal(left, -left[::-1])
        assert np.all(left[np.abs(openings) <= zone] == 0.0)
        assert np.all(left[openings > zone] > 0.0)
        assert (left[0], left[-1]) == (-1.0, 1.0)
        slopes = np.diff(left) / np.diff(openings)
        assert np.all((slopes >= 0.0) & (slopes <= 1.0 / (1.0 - zone) + 1e-9))
        assert past(0.5 * (1.0 + zone), zone, 0.0) == pytest.approx(0.5, rel=1e-12)


def test_each_valve_has_the_dead_zone_of_its_side_and_none_is_none_to_the_bit():
    """Either side is that of a symmetric zone of its own width; 1 leaves the other side none."""
    for asymmetry in (-1.0, -0.4, 0.3, 1.0):
        for opening in np.linspace(0.0, 1.0, 101).tolist():
            assert past(opening, 0.3, asymmetry) == past(opening, 0.3 * (1.0 + asymmetry), 0.0)
            assert past(-opening, 0.3, asymmetry) == past(-opening, 0.3 * (1.0 - asymmetry), 0.0)
            assert past(opening, 0.0, asymmetry) == opening
    # The wider zone never shuts a valve for good.
    assert past(1.0, 0.8, 0.9) == past(-1.0, 0.8, -0.9) * -1.0 == 1.0


# --- the line of the command ---------------------------------------------------------------------


def line(command, carried, timestep, **valve):
    """Rate of a command of a set point on a line, or of an opening up to 1."""
    m = SimpleNamespace(
        command=PRESSURE_SET if abs(command) > 1.0 else VALVE,
        valve=SimpleNamespace(**{"line_lag": 0.0, "line_slew_time": 0.0} | valve),
    )
    return line_rate(m, SimpleNamespace(line=carried), command, timestep)


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_a_line_of_limited_rate_moves_by_its_full_scale_in_its_time(lag):
    """A high step at the limit, down as up; what is left of it as without one."""
    slew_time, timestep = 0.2, 1e-3
    for height, full in ((4e5, 1e5), (-4e5, 1e5), (0.9, 1.0)):
        carried, seen = 0.0, []
        for _ in range(2000):
            seen.append(carried)
            carried += timestep * line(
                height, carried, timestep, line_lag=lag, line_slew_time=slew_time
            )
        rates = np.diff(seen) / timestep
        limited = np.abs(height - np.array(seen[:-1])) > max(lag, timestep) * full / slew_time
        assert np.sum(limited) > 100
        assert rates[limited] == pytest.approx(math.copysign(full / slew_time, height))
        assert np.abs(rates).max() <= full / slew_time * (1.0 + 1e-9)
        assert carried == pytest.approx(height, rel=1e-9)


# --- slow and sticking valves, and the tube behind them ------------------------------------------


def reached(opening, before, command=VALVE, **valve):
    slow = {"travel_time": 0.0, "hysteresis": 0.0, "line_lag": 0.0, "line_slew_time": 0.0}
    m = SimpleNamespace(
        command=command,
        valve=SimpleNamespace(**slow | valve, pulse_period=1.0),
        chamber=SimpleNamespace(atmosphere=1e5),
    )
    return reached_opening(m, SimpleNamespace(opening=before, line=0.0), opening, 1e5, 0.0, 5e-4)


@pytest.mark.parametrize("line", [{"line_lag": 1e-9}, {"line_slew_time": 1e-9}])
def test_a_line_that_hardly_takes_time_leaves_the_valve_where_it_is_without(line):
    assert reached(0.5, 0.0, **line) == pytest.approx(reached(0.5, 0.0), rel=1e-9)


def test_a_slow_valve_moves_at_its_speed_and_stops_where_it_is_wanted():
    opening, path = -0.3, []
    for _ in range(80):
        opening = reached(0.5, opening, travel_time=0.04)
        path.append(opening)
    assert np.diff(path[:60]) == pytest.approx(5e-4 / 0.04, rel=1e-9)
    assert path[63] == pytest.approx(0.5, abs=1e-12)
    assert path[64:] == [0.5] * 16
    assert reached(-1.0, 0.2, travel_time=0.04) == pytest.approx(0.2 - 5e-4 / 0.04, rel=1e-12)
    assert reached(-1.0, 0.2) == -1.0


def test_a_valve_that_sticks_stays_at_a_reversal_for_all_of_its_hysteresis():
    opening, path = 0.0, []
    for command in (0.05, 0.5, 0.9, 0.8, 0.7, 0.6, -0.9, -0.8):
        opening = reached(command, opening, hysteresis=0.2)
        path.append(opening)
    assert path == pytest.approx([0.0, 0.4, 0.8, 0.8, 0.8, 0.7, -0.8, -0.8], abs=1e-12)
    both = {"travel_time": 0.04, "hysteresis": 0.2}  # it moves at its speed to where it sticks
    assert reached(1.0, 0.0, **both) == pytest.approx(5e-4 / 0.04, rel=1e-12)
    assert reached(0.1, 0.0, **both) == 0.0
    assert reached(0.5, 0.0, PULSE, hysteresis=0.2) == 1.0  # valves that pulse do not stick
    assert reached(0.0, 1.0, PULSE, hysteresis=0.2) == 0.0


def hose(**valve):
    return SimpleNamespace(
        valve=SimpleNamespace(**{"tube_resistance": 0.0, "tube_friction": 0.0} | valve),
        chamber=SimpleNamespace(temperature=AIR[2]),
    )


@pytest.mark.parametrize("step", [1e-5, 5e-4, 0.1])
def test_a_step_of_the_tube_is_the_solution_and_loses_no_air(step):
    volume, resistance, chamber, before = 6e-6, 8e7, 3e5, 2.6e5
    tube = hose(tube_resistance=resistance, tube_volume=volume)
    for inflow in (-2e-4, 0.0, 3e-4):

        def rate(_, state, inflow=inflow):
            out = (state[0] - chamber) / resistance
            return [GAS_CONSTANT * AIR[2] / volume * (inflow - out), out]

        found = solve_ivp(rate, (0.0, step), [before, 0.0], rtol=1e-11, atol=1e-13, method="LSODA")
        after, out = tube_step(tube, before, chamber, inflow, step)
        assert after == pytest.approx(found.y[0, -1], rel=1e-9)
        assert out * step == pytest.approx(found.y[1, -1], rel=1e-6, abs=1e-16)


@pytest.mark.parametrize("resistance", [0.0, 8e7])
@pytest.mark.parametrize("inflow", [-2e-3, -1e-4, 0.0, 3e-3])
def test_flow_through_a_turbulent_tube_is_the_solution_and_overshoots_at_no_step(
    resistance, inflow
):
    volume, friction, chamber, before = 6e-6, 4e11, 3e5, 3.4e5
    tube = hose(tube_resistance=resistance, tube_friction=friction, tube_volume=volume)
    per_mass = GAS_CONSTANT * AIR[2]

    def lost(flow, pressure):
        density = 0.5 * (pressure + chamber) / per_mass
        return resistance * flow + friction * flow * abs(flow) / density

    def rate(_, state):
        difference = state[0] - chamber
        out = brentq(lambda flow: lost(flow, state[0]) - difference, -1.0, 1.0, xtol=1e-15)
        return [per_mass / volume * (inflow - out), out]

    span, steps = 0.004, 4000
    found = solve_ivp(rate, (0.0, span), [before, 0.0], rtol=1e-9, atol=1e-12, method="LSODA")
    pressure, out = before, 0.0
    for _ in range(steps):
        pressure, flow = tube_step(tube, pressure, chamber, inflow, span / steps)
        out += flow * span / steps
    assert pressure == pytest.approx(found.y[0, -1], rel=1e-4)
    assert out == pytest.approx(found.y[1, -1], rel=5e-3, abs=1e-9)
    kept = inflow * span - out  # no air is lost
    assert kept == pytest.approx(volume * (pressure - before) / per_mass, abs=1e-15)
    for step in (1e-3, 0.1, 10.0):
        after, _ = tube_step(tube, before, chamber, inflow, step)
        level = chamber + lost(inflow, before)
        assert min(before, level) <= after <= max(before, level)
    assert after == pytest.approx(level, rel=1e-9)


@pytest.mark.parametrize("dead_zone", [0.0, 0.3])
def test_small_errors_decay_with_the_stated_time_constant_of_the_regulator(dead_zone):
    """What a dead zone leaves alone is left; the rest decays, and the faster for it."""
    muscle = make(command="pressure_set", **LASTING)  # on a rigid chain it stays where it is
    valve = dataclasses.replace(
        PLAIN_VALVE,
        regulator_dead_band=0.0,
        conductance_exhaust=muscle.valve.conductance_fill,
        dead_zone=dead_zone,
        dead_zone_asymmetry=0.0,
        critical_ratio=0.6,  # at half the supply the flow is still choked, as the bound assumes
    )
    nominal = dataclasses.replace(muscle.mounting, length_at_zero=muscle.braid.nominal_length)
    muscle = dataclasses.replace(muscle, valve=valve, mounting=nominal)
    row, target = pack(muscle).tolist(), 2e5

    def rate(time, state):
        rates = [0.0] * len(state)
        kernel.state_rates(row, state.tolist(), rates, 0.0, 0.0, target, time, 1e-3)
        return rates

    kept = dead_zone * valve.regulator_band
    start = rest_state.charged_air_state(row, [], 0.0, target - kept - 1e3)
    span = (0.0, regulator_time_constant(muscle))
    found = solve_ivp(rate, span, [*[0.0] * (COMMON - 1), start], rtol=1e-9, atol=1e-9)
    left = target - kept - gauge_pressure(row, found.y[:, -1].tolist(), 0.0)
    assert left == pytest.approx(1e3 / math.e, rel=0.05)
