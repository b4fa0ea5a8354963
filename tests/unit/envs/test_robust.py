"""What a user may do wrong, or do to an environment: bad actions, copies, pickles, forks."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import time
import warnings
from contextlib import closing

import gymnasium
import numpy as np
import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.envs import ENVIRONMENT
from tests.unit.core.refusals import all_refused

OPTIONS = {
    "rig": "two_joint_arm",
    "task": "disturbance",
    "delay": 0.013,
    "angle_noise": 1e-3,
    "load": (0.0, 1.0),
    "max_episode_steps": 12,
}


def opened(count=None, **options):
    """One environment, or a vector environment of some rigs."""
    if count is None:
        return gymnasium.make(ENVIRONMENT, **options)
    mode = {"vectorization_mode": "vector_entry_point", **options}
    return gymnasium.make_vec(ENVIRONMENT, num_envs=count, **mode)


BAD = {
    "nan": ("pressure_set", [np.nan, 0.0], "action[0]"),
    "infinite": ("valve", [0.0, np.inf], "action[1]"),
    "one": ("pressure_set", [0.0], "2 numbers"),
    "three": ("pressure_set", [0.0, 0.0, 0.0], "2 numbers"),
    "words": ("pressure_set", ["open", "shut"], "2 numbers"),
    "ragged": ("pressure_set", [[0.0], [0.0, 1.0]], "2 numbers"),
    "twice on": ("on_off", [0, 2, 0, 0], "0 or 1"),
    "negative": ("on_off", [0, 0, 0, -1], "action[3]"),
    "infinitely on": ("on_off", [0.0, 0.0, np.inf, 0.0], "0 or 1"),
    "half": ("on_off", [0.5, 0.0, 0.0, 0.0], "0 or 1"),
}


@pytest.mark.parametrize("count", [None, 1])
def test_what_is_no_action_is_an_error_and_changes_nothing(count):
    for kind in ("pressure_set", "valve", "on_off"):
        with closing(opened(count, action=kind).unwrapped) as env:
            env.reset(seed=0)
            before = env.rigs.plant.state(0)
            bad = {name: row[1:] for name, row in BAD.items() if row[0] == kind}
            all_refused(bad, lambda action, env=env: env.step([action] if count else action))
            assert np.array_equal(env.rigs.plant.state(0), before)


def test_actions_beyond_the_space_count_as_its_ends_and_none_comes_before_reset():
    with closing(opened().unwrapped) as env:
        with pytest.raises(InputError, match="reset"):
            env.step(np.zeros(2))
        assert env.data.time == 0.0
        found = []
        for move in ([7.0, -1e30], [1.0, -1.0]):
            env.reset(seed=0)
            found.append([env.step(np.array(move))[1] for _ in range(3)])
    assert found[0] == found[1]
    assert np.isfinite(found[0]).all()
    with closing(opened(2)) as many, pytest.raises(InputError, match="reset"):
        many.step(np.zeros((2, 2)))


def rolled(env, actions):
    """Observations and rewards under actions, through ends of episodes."""
    rows = []
    for action in actions:
        seen, reward, broken, ended, info = env.step(action)
        rows.append(np.concatenate([np.ravel(seen), np.ravel(reward), np.ravel(info["position"])]))
        if np.ndim(reward) == 0 and (broken or ended):
            rows.append(np.concatenate([env.reset()[0], [0.0], [0.0, 0.0]]))
    return np.array(rows)


def pickled(env):
    return pickle.loads(pickle.dumps(env))


@pytest.mark.parametrize(("count", "copied"), [(None, pickled), (2, copy.deepcopy)])
def test_a_copy_continues_as_the_environment_does(count, copied):
    lagging = pamsim.load_rig("two_joint_arm").with_parameters({"sensor.angle_lag": 0.1})
    env = opened(count, **{**OPTIONS, "rig": lagging})
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(35)]
    env.reset(seed=5)
    rolled(env, actions[:17])
    other = copied(env)
    found = rolled(env, actions[17:])
    env.close()
    assert np.array_equal(rolled(other, actions[17:]), found)
    other.close()
    fresh = copied(opened(count))  # before its first reset
    fresh.reset(seed=0)
    fresh.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_vector_environment_goes_on():
    env = opened(4, rig="two_joint_arm", threads=2)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(10)]
    env.reset(seed=2)
    rolled(env, actions[:5])
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 on threads and forks
        child = os.fork()
    if child == 0:
        os.write(writing, rolled(env, actions[5:]).tobytes())
        os._exit(0)
    os.close(writing)
    try:
        ended, since = 0, time.monotonic()
        while not ended and time.monotonic() - since < 60.0:
            ended, _ = os.waitpid(child, os.WNOHANG)
            time.sleep(0.01)
    finally:
        if not ended:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
    assert ended, "the forked environment hangs"
    assert os.read(reading, 1_000_000) == rolled(env, actions[5:]).tobytes()
    os.close(reading)
    env.close()


def test_processes_of_gymnasium_are_equal_to_the_vector_environment():
    found = []
    for mode in ("async", "vector_entry_point"):
        env = opened(2, vectorization_mode=mode, **OPTIONS)
        env.reset(seed=1)
        found.append(rolled(env, [np.full((2, 4), push, np.float32) for push in (0.3, -0.4)]))
        env.close()
    assert np.array_equal(*found)


LATE = """
import os
import mujoco  # has chosen how to draw, for a screen
os.environ["MUJOCO_GL"] = "egl"
import gymnasium, pamsim.envs
env = gymnasium.make("pamsim/PamArmPressure-v0", render_mode="rgb_array", width=48, height=48)
env.reset()
print(env.render().std() > 1.0)
"""
HEADLESS = """
import gymnasium, pamsim.envs
from gymnasium.utils.env_checker import check_env
env = gymnasium.make("pamsim/Rig-v0", rig="two_joint_arm", render_mode="rgb_array")
check_env(env.unwrapped)
env.reset()
print(env.render().std() > 1.0)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or os.environ.get("MUJOCO_GL") == "disable", reason="no EGL here"
)
@pytest.mark.parametrize("script", [HEADLESS, LATE], ids=["whole check", "MUJOCO_GL set late"])
def test_pictures_need_no_screen(script):
    without = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={name: value for name, value in os.environ.items() if name not in without},
    )
    assert run.stdout == "True\n", run.stderr
