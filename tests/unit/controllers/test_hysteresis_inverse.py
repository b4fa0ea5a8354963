"""The inverse on the wanted angle, from the start and around every turn."""

from __future__ import annotations

import numpy as np

from pamsim.controllers.hysteresis import HysteresisInverse
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum

LAGGING = PlaySum(linear=0.4, thresholds=(0.02, 0.1, 0.2), weights=(0.3, 0.2, 0.1))


def test_what_it_asks_for_makes_the_lagging_arm_go_where_it_is_wanted():
    """The arm came to its first angle in one go, as `start` takes it to have."""
    inverse = HysteresisInverse.of(LAGGING)
    wanted = 0.3 * np.cos(np.linspace(0.0, 25.0, 400)) * np.linspace(1.0, 0.3, 400)
    plays = inverse.start(wanted[0])
    asked = []
    for angle in wanted.tolist():
        found, plays = inverse.undone(angle, plays)
        asked.append(found)
    memory, reached = LAGGING.virgin(), []
    for angle in asked:
        memory, y = LAGGING.step(memory, angle)
        reached.append(y)
    np.testing.assert_allclose(reached, wanted, atol=1e-12)


def test_a_start_is_remembered_on_the_way_back():
    inverse = HysteresisInverse.of(LAGGING)
    back, _ = inverse.undone(0.1, inverse.start(0.3))
    fresh, _ = inverse.undone(0.1, inverse.start(0.0))
    assert back < fresh - 0.01
