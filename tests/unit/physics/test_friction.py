"""Friction along a tendon: it sticks, slides at its level, grows with rest, and gives no work."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.physics.chain import Chain
from pamsim.physics.friction import (
    Friction,
    bond_rate,
    dry_friction,
    rubs,
    stribeck_damping,
    stribeck_friction,
)
from pamsim.physics.record import pack
from pamsim.physics.step_limits import bristle_stiffness
from tests.unit.physics.flat import gauge_pressure, kernel
from tests.unit.physics.muscles import charged, make

STEP, PULL = 1e-3, 200.0
DAHL = Friction(coulomb_force=10.0, presliding=4e-5)
LUGRE = Friction(coulomb_force=6.0, breakaway_force=4.0, stribeck_velocity=5e-3, presliding=4e-5)
AGED = Friction(
    coulomb_force=8.0, dwell_force=4.0, dwell_time=0.3, dwell_travel=2e-4, presliding=4e-5
)
LOADED = Friction(tension_share=0.05, presliding=4e-5)
SMOOTH = Friction(stribeck_force=12.0, stribeck_velocity=4e-3)


def moved(friction, velocities, step=STEP, bonds=0.0):
    """Forces and bonds along a motion, the bonds of each step those before it."""
    forces, formed = [0.0], [bonds]
    for v in velocities:
        forces.append(dry_friction(friction, forces[-1], PULL, v, step, formed[-1]))
        formed.append(formed[-1] + step * bond_rate(friction, formed[-1], v, step))
    return np.array(forces), np.array(formed)


def test_a_step_is_the_solution_of_the_differential_equation_which_slides_at_its_level():
    """dz/dt = v - k |v| z / g(v), the force k z, as Canudas de Wit et al. write it."""
    for friction in (DAHL, LUGRE, LOADED):
        always = friction.coulomb_force + friction.tension_share * PULL
        stiffness = (always + friction.breakaway_force) / friction.presliding
        for velocity in (-2e-2, -3e-3, 1e-4, 6e-3):
            lost = math.exp(-((velocity / friction.stribeck_velocity) ** 2))
            level = always + friction.breakaway_force * lost

            def bend(_, z, v=velocity, g=level, k=stiffness):
                return v - k * abs(v) * z / g

            found = solve_ivp(bend, (0.0, STEP), [2e-5], rtol=1e-11, atol=1e-16, method="LSODA")
            after = dry_friction(friction, stiffness * 2e-5, PULL, velocity, STEP)
            assert after == pytest.approx(stiffness * found.y[0, -1], rel=1e-8), friction
            forces, _ = moved(friction, [velocity] * round(2e-3 / abs(velocity) / STEP))
            assert forces[-1] == pytest.approx(math.copysign(level, velocity), rel=1e-9)


def test_at_rest_it_keeps_its_force_to_the_bit_and_a_slack_tendon_has_none():
    for force in (-9.0, 0.3, 7.7):
        assert dry_friction(DAHL, force, PULL, 0.0, STEP) == force
        assert dry_friction(LOADED, force, 1.0, 0.0, STEP) == force
        assert dry_friction(LOADED, force, 0.0, 0.0, STEP) == 0.0
    quick = Friction(breakaway_force=1.0, stribeck_velocity=1e-5)
    assert dry_friction(quick, 3.0, PULL, 0.1, STEP) == 0.0


def test_bonds_form_at_rest_are_torn_by_sliding_and_raise_the_breakaway_force():
    """Exponentially in time (Kato et al. 1972), and exactly so in a step."""
    for velocity in (0.0, 2e-5, -3e-3):

        def rate(_, b, v=velocity):
            return (1.0 - b) / 0.3 - abs(v) * b / 2e-4

        found = solve_ivp(rate, (0.0, 0.02), [0.4], rtol=1e-11, atol=1e-14, method="LSODA")
        after_step = 0.4 + 0.02 * bond_rate(AGED, 0.4, velocity, 0.02)
        assert after_step == pytest.approx(found.y[0, -1], rel=1e-8)
    peaks = []
    for rest in (0.0, 0.1, 3.0):
        still = round(rest / STEP)
        forces, formed = moved(AGED, [0.0] * still + [2e-3] * 1000)
        assert formed[still] == pytest.approx(-math.expm1(-rest / 0.3), rel=1e-9, abs=1e-15)
        assert forces[-1] == pytest.approx(8.0 + 4.0 / (1.0 + 0.3 * 2e-3 / 2e-4), rel=1e-6)
        peaks.append(forces.max())
    assert peaks[0] < peaks[1] < peaks[2]
    assert peaks[2] - peaks[0] > 0.3
    forces, _ = moved(AGED, [1e-3] * 2000, step=1e-4, bonds=1.0)
    assert forces.max() == pytest.approx(8.0 + 0.6 * 4.0, rel=0.01)  # the share that is left


@pytest.mark.parametrize("friction", [DAHL, LUGRE, AGED], ids=["dahl", "lugre", "aged"])
def test_no_motion_gets_work_out_of_it(friction):
    """Force times travel covers what is stored in the bristles, at every instant."""
    rng = np.random.default_rng(6)
    velocities = np.repeat(rng.normal(0.0, 8e-3, 400) * (rng.uniform(size=400) > 0.3), 5)
    forces, _ = moved(friction, velocities.tolist(), step=1e-4)
    level = friction.coulomb_force + friction.breakaway_force + friction.dwell_force
    stored = 0.5 * forces**2 / (level / friction.presliding)
    lost = np.cumsum(forces[1:] * velocities * 1e-4) - stored[1:]
    assert np.diff(lost).min() > -1e-12
    assert lost[-1] > 5.0 * stored.max()
    assert np.abs(forces).max() <= level


def test_the_stated_stiffness_is_the_slope_at_rest():
    tiny = 1e-12
    for friction in (DAHL, LUGRE, AGED):
        slope = dry_friction(friction, 0.0, PULL, tiny / STEP, STEP) / tiny
        stated = bristle_stiffness(make(friction=friction), 0.19, 3e5)
        assert stated == pytest.approx(slope, rel=1e-5)
    assert bristle_stiffness(make(friction=Friction()), 0.19, 3e5) == 0.0
    assert bristle_stiffness(make(friction=LOADED), 0.19, 3e5) > 0.0


def test_smooth_friction_is_odd_brakes_always_and_is_largest_at_its_speed():
    speeds = np.linspace(-0.012, 0.012, 24001)
    found = np.array([stribeck_friction(SMOOTH, v) for v in speeds.tolist()])
    assert np.all(found * speeds >= 0.0)
    assert found == pytest.approx(-found[::-1], abs=1e-12)
    assert abs(speeds[np.argmax(found)]) == pytest.approx(4e-3, rel=1e-5)
    assert found.max() == pytest.approx(12.0, rel=1e-9)
    assert stribeck_friction(SMOOTH, 0.1) < 1e-10
    assert np.gradient(found, speeds).max() == pytest.approx(stribeck_damping(SMOOTH), rel=1e-6)


def test_the_tendon_feels_it_both_ways_and_the_muscle_s_tension_does_not():
    muscle = make("six_parameter", friction=SMOOTH)
    row = pack(muscle)
    for tendon, pressure, taut in ((0.19, 3e5, True), (0.12, 0.0, False)):
        act = charged(muscle, tendon, pressure)
        tension = kernel.tension(row, act, tendon)
        assert (tension > 50.0) == taut
        for speed in (-8e-3, -1e-3, 0.0, 2e-3):
            felt = kernel.tendon_force(row, act, tension, tendon, speed, 5e-4)
            braked = stribeck_friction(muscle.friction, speed)
            assert felt == pytest.approx(tension + braked, rel=1e-14)


def test_any_of_its_forces_alone_is_friction_and_all_but_the_smooth_one_stick():
    for field, acts, sticks in (
        ("presliding", False, False),
        ("stribeck_force", True, False),
        ("coulomb_force", True, True),
        ("breakaway_force", True, True),
        ("dwell_force", True, True),
        ("tension_share", True, True),
    ):
        friction = Friction(**{field: 2e-2 if field != "presliding" else 1e-5})
        assert (friction.acts, rubs(friction)) == (acts, sticks), field


def test_a_rubbing_braid_pulls_less_while_it_shortens_and_the_more_the_higher_the_pressure():
    base = make("six_parameter", chain=Chain(), friction=Friction())
    muscle = dataclasses.replace(base, braid=dataclasses.replace(base.braid, friction=1e-3))
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 3e5)
    still, pressure = kernel.tension(row, act, 0.19), gauge_pressure(row, act, 0.19)
    for speed in (-0.02, 0.03):
        rate = -speed / muscle.braid.nominal_length
        moving = kernel.tension(row, act, 0.19, speed)
        assert moving == pytest.approx(still - 1e-3 * pressure * rate, rel=1e-12)
        assert (moving > still) == (speed > 0.0)
    slack = charged(muscle, 0.12, 0.0)
    assert kernel.tension(row, slack, 0.12, -1.0) == 0.0
