"""Sliding mode on G2: it gets to its layer in time, stays there, and has no offset."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.controllers.model_based import SlidingMode
from tests.unit.controllers.closed_loop import MODEL, POINT, LinearPlant, observe

FINE = 1e-3
PUSH = 1e4  # Pa


def sliding(reach=20.0, layer=0.5):
    return SlidingMode(
        model=MODEL, point=POINT, period=FINE, bandwidth=6.0, reach=reach, layer=layer
    )


def surfaces(controller, disturbance, samples):
    plant = LinearPlant(FINE, disturbance=disturbance, state=(0.0, 3.0))
    memory, found, angles = controller.start(plant.observation()), [], []
    for _ in range(samples):
        observation = plant.observation()
        found.append(controller.surface(observation, memory))
        angles.append(observation.joint.position)
        command, memory = controller.step(observation, memory)
        plant.take(command)
    return np.array(found), np.array(angles)


@pytest.mark.parametrize("disturbance", [lambda t: PUSH, lambda t: PUSH * math.sin(30.0 * t)])
def test_it_reaches_the_layer_in_the_time_it_says_and_stays(disturbance):
    controller = sliding()
    found, _ = surfaces(controller, disturbance, 1500)
    pushed = MODEL.gain / MODEL.a2 * PUSH
    assert pushed < controller.reach
    latest = (abs(found[0]) - controller.layer) / (controller.reach - pushed)
    assert abs(found[0]) > controller.layer
    after = np.abs(found[math.ceil(latest / FINE) + 1 :])
    assert np.all(after <= controller.layer * 1.01)


def test_a_disturbance_beyond_its_reach_throws_it_out():
    found, _ = surfaces(sliding(reach=2.0), lambda t: 3.0 * PUSH, 1500)
    assert np.max(np.abs(found[500:])) > 0.5


def test_the_integral_leaves_no_offset():
    _, angles = surfaces(sliding(), lambda t: PUSH, 4000)
    assert angles[-1] == pytest.approx(POINT.angle, abs=1e-5)


def test_the_integral_waits_at_the_limits():
    controller = sliding()
    observation = observe(angle=POINT.angle, wanted=(9.0, 0.0, 0.0))
    before = -0.3
    command, after = controller.step(observation, before)
    assert command == (POINT.split.supply, 0.0)
    assert after == before
