"""Many rigs at once are so many single ones, to the last bit."""

import itertools

import gymnasium
import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.envs import ENVIRONMENT, MAS20, plant
from pamsim.envs.rig_vector_env import RigVectorEnv

RIGS = 3


@pytest.fixture
def both():
    opened = []

    def make(name, **options):
        opened.extend(
            gymnasium.make_vec(name, num_envs=RIGS, vectorization_mode=mode, **options)
            for mode in ("vector_entry_point", "sync")
        )
        return opened[-2:]

    yield make
    for env in opened:
        env.close()


def same(one, other):
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            same(one[key], other[key])
    else:
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)


VARIANTS = (
    {"task": "step", "angle_noise": 1e-3, "pressure_noise": 500.0},
    {"task": "disturbance", "delay": 0.0035, "instruments": True},
    {"task": "stiffness", "randomize": True, "load": (0.0, 2.0)},
    {"task": "disturbance", "rig": "two_joint_arm", "load": (0.0, 1.0)},
    {"task": "stiffness", "rig": "two_joint_arm", "delay": 0.013, "pressure_noise": 500.0},
)


@pytest.mark.parametrize(
    ("name", "options"), list(zip(itertools.cycle(MAS20), VARIANTS, strict=False))
)
def test_same_results_as_single_environments(name, options, both):
    many, single = both(name, max_episode_steps=20, frame_skip=10, **options)
    assert many.observation_space == single.observation_space
    assert many.action_space == single.action_space
    many.action_space.seed(1)
    for one, other in zip(many.reset(seed=5), single.reset(seed=5), strict=True):
        same(one, other)
    for _ in range(45):  # through two ends of episodes
        action = many.action_space.sample()
        found = many.step(action)
        for one, other in zip(found, single.step(action), strict=True):
            same(one, other)
        assert many.observation_space.contains(found[0])


@pytest.mark.parametrize(("rig", "muscles"), [("mas20_arm", 2), ("two_joint_arm", 4)])
def test_lengths_by_the_jacobian_are_the_engine_s(rig, muscles, monkeypatch, both):
    found = []
    moves = np.multiply.outer((0.4, -0.7, 0.1), np.ones((RIGS, muscles), np.float32))
    for fixed_tendons in (plant.fixed_tendons, lambda model: None):
        monkeypatch.setattr(plant, "fixed_tendons", fixed_tendons)
        for env in both(ENVIRONMENT, rig=rig, action="valve", frame_skip=10):
            env.reset(seed=2)
            found.append([env.step(move)[0] for move in moves])
    assert all(np.array_equal(rows, found[0]) for rows in found)


def test_number_of_threads_changes_nothing():
    found = []
    for threads in (1, 2):
        env = gymnasium.make_vec(ENVIRONMENT, num_envs=5, threads=threads)
        env.reset(seed=1)
        found.append([env.step(np.full((5, 2), 0.3, np.float32))[0] for _ in range(8)])
        env.close()
    assert np.array_equal(*found)


def test_some_arms_can_be_reset_alone(both):
    many, single = both(ENVIRONMENT)
    action = np.tile(np.array([0.4, -0.6], np.float32), (RIGS, 1))
    for env in (many, single):
        env.reset(seed=3)
        for _ in range(4):
            env.step(action)
    mask = np.array([False, True, False])
    one, info = many.reset(seed=[None, 8, None], options={"reset_mask": mask})
    other, _ = single.reset(seed=[None, 8, None], options={"reset_mask": mask.copy()})
    same(one, other)
    assert info["_position"].tolist() == mask.tolist()
    same(many.step(action)[0], single.step(action)[0])
    for call, message in (({"seed": [1]}, "seeds"), ({"options": {"reset_mask": [1]}}, "mask")):
        with pytest.raises(InputError, match=message):
            many.reset(**call)
    with pytest.raises(InputError, match="num_envs"):
        RigVectorEnv(0)


@pytest.mark.usefixtures("unchecked")
def test_an_arm_that_breaks_down_leaves_the_others_alone(both):
    many, single = both(ENVIRONMENT, action="valve")
    action = np.zeros((RIGS, 2), np.float32)
    many.reset(seed=3)
    single.reset(seed=3)
    many.rigs.plant.act[1, -1] = np.nan
    ended = np.zeros(RIGS, dtype=bool)
    for _ in range(3):
        seen, rewards, broken, _, _ = many.step(action)
        expected = single.step(action)[0]
        ended |= broken
        assert np.array_equal(seen[[0, 2]], expected[[0, 2]])
        assert np.isfinite(seen).all()
        assert np.all(rewards[broken] == -100.0)
    assert ended.tolist() == [False, True, False]
