"""The passive spring: what its four parameters mean, on either side of the slack point."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pamsim.physics.force_laws.force_law import coefficients_of
from pamsim.physics.passive import PassiveSpring, locking_force, tube_energy_and_slope, tube_force

SPRINGS = [
    (9237.0, 32.9, 0.0013, 24.6),
    (24000.0, 85.8, -0.0336, 0.0),
    (500.0, 0.1, 0.2, 3.0),
    (3e4, 5.0, 0.0, 200.0),
]
EACH = pytest.mark.parametrize("spring", SPRINGS)
LOCKING = pytest.mark.parametrize("spring", [spring for spring in SPRINGS if spring[3] > 0.0])


def spring_force(
    contraction: float, stiffness: float, softening: float, slack: float, locking: float
) -> float:
    """Tube and locking of an unpressurised muscle, for which both know the same contraction."""
    spring = PassiveSpring(
        stiffness=stiffness, softening=softening, slack_contraction=slack, locking=locking
    )
    return tube_force(spring, contraction) + locking_force(spring, contraction)


def stretched(stretch: float, spring: tuple[float, ...]) -> float:
    """Force at a stretch beyond the slack point."""
    return spring_force(spring[2] - stretch, *spring)


@EACH
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_free_at_the_slack_point_with_the_stated_stiffness_on_both_sides(spring, side):
    stiffness, softening, slack, locking = spring
    assert spring_force(slack, *spring) == 0.0
    d = side * 1e-4 / max(softening, locking)
    slope = (4.0 * stretched(d, spring) - stretched(2.0 * d, spring)) / (2.0 * d)
    assert slope == pytest.approx(stiffness, rel=1e-7)


@EACH
def test_contracted_it_lets_go_by_e_per_one_over_h(spring):
    """Its distance from -k/h falls to an e-th per 1/h of contraction, locking or not."""
    stiffness, softening, _, _ = spring
    floor = stiffness / softening
    for slackened in (0.0, 0.3, 2.0, 5.0):
        left = stretched(-slackened / softening, spring) + floor
        assert left == pytest.approx(floor * math.exp(-slackened), rel=1e-11)


@EACH
def test_falls_with_contraction_and_resists_with_k_over_h_at_most(spring):
    stiffness, softening, slack, locking = spring
    stretches = np.linspace(3.0, 0.0, 101)[:-1] / max(locking, 1.0)
    contractions = np.concatenate(
        [slack - stretches, slack + np.linspace(0.0, 20, 101) / softening]
    )
    forces = np.array([spring_force(float(k), *spring) for k in contractions])
    assert np.all(np.diff(forces) < 0.0)
    assert np.all(forces > -stiffness / softening)
    assert forces[-1] == pytest.approx(-stiffness / softening, rel=1e-8)


@LOCKING
@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.9, 0.9499])
def test_stretched_it_is_the_finitely_extensible_spring(spring, share):
    """Warner 1972: F (1 - (x/x_lock)^2) = k x."""
    stretch = share / spring[3]
    left = stretched(stretch, spring) * (1.0 - share) * (1.0 + share)
    assert left == pytest.approx(spring[0] * stretch, rel=1e-9)


@LOCKING
def test_it_locks_towards_the_locking_stretch(spring):
    """At 95 % of it the force is ten times, the stiffness 200 times that of a free spring."""
    stiffness, _, _, locking = spring
    edge, d = 0.95 / locking, 1e-5 / locking
    assert stretched(edge, spring) / (stiffness * edge) == pytest.approx(1.0 / 0.0975, rel=1e-9)
    before = 3.0 * stretched(edge, spring) - 4.0 * stretched(edge - d, spring)
    slope = (before + stretched(edge - 2.0 * d, spring)) / (2.0 * d)
    assert slope / stiffness == pytest.approx(1.9025 / 0.0975**2, rel=1e-5)


@LOCKING
def test_beyond_that_it_goes_on_straight_without_a_corner(spring):
    """Continuous in force and slope at 95 %, and finite at and beyond the locking stretch."""
    locking = spring[3]
    edge, d = 0.95 / locking, 1e-7 / locking
    at = stretched(edge, spring)
    assert stretched(edge - d, spring) == pytest.approx(at, rel=1e-5)
    assert stretched(edge + d, spring) == pytest.approx(at, rel=1e-5)
    slope = spring[0] * (1.0 + 0.95**2) / (1.0 - 0.95**2) ** 2
    for share in (0.9501, 1.0, 1.7, 20.0):
        tangent = at + slope * (share - 0.95) / locking
        assert stretched(share / locking, spring) == pytest.approx(tangent, rel=1e-9)


@EACH
def test_a_braid_that_never_locks_is_linear_to_the_bit(spring):
    stiffness, softening, slack, _ = spring
    for contraction in np.linspace(slack - 1.0, slack, 57).tolist():
        force = spring_force(contraction, stiffness, softening, slack, 0.0)
        assert force.hex() == (stiffness * (slack - contraction)).hex()


@EACH
def test_locking_does_not_touch_the_contracted_side(spring):
    for contraction in np.linspace(spring[2], spring[2] + 0.4, 57).tolist():
        free = spring_force(contraction, *spring[:3], 0.0)
        assert spring_force(contraction, *spring).hex() == free.hex()


def test_default_spring_is_no_spring():
    for contraction in (-0.3, 0.0, 0.25):
        assert spring_force(contraction, *coefficients_of(PassiveSpring())[:4]) == 0.0
        assert tube_force(PassiveSpring(), contraction) == 0.0


def test_a_parallel_spring_pulls_as_it_pushes_and_is_twice_as_strong_at_its_stretch():
    straight = PassiveSpring(parallel=3e3, slack_contraction=0.01)
    hard = dataclasses.replace(straight, hardening=50.0)
    for stretch in (1e-4, 0.02, 0.3):
        pulled, pushed = (tube_force(hard, 0.01 - x) for x in (stretch, -stretch))
        assert pulled == pytest.approx(-pushed, rel=1e-12)
        linear = tube_force(straight, 0.01 - stretch)
        assert linear == pytest.approx(3e3 * stretch, rel=1e-9)
        assert pulled == pytest.approx(linear * (1.0 + (stretch / 0.02) ** 2), rel=1e-9)


@pytest.mark.parametrize("parallel", [0.0, 3e3, -2e3])
@pytest.mark.parametrize("contraction", [-0.05, 0.003, 0.12])
def test_force_is_the_slope_of_the_energy_and_its_own_slope_that_of_the_force(
    parallel, contraction
):
    spring = PassiveSpring(
        stiffness=9e3, softening=30.0, slack_contraction=0.01, parallel=parallel, hardening=40.0
    )

    def at(kappa):
        return tube_energy_and_slope(spring, kappa, tube_force(spring, kappa))

    step = 1e-6
    (low, _), (high, _) = at(contraction - step), at(contraction + step)
    force = tube_force(spring, contraction)
    assert force == pytest.approx((low - high) / (2.0 * step), rel=1e-6)
    change = tube_force(spring, contraction + step) - tube_force(spring, contraction - step)
    assert at(contraction)[1] == pytest.approx(change / (2.0 * step), rel=1e-6)


def test_nan_is_passed_on():
    for stiffness, softening, slack, _ in SPRINGS:
        for locking in (0.0, 18.0):  # a braid that never locks as well
            assert math.isnan(spring_force(math.nan, stiffness, softening, slack, locking))
