"""What tasks ask for: within reach, derivatives that belong to the angle, one generator for all."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.envs.scales import Reach
from pamsim.envs.tasks import TASKS

REACH = Reach(centre=0.1, travel=0.3, stiffness=(4.0, 9.0), torque=0.5)
TIME = 1e-3 * np.arange(8001)


def asked(task, seed=0):
    return TASKS[task](np.random.default_rng(seed), TIME, REACH)


@pytest.mark.parametrize("task", TASKS)
def test_all_is_within_reach_and_follows_from_the_seed(task):
    assert np.array_equal(asked(task, 1).position, asked(task, 1).position)
    assert not np.array_equal(asked(task, 1).position, asked(task, 2).position)
    for found in (asked(task, seed) for seed in range(5)):
        assert np.abs(found.position - REACH.centre).max() <= REACH.travel * 1.6
        assert np.abs(found.torque).max() <= REACH.torque
        wanted = found.stiffness[found.stiffness != 0.0]
        assert ((wanted >= REACH.stiffness[0]) & (wanted <= REACH.stiffness[1])).all()
        assert (len(wanted) > 0) == (task == "stiffness")
        assert found.torque.any() == (task == "disturbance")


@pytest.mark.parametrize("task", ["sine", "multisine"])
def test_rate_and_acceleration_are_derivatives_of_the_position(task):
    found = asked(task)
    h = TIME[1]
    rate = (found.position[2:] - found.position[:-2]) / (2.0 * h)
    bend = (found.position[2:] - 2.0 * found.position[1:-1] + found.position[:-2]) / h**2
    assert rate == pytest.approx(found.velocity[1:-1], abs=1e-4)
    # The envelope's third derivative jumps where it ends, at 1 s.
    inside = np.abs(TIME[1:-1] - 1.0) > 2 * h
    assert bend[inside] == pytest.approx(found.acceleration[1:-1][inside], abs=1e-3)
    assert found.position[0] == REACH.centre
    assert found.velocity[0] == found.acceleration[0] == 0.0


def test_steps_are_held_for_two_seconds():
    found = asked("step").position
    jumps = TIME[1:][np.diff(found) != 0.0]
    assert jumps == pytest.approx([2.0, 4.0, 6.0, 8.0])
