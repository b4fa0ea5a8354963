"""Friction that is highest while the arm creeps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from pamsim.physics.friction import Friction, rubs, stribeck_damping, stribeck_friction
from pamsim.physics.record import pack
from tests.unit.physics.flat import kernel
from tests.unit.physics.muscles import charged, make

FORCE, SPEED = 12.0, 4e-3
PEAK = Friction(stribeck_force=FORCE, stribeck_velocity=SPEED)
STEP = 5e-4
SMOOTH = Friction(stribeck_force=9.0, stribeck_velocity=3e-3)


def test_it_is_odd_brakes_always_and_peaks_at_its_speed():
    speeds = np.linspace(-0.1, 0.1, 2001)
    found = np.array([stribeck_friction(PEAK, v) for v in speeds.tolist()])
    assert np.all(found * speeds >= 0.0)
    assert found == pytest.approx(-found[::-1], abs=1e-12)
    peak = minimize_scalar(
        lambda v: -stribeck_friction(PEAK, v),
        bounds=(0.0, 10.0 * SPEED),
        method="bounded",
        options={"xatol": 1e-9},
    )
    assert peak.x == pytest.approx(SPEED, rel=1e-5)
    assert -peak.fun == pytest.approx(FORCE, rel=1e-9)
    assert stribeck_friction(PEAK, 8.0 * SPEED) < 1e-10 * FORCE


def test_the_stated_damping_is_the_largest_slope():
    speeds = np.linspace(-3.0 * SPEED, 3.0 * SPEED, 60001)
    found = np.array([stribeck_friction(PEAK, v) for v in speeds.tolist()])
    assert np.gradient(found, speeds).max() == pytest.approx(stribeck_damping(PEAK), rel=1e-6)


def test_the_tendon_feels_it_both_ways_and_the_muscle_s_tension_does_not():
    muscle = make("six_parameter", friction=SMOOTH)
    row, act = pack(muscle), charged(muscle, 0.19, 3e5)
    tension = kernel.tension(row, act, 0.19)
    assert tension > 50.0
    for speed in (-8e-3, -1e-3, 0.0, 2e-3):
        braked = stribeck_friction(muscle.friction, speed)
        assert kernel.tendon_force(row, act, tension, 0.19, speed, STEP) == pytest.approx(
            tension + braked, rel=1e-14
        )
    slack = charged(muscle, 0.12, 0.0)
    assert kernel.tension(row, slack, 0.12) == 0.0
    assert (
        kernel.tendon_force(row, slack, 0.0, 0.12, -2e-3, STEP)
        < 0.0
        < kernel.tendon_force(row, slack, 0.0, 0.12, 2e-3, STEP)
    )


@pytest.mark.parametrize(
    ("forces", "acts", "sticks"),
    [
        ({}, False, False),
        ({"stribeck_force": 9.0}, True, False),
        ({"coulomb_force": 9.0}, True, True),
        ({"breakaway_force": 9.0}, True, True),
        ({"dwell_force": 9.0}, True, True),
        ({"tension_share": 0.02}, True, True),
    ],
)
def test_any_of_its_forces_alone_is_friction_and_all_but_the_smooth_one_stick(forces, acts, sticks):
    friction = Friction(**forces)
    assert (friction.acts, rubs(friction)) == (acts, sticks)
