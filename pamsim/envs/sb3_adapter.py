"""The vector environment as stable-baselines3, the extra ``pamsim[rl]``, takes it."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from stable_baselines3.common.vec_env import VecEnv  # pyright: ignore[reportMissingImports]


class Sb3Rigs(VecEnv):
    """Rigs for a learner of stable-baselines3; notes the rewards of each round of episodes.

    Args:
        env: as `gymnasium.make_vec` makes it.
        seed: of the first rig, the others following on it.

    Attributes:
        steps: taken by all rigs together when a round of episodes ended.
        rewards: mean of those episodes.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], seed: int) -> None:
        self.env, self._first_seed = env, seed  # the base asks for attributes of the environment
        self.num_envs = env.num_envs
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self._sum, self._taken = np.zeros(env.num_envs), 0
        self.steps: list[int] = []
        self.rewards: list[float] = []

    def reset(self) -> Any:
        """Begin new episodes in all rigs."""
        return self.env.reset(seed=self._first_seed)[0].astype(np.float32)

    def step_async(self, actions: Any) -> None:
        """Note the actions of `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Any:
        """One step of all rigs; an episode that ends is followed by the next one at once."""
        seen, reward, broken, over, found = self.env.step(self._actions)
        self._sum += reward
        self._taken += self.num_envs
        done = broken | over
        infos: list[dict[str, Any]] = [{} for _ in done]
        for rig in np.flatnonzero(done):
            last, truncated = seen[rig].astype(np.float32), bool(over[rig])
            infos[rig] = {
                "terminal_observation": last,
                "TimeLimit.truncated": truncated,
                "is_success": bool(found["is_success"][rig]),
            }
        if done.any():
            self.steps.append(self._taken)
            self.rewards.append(round(float(self._sum[done].mean()), 3))
            self._sum[done] = 0.0
            # Gymnasium resets at the next step, stable-baselines3 expects it at once.
            seen = self.env.reset(options={"reset_mask": done})[0]
        return seen.astype(np.float32), reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the environment, once per rig."""
        return [getattr(self.env, attr_name, None)] * self.num_envs

    def env_method(self, *args: Any, **kw: Any) -> Any:
        """Refused: the rigs are stepped together and share their settings."""
        raise NotImplementedError("the rigs are stepped together: give settings to make_vec")

    set_attr = env_method

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No wrappers."""
        return [False] * self.num_envs
