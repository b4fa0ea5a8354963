"""Dry friction along a tendon: it sticks, slides at its level, and gives no work."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.friction import Friction, bond_rate, dry_friction
from pamsim.physics.step_limits import bristle_stiffness
from tests.unit.physics.muscles import make

STEP = 1e-3
DAHL = Friction(coulomb_force=10.0, presliding=4e-5)
LUGRE = Friction(coulomb_force=6.0, breakaway_force=4.0, stribeck_velocity=5e-3, presliding=4e-5)
AGED = Friction(
    coulomb_force=8.0, dwell_force=4.0, dwell_time=0.3, dwell_travel=2e-4, presliding=4e-5
)
LOADED = Friction(tension_share=0.05, presliding=4e-5)


def after(force, velocity, friction=DAHL, tension=200.0, step=STEP):
    return dry_friction(friction, force, tension, velocity, step)


def moved(friction, velocities, step=STEP, tension=200.0):
    forces = [0.0]
    for velocity in velocities:
        forces.append(after(forces[-1], velocity, friction, tension, step))
    return np.array(forces)


@pytest.mark.parametrize("friction", [DAHL, LUGRE, LOADED])
def test_a_step_is_the_solution_of_the_differential_equation(friction):
    """dz/dt = v - k |v| z / g(v), the force k z, as Canudas de Wit et al. write it."""
    always = friction.coulomb_force + friction.tension_share * 200.0
    stiffness = (always + friction.breakaway_force) / friction.presliding
    for velocity in (-2e-2, -3e-3, 1e-4, 6e-3):
        lost = math.exp(-((velocity / friction.stribeck_velocity) ** 2))
        level = always + friction.breakaway_force * lost

        def bend(_, z, v=velocity, g=level):
            return v - stiffness * abs(v) * z / g

        found = solve_ivp(bend, (0.0, STEP), [2e-5], rtol=1e-11, atol=1e-16, method="LSODA")
        expected = stiffness * found.y[0, -1]
        assert after(stiffness * 2e-5, velocity, friction) == pytest.approx(expected, rel=1e-8)


def bonded(friction, velocities, step=STEP, bonds=0.0):
    """Forces and bonds along a motion, the bonds of each step those before it."""
    forces, formed = [0.0], [bonds]
    for v in velocities:
        forces.append(dry_friction(friction, forces[-1], 200.0, v, step, formed[-1]))
        formed.append(formed[-1] + step * bond_rate(friction, formed[-1], v, step))
    return np.array(forces), np.array(formed)


def test_the_breakaway_force_grows_with_the_time_of_rest_and_sliding_forgets_the_rest():
    """Bonds form exponentially at rest (Kato et al. 1972)."""
    peaks = []
    for rest in (0.0, 0.1, 0.3, 3.0):
        still = round(rest / STEP)
        forces, formed = bonded(AGED, [0.0] * still + [2e-3] * 1000)
        assert formed[still] == pytest.approx(-math.expm1(-rest / 0.3), rel=1e-9, abs=1e-15)
        assert forces[-1] == pytest.approx(8.0 + 4.0 / (1.0 + 0.3 * 2e-3 / 2e-4), rel=1e-6)
        peaks.append(forces.max())
    assert peaks == sorted(peaks)
    assert peaks[-1] - peaks[0] > 0.3


def test_as_much_of_the_bonds_as_is_stated_is_left_when_the_joint_breaks_loose():
    forces, _ = bonded(AGED, [1e-3] * 2000, step=1e-4, bonds=1.0)
    assert forces.max() == pytest.approx(8.0 + 0.6 * 4.0, rel=0.01)


def test_bonds_are_the_solution_of_their_differential_equation():
    for velocity in (0.0, 2e-5, -3e-3):

        def rate(_, b, v=velocity):
            return (1.0 - b) / 0.3 - abs(v) * b / 2e-4

        found = solve_ivp(rate, (0.0, 0.02), [0.4], rtol=1e-11, atol=1e-14, method="LSODA")
        after_step = 0.4 + 0.02 * bond_rate(AGED, 0.4, velocity, 0.02)
        assert after_step == pytest.approx(found.y[0, -1], rel=1e-8)


def test_friction_that_ages_gives_no_work_either():
    rng = np.random.default_rng(6)
    velocities = np.repeat(rng.normal(0.0, 8e-3, 400) * (rng.uniform(size=400) > 0.5), 5)
    forces, formed = bonded(AGED, velocities.tolist(), step=1e-4)
    stored = 0.5 * forces**2 / (12.0 / 4e-5)
    lost = np.cumsum(forces[1:] * velocities * 1e-4) - stored[1:]
    assert np.diff(lost).min() > -1e-12
    assert np.ptp(formed) > 0.0
    assert np.abs(forces).max() <= 12.0


@pytest.mark.parametrize("friction", [DAHL, LUGRE, LOADED])
def test_it_slides_at_its_level_against_the_motion(friction):
    always = friction.coulomb_force + friction.tension_share * 200.0
    for velocity in (-0.05, -2e-3, 2e-3, 0.05):
        lost = math.exp(-((velocity / friction.stribeck_velocity) ** 2))
        level = always + friction.breakaway_force * lost
        forces = moved(friction, [velocity] * 600)
        assert forces[-1] == pytest.approx(math.copysign(level, velocity), rel=1e-9)


def test_at_rest_it_keeps_its_force_to_the_bit_and_a_slack_tendon_has_none():
    for force in (-9.0, 0.3, 7.7):
        assert after(force, 0.0) == force
        assert after(force, 0.0, LOADED, tension=1.0) == force
        assert after(force, 0.0, LOADED, tension=0.0) == 0.0
    assert after(3.0, 0.1, Friction(breakaway_force=1.0, stribeck_velocity=1e-5)) == 0.0


@pytest.mark.parametrize("friction", [DAHL, LUGRE])
def test_no_motion_gets_work_out_of_it(friction):
    """Force times travel covers what is stored in the bristles, at every instant."""
    rng = np.random.default_rng(4)
    velocities = np.repeat(rng.normal(0.0, 8e-3, 400), 5)
    forces = moved(friction, velocities.tolist(), step=1e-4)
    stiffness = (friction.coulomb_force + friction.breakaway_force) / friction.presliding
    stored = 0.5 * forces**2 / stiffness
    work = np.cumsum(forces[1:] * velocities * 1e-4)
    lost = work - stored[1:]
    assert np.diff(lost).min() > -1e-12
    assert lost[-1] > 5.0 * stored.max()
    level = friction.coulomb_force + friction.breakaway_force
    assert np.abs(forces).max() <= level


def test_the_same_travel_gives_the_same_force_at_any_speed_without_stribeck_s_effect():
    path = [3e-6, -8e-6, 2e-5, -5e-6]
    slow = moved(DAHL, [d / 100 / STEP for d in path for _ in range(100)])
    fast = moved(DAHL, [d / STEP for d in path])
    assert slow[::100] == pytest.approx(fast, rel=1e-10)


@pytest.mark.parametrize("tuned", [0.0, 4e-3])
def test_an_arm_on_its_bristles_does_not_gain_energy(tuned):
    """The engine's order of a step: force of the new bristles, then speed, then travel."""
    mass, step, stiff = 2.0, 5e-4, DAHL.coulomb_force / DAHL.presliding
    force, speed, peaks = 0.0, 1e-5, []
    for _ in range(40_000):
        bent = after(force, speed, step=step)
        speed -= step / mass * (bent + tuned * (bent - force) / step)
        force = bent
        peaks.append(0.5 * mass * speed**2 + 0.5 * force**2 / stiff)
    assert max(peaks[30_000:]) < (1e-3 if tuned else 0.95) * max(peaks[:1_000])


def test_the_stated_stiffness_is_the_slope_at_rest():
    tiny = 1e-12
    for friction in (DAHL, LUGRE, AGED):
        muscle = make(friction=friction)
        slope = after(0.0, tiny / STEP, friction) / tiny
        assert bristle_stiffness(muscle, 0.19, 3e5) == pytest.approx(slope, rel=1e-5)
    assert bristle_stiffness(make(friction=Friction()), 0.19, 3e5) == 0.0
    assert bristle_stiffness(make(friction=LOADED), 0.19, 3e5) > 0.0
