"""Air in a chamber: the equation its algebraic state stands for, heat, and leaks."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.physics.chamber import Chamber, absolute_pressure, air_state, relaxing_rate
from pamsim.physics.muscle_valves import cross_flow, leak_flow
from pamsim.physics.record import parameters
from tests.unit.physics.muscles import LASTING, make

GAP = 2e-10


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


def leaking(**changes: float):
    air = dataclasses.replace(make(**LASTING).chamber, **changes)
    return parameters(make(**(LASTING | {"chamber": air})))


def test_what_one_muscle_loses_to_the_other_that_one_gains():
    one = leaking(cross_leak_conductance=GAP, temperature=290.0)
    other = leaking(cross_leak_conductance=0.0, temperature=310.0)
    for inside, beyond in ((5e5, 2e5), (1e5, 6e5), (3e5, 3e5)):
        assert cross_flow(one, other, inside, beyond) == -cross_flow(other, one, beyond, inside)
    assert cross_flow(one, other, 3e5, 3e5) == 0.0
    assert cross_flow(other, other, 5e5, 2e5) == 0.0
    # To a muscle at the atmosphere it is a leak to the atmosphere, with the means of both.
    alone = leaking(laminar_leak_conductance=0.5 * GAP, temperature=300.0)
    found = cross_flow(one, other, 4e5, one.chamber.atmosphere)
    assert found == pytest.approx(-leak_flow(alone, 4e5), rel=1e-13)
