"""Every controller that a suite designs is pure and brings the arm where it is wanted."""

import copy
import math
import os
import pickle
import sys

import numpy as np
import pytest

import pamsim
from pamsim.controllers.suite import FAMILIES, Suite
from pamsim.core.errors import EngineError
from pamsim.envs.closed_loop import run_episode, score
from pamsim.envs.train import train
from tests.unit.controllers.closed_loop import LEVEL, SUPPLY, observe


@pytest.fixture(scope="module")
def suite():
    return Suite(rig=pamsim.load_rig("mas20_arm"), load=1.2)


@pytest.fixture
def made(opened):
    return lambda command, **options: opened(action=command, load=1.2, **options)


def seen(k):
    return observe(
        angle=0.1 * math.sin(0.3 * k),
        velocity=math.cos(0.3 * k),
        pressure=(LEVEL + 2e4 * math.sin(0.2 * k), LEVEL - 1e4 * math.cos(0.5 * k)),
        wanted=(0.2 * math.sin(0.1 * k), 0.3, -0.5),
    )


def commands(controller, memory, samples):
    found = []
    for k in samples:
        command, memory = controller.step(seen(k), memory)
        found.append(command)
    return found, memory


@pytest.mark.parametrize("name", FAMILIES)
def test_the_arm_comes_to_the_angle_wanted_by_commands_that_can_be_had(name, suite, made):
    family = FAMILIES[name]
    controller = family.make(suite, family.tried[len(family.tried) // 2])
    env = made(controller.command, task="regulation", max_episode_steps=150)
    run = run_episode(env, controller, seed=0)
    assert abs(run.reference[0, 0]) > math.radians(5.0)
    left = math.degrees(abs(run.position[-10:] - run.reference[-10:]).max())
    # The compensated feed-forward undoes a path that the joint does not take when it overshoots.
    assert left < (1.3 if name == "feed-forward, compensated" else 1.0)
    # A memory can be copied and continued, by another controller of the kind as well.
    controller, other = (family.make(suite, family.tried[0]) for _ in range(2))
    first, memory = commands(controller, controller.start(seen(0)), range(20))
    before = pickle.dumps(memory)
    once, _ = commands(controller, memory, range(20, 100))
    assert pickle.dumps(memory) == before
    again, _ = commands(controller, copy.deepcopy(memory), range(20, 100))
    stranger, _ = commands(other, pickle.loads(before), range(20, 100))
    assert once == again == stranger
    assert len(set(first + once)) > 20
    low, high = (0.0, SUPPLY) if controller.command == "pressure_set" else (-1.0, 1.0)
    assert all(low <= value <= high for command in first + once for value in command)


def test_the_schedule_is_over_differences_of_pressure_at_one_level(suite):
    scheduled = suite.scheduled(0.2)
    assert scheduled.points == suite.differences
    assert len(set(scheduled.gains)) == len(scheduled.points)
    assert {item.point.pressure for item in suite.local_models.models} == {LEVEL}


def test_stiffness_is_had_by_co_contraction(suite, made):
    env = made("pressure_set", task="stiffness", max_episode_steps=95)
    run = run_episode(env, suite.feed_forward(), seed=2)
    asked = run.wanted_stiffness[-1, 0]
    assert run.stiffness[-20:, 0] == pytest.approx(np.full(20, asked), rel=0.03)
    assert abs(run.position[-1, 0] - run.reference[-1, 0]) < math.radians(0.5)


def test_compensated_feed_forward_halves_the_error_of_a_pid(suite, made):
    env = made("pressure_set", task="sine", max_episode_steps=200)
    pids = [run_episode(env, suite.pid(time), seed=0) for time in FAMILIES["PID"].tried]
    ahead = run_episode(env, suite.feed_forward(0.2, compensated=True), seed=0)
    assert score(ahead).rmse < 0.5 * min(score(run).rmse for run in pids)


def test_what_is_missing_is_one_line_that_names_the_fix(made, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(EngineError, match=r"\A[^\n]*pamsim\[rl\][^\n]*\Z"):
        train(steps=1)
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        pytest.skip("there is a screen")
    env = made("pressure_set", render_mode="human")
    with pytest.raises(EngineError, match=r"\A[^\n]*set DISPLAY[^\n]*`pamsim render`[^\n]*\Z"):
        env.reset(seed=0)
