"""The pair of valves and the three ways to drive it."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.core.parameters import specs
from pamsim.physics.air import mass_flow
from pamsim.physics.muscle_valves import flow_through_valves, wanted_opening
from pamsim.physics.valves import (
    PRESSURE_SET,
    PULSE,
    VALVE,
    ValvePair,
    clamped_opening,
    past_dead_zone,
)
from tests.unit.core.refusals import cases

SUPPLY, EXHAUST = 701325.0, 101325.0
FILL, VENT = 6e-9, 9e-9
AIR = (0.3, 0.999, 293.15)  # critical ratio, laminar ratio, temperature [K]
GRID = 1000
PERIOD = 0.02


def made(command: float = VALVE, **changes: float) -> SimpleNamespace:
    """Parameters of valves on a chamber, with a command."""
    valve = ValvePair(
        **{
            "conductance_fill": FILL,
            "conductance_exhaust": VENT,
            "critical_ratio": AIR[0],
            "laminar_ratio": AIR[1],
            "supply_pressure": SUPPLY - EXHAUST,
            "pulse_period": PERIOD,
            **changes,
        }
    )
    chamber = SimpleNamespace(atmosphere=EXHAUST, temperature=AIR[2])
    return SimpleNamespace(command=command, valve=valve, chamber=chamber)


def flow(opening: float, chamber: float) -> float:
    return flow_through_valves(made(), chamber, opening, 0.0)


def pulsed_opening(duty: float, time: float) -> float:
    return wanted_opening(made(PULSE), duty, 0.0, time)


def regulated_opening(set_point: float, pressure: float, band: float, dead_band: float) -> float:
    m = made(PRESSURE_SET, regulator_band=band, regulator_dead_band=dead_band)
    return wanted_opening(m, set_point, pressure, 0.0)


def test_a_regulator_keeps_to_its_least_set_point_where_a_lower_one_is_sent():
    m = made(PRESSURE_SET, regulator_band=1e5, least_set_point=3e4)
    for pressure in (0.0, 2e4, 8e4):
        least = wanted_opening(m, 3e4, pressure, 0.0)
        assert wanted_opening(m, 1e4, pressure, 0.0) == wanted_opening(m, -5e3, pressure, 0.0)
        assert (
            wanted_opening(m, 1e4, pressure, 0.0) == least == pytest.approx((3e4 - pressure) / 1e5)
        )
    assert wanted_opening(m, 4e4, 2e4, 0.0) == pytest.approx(0.2)
    assert regulated_opening(-5e3, 0.0, 1e5, 0.0) == pytest.approx(-0.05)  # into vacuum, without it


def past(opening: float, zone: float, asymmetry: float) -> float:
    return past_dead_zone(made(dead_zone=zone, dead_zone_asymmetry=asymmetry).valve, opening)


def test_clamp_keeps_what_is_inside_and_stops_at_fully_open():
    for command in np.linspace(-3.0, 3.0, 121).tolist():
        assert clamped_opening(command) == min(max(command, -1.0), 1.0)
    assert clamped_opening(math.inf) == 1.0
    assert clamped_opening(-math.inf) == -1.0


WITH_NAN = {
    "clamp": lambda: clamped_opening(math.nan),
    "pulse": lambda: pulsed_opening(math.nan, 0.001),
    "set point": lambda: regulated_opening(math.nan, 1e5, 1e4, 0.0),
    "least set point": lambda: wanted_opening(
        made(PRESSURE_SET, least_set_point=1e4), math.nan, 1e5, 0.0
    ),
    "pressure": lambda: regulated_opening(1e5, math.nan, 1e4, 5e3),
    "dead zone": lambda: past(math.nan, 0.1, 0.0),
    "opening": lambda: flow(math.nan, 3e5),
    "chamber, filling": lambda: flow(0.5, math.nan),
    "chamber, venting": lambda: flow(-0.5, math.nan),
}


@pytest.mark.parametrize("evaluate", cases(WITH_NAN))
def test_nan_is_not_hidden(evaluate):
    assert math.isnan(evaluate())


@pytest.mark.parametrize("duty", [0.0, 0.001, 0.25, 1.0 / 3.0, 0.9995, 1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("periods_before", [0, 7])
def test_pulses_have_the_duty_for_their_mean(duty, sign, periods_before):
    times = PERIOD * (periods_before + (np.arange(GRID) + 0.5) / GRID)
    openings = np.array([pulsed_opening(sign * duty, float(t)) for t in times])
    assert set(openings) <= {0.0, sign}  # the sign of the duty selects the one valve
    assert abs(openings.mean() - sign * duty) <= 1.0 / GRID
    assert np.all(np.diff(np.abs(openings)) <= 0.0)  # open first, then shut


@pytest.mark.parametrize("dead_band", [0.0, 2e3])
def test_regulator_is_odd_bounded_and_continuous(dead_band):
    band = 1e4
    errors = np.linspace(-2e4, 2e4, 4001)
    openings = np.array([regulated_opening(1e5 + e, 1e5, band, dead_band) for e in errors])
    swapped = np.array([regulated_opening(1e5, 1e5 + e, band, dead_band) for e in errors])
    assert np.array_equal(openings, -swapped)
    step = errors[1] - errors[0]
    slopes = np.diff(openings)
    assert np.all(slopes >= -1e-12)
    assert np.all(slopes <= step / band + 1e-9)  # no jump anywhere, dead band's edges included
    assert openings[0] == -1.0
    assert openings[-1] == 1.0


def test_regulator_leaves_the_dead_band_alone_and_opens_fully_a_band_later():
    band, dead = 1e4, 2e3
    for error in (-dead, -0.5 * dead, 0.0, dead):
        assert regulated_opening(1e5 + error, 1e5, band, dead) == 0.0
    assert regulated_opening(1e5 + dead + 0.5 * band, 1e5, band, dead) == pytest.approx(0.5)
    assert regulated_opening(1e5 + dead + band, 1e5, band, dead) == pytest.approx(1.0)
    assert regulated_opening(1e5 - dead - 2.0 * band, 1e5, band, dead) == -1.0


@pytest.mark.parametrize("zone", [0.01, 0.2, 0.9])
def test_a_dead_zone_shuts_the_middle_and_keeps_the_ends(zone):
    """Odd, shut up to the zone, without a jump, straight, fully open at the end."""
    half = np.linspace(0.0, 1.0, 2001)
    openings = np.concatenate([-half[:0:-1], half])
    left = np.array([past(u, zone, 0.0) for u in openings.tolist()])
    assert np.array_equal(left, -left[::-1])
    assert np.all(left[np.abs(openings) <= zone] == 0.0)
    assert np.all(left[openings > zone] > 0.0)
    assert (left[0], left[-1]) == (-1.0, 1.0)
    slopes = np.diff(left) / np.diff(openings)
    assert np.all((slopes >= 0.0) & (slopes <= 1.0 / (1.0 - zone) + 1e-9))
    assert past(0.5 * (1.0 + zone), zone, 0.0) == pytest.approx(0.5, rel=1e-12)


def test_no_dead_zone_is_none_to_the_bit():
    for opening in np.random.default_rng(1).uniform(-1.0, 1.0, 200).tolist():
        for asymmetry in (-1.0, 0.0, 0.4):
            assert past(opening, 0.0, asymmetry) == opening


@pytest.mark.parametrize("asymmetry", [-1.0, -0.4, 0.3, 1.0])
def test_each_valve_has_the_dead_zone_of_its_side(asymmetry):
    """Either side is that of a symmetric zone of its own width; 1 leaves the other side none."""
    zone, openings = 0.3, np.linspace(0.0, 1.0, 501).tolist()
    for opening in openings:
        filled = past(opening, zone, asymmetry)
        assert filled == past(opening, zone * (1.0 + asymmetry), 0.0)
        vented = past(-opening, zone, asymmetry)
        assert vented == past(-opening, zone * (1.0 - asymmetry), 0.0)


def test_the_wider_zone_never_shuts_a_valve_for_good():
    assert past(1.0, 0.8, 0.9) == past(-1.0, 0.8, -0.9) * -1.0 == 1.0


@pytest.mark.parametrize("chamber", [2e4, EXHAUST, 3e5, SUPPLY, 9e5])
def test_each_valve_connects_its_own_side(chamber):
    """Shut lets nothing pass; each opening is an orifice of its own size to its own side."""
    assert flow(0.0, chamber) == 0.0
    for opening in (0.25, 1.0):
        assert flow(opening, chamber) == mass_flow(SUPPLY, chamber, opening * FILL, *AIR)
        assert flow(-opening, chamber) == mass_flow(EXHAUST, chamber, opening * VENT, *AIR)
    assert flow(1.0, chamber) * (SUPPLY - chamber) >= 0.0
    assert flow(-1.0, chamber) * (EXHAUST - chamber) >= 0.0


def test_fill_and_exhaust_may_be_as_large_as_each_other():
    limits = dict(specs(ValvePair))
    fill, exhaust = limits["conductance_fill"], limits["conductance_exhaust"]
    assert (fill.low, fill.high, fill.unit) == (exhaust.low, exhaust.high, exhaust.unit)
