"""Flow from a supply that sags: the root of its equation, found without looking for it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from pamsim.pneumatics.orifice import mass_flow
from pamsim.pneumatics.supply import drawn_flow

RNG = np.random.default_rng(8)


def draws(count):
    for _ in range(count):
        supply = RNG.uniform(2e5, 2e6)
        far, near = RNG.uniform(0.02, 1.0), 1.0 - 10.0 ** RNG.uniform(-6.0, -1.0)
        chamber = supply * (far if RNG.random() < 0.7 else near)
        yield (
            supply,
            10.0 ** RNG.uniform(5.0, 11.0),
            chamber,
            10.0 ** RNG.uniform(-12.0, -6.0),
            RNG.uniform(0.0, 0.9),
            RNG.uniform(0.95, 0.9999),
            RNG.uniform(200.0, 400.0),
        )


def test_the_flow_is_that_of_the_pressure_it_leaves():
    """mdot = valve's flow at P_0 - R mdot, by scipy's root finder, over the parameters' ranges."""
    pieces = set()
    for supply, resistance, chamber, *orifice in draws(1500):

        def more(flow, supply=supply, resistance=resistance, chamber=chamber, orifice=orifice):
            return mass_flow(supply - resistance * flow, chamber, *orifice) - flow

        expected = brentq(more, 0.0, (supply - chamber) / resistance, xtol=1e-18, rtol=1e-14)
        found = drawn_flow(supply, resistance, chamber, *orifice)
        assert found == pytest.approx(expected, rel=1e-8)
        ratio = chamber / (supply - resistance * found)
        pieces.add(int(np.searchsorted(orifice[1:3], ratio)))
    assert pieces == {0, 1, 2}, "choked, elliptic and laminar flow"


def test_a_stiff_supply_is_a_plain_orifice_to_the_bit():
    for supply, _, chamber, *orifice in draws(300):
        assert drawn_flow(supply, 0.0, chamber, *orifice) == mass_flow(supply, chamber, *orifice)


@pytest.mark.parametrize("chamber", [1e5, 4e5, 6.5e5, 6.999e5])
def test_more_resistance_is_less_flow_and_to_first_order_at_once(chamber):
    supply, orifice = 7e5, (4e-9, 0.3, 0.999, 293.15)
    flows = [drawn_flow(supply, r, chamber, *orifice) for r in np.logspace(4.0, 10.0, 40)]
    assert np.all(np.diff(flows) < 0.0)
    stiff = mass_flow(supply, chamber, *orifice)
    small = [stiff - drawn_flow(supply, r, chamber, *orifice) for r in (1e2, 2e2)]
    assert small[1] == pytest.approx(2.0 * small[0], rel=1e-3)


def test_more_opening_never_draws_less():
    for supply, resistance, chamber, conductance, *rest in draws(200):
        flows = [
            drawn_flow(supply, resistance, chamber, u * conductance, *rest)
            for u in np.linspace(0.0, 1.0, 21).tolist()
        ]
        assert np.all(np.diff(flows) >= -1e-12 * flows[-1])


def test_flow_back_meets_the_supply_at_rest_and_nan_is_not_hidden():
    orifice = (4e-9, 0.3, 0.999, 293.15)
    assert drawn_flow(5e5, 1e9, 5e5, *orifice) == 0.0
    assert drawn_flow(5e5, 1e9, 6e5, *orifice) == mass_flow(5e5, 6e5, *orifice) < 0.0
    assert math.isnan(drawn_flow(5e5, 1e9, math.nan, *orifice))


@pytest.mark.parametrize("resistance", [3e8, 1e9])
def test_the_flow_is_found_where_a_coefficient_of_its_equation_vanishes(resistance):
    """For b > 1/2 the constant one does at P = (2 b - 1) P_0: the roots' short form is 0 / 0."""
    supply, critical = 8e5, 0.75
    chamber = (2.0 * critical - 1.0) * supply
    orifice = (8e-9, critical, 0.999, 293.15)
    found = drawn_flow(supply, resistance, chamber, *orifice)
    left = supply - resistance * found
    assert critical < chamber / left < 0.999
    assert found == pytest.approx(mass_flow(left, chamber, *orifice), rel=1e-9)
