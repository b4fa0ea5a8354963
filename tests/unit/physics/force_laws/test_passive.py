"""The passive spring, on either side of slack, with its energy; a gradual threshold."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from pamsim.core.parameters import specs
from pamsim.physics.passive import PassiveSpring, locking_force, tube_energy_and_slope, tube_force
from pamsim.physics.tension import effective_pressure, pressure_reaching

SPRINGS = [
    (9237.0, 32.9, 0.0013, 24.6),
    (24000.0, 85.8, -0.0336, 0.0),
    (500.0, 0.1, 0.2, 3.0),
    (3e4, 5.0, 0.0, 200.0),
]
"""Stiffness [N], softening, slack contraction, locking [-]."""


def spring_force(contraction, stiffness, softening, slack, locking):
    """Tube and locking of an unpressurised muscle, for which both know the same contraction."""
    spring = PassiveSpring(
        stiffness=stiffness, softening=softening, slack_contraction=slack, locking=locking
    )
    return tube_force(spring, contraction) + locking_force(spring, contraction)


def test_a_parallel_spring_pulls_as_it_pushes_and_is_twice_as_strong_at_its_stretch():
    straight = PassiveSpring(parallel=3e3, slack_contraction=0.01)
    hard = dataclasses.replace(straight, hardening=50.0)
    for stretch in (1e-4, 0.02, 0.3):
        pulled, pushed = (tube_force(hard, 0.01 - x) for x in (stretch, -stretch))
        assert pulled == pytest.approx(-pushed, rel=1e-12)
        linear = tube_force(straight, 0.01 - stretch)
        assert linear == pytest.approx(3e3 * stretch, rel=1e-9)
        assert pulled == pytest.approx(linear * (1.0 + (stretch / 0.02) ** 2), rel=1e-9)


def test_force_is_the_slope_of_the_energy_and_its_own_slope_that_of_the_force():
    for parallel in (0.0, 3e3, -2e3):
        spring = PassiveSpring(
            stiffness=9e3, softening=30.0, slack_contraction=0.01, parallel=parallel, hardening=40.0
        )
        for contraction in (-0.05, 0.003, 0.12):
            step = 1e-6
            low, at, high = (
                (force, *tube_energy_and_slope(spring, kappa, force))
                for kappa in (contraction - step, contraction, contraction + step)
                for force in (tube_force(spring, kappa),)
            )
            assert at[0] == pytest.approx((low[1] - high[1]) / (2.0 * step), rel=1e-6)
            assert at[2] == pytest.approx((high[0] - low[0]) / (2.0 * step), rel=1e-6)


def test_default_spring_is_no_spring_and_nan_is_passed_on():
    for contraction in (-0.3, 0.0, 0.25):
        assert tube_force(PassiveSpring(), contraction) == 0.0
        assert locking_force(PassiveSpring(), contraction) == 0.0
    for stiffness, softening, slack, _ in SPRINGS:
        for locking in (0.0, 18.0):  # a braid that never locks as well
            assert math.isnan(spring_force(math.nan, stiffness, softening, slack, locking))


@pytest.mark.parametrize("width", [0.0, 1e4, 5e4])
def test_a_gradual_threshold_loses_half_at_its_width_and_all_in_the_end(width):
    felt = [effective_pressure(p, 3e4, width) for p in np.linspace(-5e4, 6e5, 131).tolist()]
    assert np.all(np.diff(felt) >= 0.0)
    assert felt[0] == 0.0
    assert effective_pressure(1e9, 3e4, width) == pytest.approx(1e9 - 3e4, abs=2.0)
    if width > 3e4:  # else the half lies below the threshold
        assert effective_pressure(width, 3e4, width) == pytest.approx(width - 1.5e4)
    for pressure in (2.1e4, 2e5):
        step = 1e-2
        low, high = (effective_pressure(pressure + x, 3e4, width) for x in (-step, step))
        slope = (high - low) / (2.0 * step)
        assert pressure_reaching(pressure, 3e4, width) == pytest.approx(slope, abs=1e-7)


# --- over the whole range of the parameters ------------------------------------------------------

RANGES = {name: (spec.low, spec.high) for name, spec in specs(PassiveSpring)}
ANY_SPRING = st.tuples(
    st.floats(1.0, RANGES["stiffness"][1]),
    st.floats(*RANGES["softening"], allow_subnormal=False),
    st.floats(*RANGES["slack_contraction"], allow_subnormal=False),
    st.one_of(st.just(0.0), st.floats(0.1, RANGES["locking"][1])),
)
CONTRACTIONS = st.floats(-0.2, 0.5, allow_subnormal=False)


def stored(contraction, spring):
    """Energy per nominal length [N] against the slack point: the closed integral of the law."""
    stiffness, softening, slack, locking = spring
    x = slack - contraction
    if x <= 0.0:
        return stiffness / softening * (math.expm1(softening * x) / softening - x)
    if locking == 0.0:
        return 0.5 * stiffness * x * x
    edge, room = 0.95 / locking, 1.0 - 0.95**2
    inside = min(x, edge)
    energy = -0.5 * stiffness / locking**2 * math.log1p(-((inside * locking) ** 2))
    at, slope = stiffness * edge / room, stiffness * (1.0 + 0.95**2) / room**2
    return energy + (x - inside) * (at + 0.5 * slope * (x - inside))


@given(ANY_SPRING, CONTRACTIONS, CONTRACTIONS)
def test_work_depends_on_the_ends_alone_and_is_stored(spring, start, end):
    """What the spring takes up between two contractions is the difference of a positive energy."""
    kinks = [spring[2], *([spring[2] - 0.95 / spring[3]] if spring[3] else [])]
    inner = [kink for kink in kinks if min(start, end) < kink < max(start, end)]
    work, _ = quad(lambda k: -spring_force(k, *spring), start, end, points=inner or None, limit=200)
    before, after = stored(start, spring), stored(end, spring)
    assert min(before, after) >= -1e-15 * spring[0]
    assert work == pytest.approx(after - before, rel=1e-7, abs=1e-9 * max(before, after, 1e-6))
