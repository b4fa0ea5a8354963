"""The passive spring as a store of energy, over the whole range of its parameters."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from pamsim.core.parameters import specs
from pamsim.physics.passive import PassiveSpring, locking_force, tube_force
from tests.properties.strategies import between

Spring = tuple[float, float, float, float]

RANGES = {name: (spec.low, spec.high) for name, spec in specs(PassiveSpring)}
SPRINGS = st.tuples(
    between(1.0, RANGES["stiffness"][1]),
    between(*RANGES["softening"]),
    between(*RANGES["slack_contraction"]),
    st.one_of(st.just(0.0), between(0.1, RANGES["locking"][1])),
)
"""Stiffness [N], softening, slack contraction, locking [-]."""
CONTRACTIONS = between(-0.2, 0.5)


def spring_force(
    contraction: float, stiffness: float, softening: float, slack: float, locking: float
) -> float:
    """Tube and locking of an unpressurised muscle, for which both know the same contraction."""
    spring = PassiveSpring(
        stiffness=stiffness, softening=softening, slack_contraction=slack, locking=locking
    )
    return tube_force(spring, contraction) + locking_force(spring, contraction)


def stored(contraction: float, spring: Spring) -> float:
    """Energy per nominal length [N] against the slack point: the closed integral of the law."""
    stiffness, softening, slack, locking = spring
    x = slack - contraction
    if x <= 0.0:
        return stiffness / softening * (math.expm1(softening * x) / softening - x)
    if locking == 0.0:
        return 0.5 * stiffness * x * x
    edge = 0.95 / locking
    inside = min(x, edge)
    energy = -0.5 * stiffness / locking**2 * math.log1p(-((inside * locking) ** 2))
    beyond = x - inside
    room = 1.0 - 0.95**2
    at, slope = stiffness * edge / room, stiffness * (1.0 + 0.95**2) / room**2
    return energy + beyond * (at + 0.5 * slope * beyond)


@given(SPRINGS, CONTRACTIONS, CONTRACTIONS)
def test_contraction_never_adds_force(spring, one, other):
    low, high = min(one, other), max(one, other)
    assert spring_force(low, *spring) >= spring_force(high, *spring)


@given(SPRINGS, CONTRACTIONS)
def test_force_always_pulls_towards_the_slack_point(spring, contraction):
    force = spring_force(contraction, *spring)
    assert force * (spring[2] - contraction) >= 0.0
    assert force >= -spring[0] / spring[1]
    assert math.isfinite(force)


@given(SPRINGS, CONTRACTIONS, CONTRACTIONS)
def test_work_depends_on_the_ends_alone_and_is_stored(spring, start, end):
    """What the spring takes up between two contractions is the difference of a positive energy."""
    kinks = [spring[2], *([spring[2] - 0.95 / spring[3]] if spring[3] else [])]
    inner = [kink for kink in kinks if min(start, end) < kink < max(start, end)]
    points = inner if inner else None
    work, _ = quad(lambda k: -spring_force(k, *spring), start, end, points=points, limit=200)
    before, after = stored(start, spring), stored(end, spring)
    rounding = 1e-15 * spring[0]
    assert before >= -rounding
    assert after >= -rounding
    assert work == pytest.approx(after - before, rel=1e-7, abs=1e-9 * max(before, after, 1e-6))


@given(SPRINGS, CONTRACTIONS, between(0.0, 1.0))
def test_a_braid_that_locks_sooner_is_never_softer(spring, contraction, share):
    stiffness, softening, slack, locking = spring
    later = spring_force(contraction, stiffness, softening, slack, share * locking)
    assert spring_force(contraction, *spring) >= later * (1.0 - 1e-12 * math.copysign(1.0, later))
