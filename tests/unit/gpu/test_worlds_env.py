"""The vector environment on worlds against the one on the engine itself."""

import pickle
from contextlib import closing

import gymnasium
import numpy as np
import pytest

import pamsim.envs  # noqa: F401  (registers the environments)
from pamsim.core.errors import EngineError
from pamsim.envs.rig_vector_env import RigVectorEnv

pytestmark = pytest.mark.slow

COUNT = 3


@pytest.mark.parametrize(
    "options",
    [
        {"randomize": True, "load": (0.0, 2.0), "delay": 0.0035, "angle_noise": 1e-3},
        {"action": "on_off", "task": "disturbance", "frame_skip": 160, "max_episode_steps": 16},
    ],
    ids=["pressures", "on_off_valves"],
)
def test_observations_rewards_and_ends_are_those_of_the_engine(options):
    """Through the end of an episode, with the same draws of loads, parameters and noise."""
    envs = [
        RigVectorEnv(COUNT, **{"task": "sine", "max_episode_steps": 12, **place, **options})
        for place in ({"threads": 1}, {"device": "cpu"})
    ]
    with closing(envs[0]), closing(envs[1]):
        first, second = (env.reset(seed=3)[0] for env in envs)
        assert second == pytest.approx(first, abs=1e-6)
        actions = envs[0].action_space
        actions.seed(1)
        for _ in range(20):
            action = actions.sample()
            own, other = (env.step(action) for env in envs)
            assert other[0] == pytest.approx(own[0], abs=1e-4)  # of the order of 1
            assert other[1] == pytest.approx(own[1], abs=1e-4)
            assert np.array_equal(other[2], own[2])
            assert np.array_equal(other[3], own[3])
            for name in ("position", "pressure"):
                assert other[4][name] == pytest.approx(own[4][name], rel=1e-4, abs=1e-5)
        assert np.ptp(own[0], axis=0).max() > 0.1  # the rigs go their own ways


def test_a_copy_continues_the_same_episodes_and_a_closed_one_refuses_to_step():
    mode = {"vectorization_mode": "vector_entry_point", "precision": "float32", "device": "cpu"}
    env = gymnasium.make_vec("pamsim/PamArmPressure-v0", num_envs=COUNT, **mode)
    env.reset(seed=3)
    env.action_space.seed(1)
    actions = [env.action_space.sample() for _ in range(6)]
    for action in actions[:3]:
        env.step(action)
    with closing(pickle.loads(pickle.dumps(env))) as copy:
        for action in actions[3:]:
            own, other = env.step(action)[0], copy.step(action)[0]
            assert other == pytest.approx(own, abs=1e-9)
    env.close()
    with pytest.raises(EngineError, match="closed"):
        env.unwrapped.step(actions[0])
