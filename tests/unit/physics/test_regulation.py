"""The regulator's time constant against the closed loop of the kernel itself."""

from __future__ import annotations

import dataclasses

import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.record import COMMON, pack
from pamsim.physics.step_limits import regulator_time_constant
from tests.unit.physics.flat import gauge_pressure, kernel, rest_state
from tests.unit.physics.muscles import LASTING, PLAIN_VALVE, make


@pytest.mark.parametrize("dead_zone", [0.0, 0.3])
def test_small_errors_decay_with_the_stated_time_constant(dead_zone):
    """What a dead zone leaves alone is left; the rest decays, and the faster for it."""
    muscle = make(command="pressure_set", **LASTING)  # on a rigid chain it stays where it is
    valve = dataclasses.replace(
        PLAIN_VALVE,
        regulator_dead_band=0.0,
        conductance_exhaust=muscle.valve.conductance_fill,
        dead_zone=dead_zone,
        dead_zone_asymmetry=0.0,
    )
    # at half the supply the flow is still choked on the way in, as the bound assumes
    muscle = dataclasses.replace(
        muscle,
        valve=dataclasses.replace(valve, critical_ratio=0.6),
        mounting=dataclasses.replace(muscle.mounting, length_at_zero=muscle.braid.nominal_length),
    )
    row, target = pack(muscle).tolist(), 2e5

    def rate(time, state):
        rates = [0.0] * len(state)
        kernel.state_rates(row, state.tolist(), rates, 0.0, 0.0, target, time, 1e-3)
        return rates

    kept = dead_zone * valve.regulator_band
    start = rest_state.charged_air_state(row, [], 0.0, target - kept - 1e3)
    stated = regulator_time_constant(muscle)
    found = solve_ivp(rate, (0.0, stated), [*[0.0] * (COMMON - 1), start], rtol=1e-9, atol=1e-9)
    left = target - kept - gauge_pressure(row, found.y[:, -1].tolist(), 0.0)
    assert left == pytest.approx(1e3 / 2.718281828, rel=0.05)
