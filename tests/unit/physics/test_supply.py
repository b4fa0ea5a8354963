"""Sag of a supply that several valves share: the root of its equation, found by scipy as well."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from pamsim.physics import supply
from pamsim.physics.air import GAS_CONSTANT, mass_flow

ORIFICE = (4e-9, 0.3, 0.999, 293.15)
SHUT = (7e5, 1e5, 0.0, *ORIFICE[1:])


def supply_sag(valves, resistance, square=0.0, storage=0.0, before=0.0):
    """The sag behind a line whose volume stores so much per pressure in a time step."""
    valve = {"supply_resistance": resistance, "supply_square": square, "supply_volume": storage}
    m = SimpleNamespace(
        valve=SimpleNamespace(supply_pressure=1.0, **valve),
        chamber=SimpleNamespace(atmosphere=0.0, temperature=1.0),
    )
    return supply.supply_sag(m, SimpleNamespace(sag=before), valves, 1.0 / GAS_CONSTANT)


def drawn(sag, valves):
    return sum(mass_flow(source - sag, *rest) for source, *rest in valves)


def random_supply(rng):
    """Valves, resistance, storage and sag before, over the ranges that parameters may have."""
    source = rng.uniform(2e5, 2e6)
    valves = []
    for _ in range(rng.integers(1, 5)):
        far, near = rng.uniform(0.02, 1.3), 1.0 - 10.0 ** rng.uniform(-6.0, -1.0)
        valves.append(
            (
                source,
                source * (far if rng.random() < 0.7 else near),
                10.0 ** rng.uniform(-12.0, -6.0) * (rng.random() < 0.8),
                rng.uniform(0.0, 0.9),
                rng.uniform(0.95, 0.9999),
                rng.uniform(200.0, 400.0),
            )
        )
    storage = 10.0 ** rng.uniform(-16.0, -2.0) if rng.random() < 0.6 else 0.0
    return valves, 10.0 ** rng.uniform(3.0, 11.0), storage, rng.uniform(-0.2, 0.9) * source


@pytest.mark.parametrize("turbulent", [False, True])
def test_source_and_storage_give_what_the_valves_pass_in_hundreds_of_stiff_cases(turbulent):
    """s = R q + S q |q|, the flow q that which the valves pass and the line is short of."""
    rng, directions = np.random.default_rng(8), set()
    for _ in range(400):
        valves, resistance, storage, before = random_supply(rng)
        square = 10.0 ** rng.uniform(6.0, 16.0) if turbulent else 0.0
        if turbulent:
            resistance *= rng.random() < 0.5

        def short(sag, valves=valves, given=(resistance, square, storage, before)):
            r, s, c, s_0 = given
            root = r + math.sqrt(r * r + 4.0 * s * abs(sag))
            return (2.0 * sag / root if sag else 0.0) + c * (sag - s_0) - drawn(sag, valves)

        ends = [0.0, before, *(v[0] - v[1] for v in valves)]
        expected = brentq(short, min(ends) - 1.0, max(ends) + 1.0, xtol=1e-9, rtol=1e-14)
        found = supply_sag(valves, resistance, square, storage, before)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-7)
        directions |= {(v[1] > v[0] - found) for v in valves if v[2] > 0.0}
    assert directions == {True, False}, "air flows into muscles and out of them"


def test_a_line_on_shut_valves_refills():
    """Without turbulence as an implicit lag; with it C (s_0 - s) = sqrt(s / S)."""
    for valves in ([], [SHUT]):
        found = supply_sag(valves, 1e8, 0.0, 3e-8, 4e4)
        assert found == pytest.approx(4e4 / (1.0 + 1.0 / (1e8 * 3e-8)), rel=1e-15)
        assert supply_sag(valves, 1e8, 0.0, 0.0, 4e4) == 0.0
    rng = np.random.default_rng(9)
    for _ in range(1000):
        square, storage = 10.0 ** rng.uniform(6.0, 16.0), 10.0 ** rng.uniform(-16.0, -4.0)
        before = 10.0 ** rng.uniform(-6.0, 5.7)
        root, kept = square**-0.5, storage * before
        left = (2.0 * kept / (root + math.sqrt(root**2 + 4.0 * storage * kept))) ** 2
        for sign in (1.0, -1.0):
            sag = supply_sag([SHUT], 0.0, square, storage, sign * before)
            assert sag == pytest.approx(sign * left, rel=1e-9, abs=1e-12 * before)


@pytest.mark.parametrize("fraction", [1e-3, 1.0, 1e3])
def test_a_search_ends_where_no_number_is_left_between_its_ends(fraction):
    """A tolerance of what a line without turbulence would keep is finer than the numbers."""
    barely = (7e5, 7e5 * (1.0 - 1e-15), 1e-20, *ORIFICE[1:])
    for k in range(200):
        before = 4.9e5 * (1.0 - 1e-4 * k)
        for valves in ([], [SHUT], [SHUT, barely]):
            sag = supply_sag(valves, 546.7 * fraction, 2.46e7 * fraction, 7.77e-7, before)
            assert 0.0 < sag < before


def test_at_equal_pressures_nothing_flows_and_what_is_impossible_is_not_hidden():
    assert supply_sag([(7e5, 7e5, *ORIFICE)], 1e9) == 0.0
    good = (7e5, 1e5, *ORIFICE)
    for bad in ((7e5, math.nan, *ORIFICE), (7e5, 1e5, math.nan, *ORIFICE[1:])):
        assert math.isnan(supply_sag([bad], 1e9))
        assert math.isnan(supply_sag([good, bad], 1e9, 0.0, 1e-9))
    assert math.isnan(supply_sag([good], 1e9, 0.0, 1e-9, math.nan))
    for diverged in (1e300, math.inf):
        sag = supply_sag([(7e5, diverged, *ORIFICE), good], 1e9)
        assert math.isnan(sag) or sag < 0.0
