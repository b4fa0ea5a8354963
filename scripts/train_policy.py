"""Train a small policy on an environment with stable-baselines3's PPO, on the CPU.

    pip install "pamsim[rl]"
    python scripts/train_policy.py [--task sine] [--steps 1000000] [--seed 0] [--out FOLDER]

Writes the policy as plain numbers, ``policy_<task>.npz`` (pamsim runs it without PyTorch, see
`pamsim.controllers.neural_policy`), and ``policy_<task>.json``: command, versions, learning curve.
The committed ones lie in scripts/results.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import platform
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import pamsim
import pamsim.envs  # registers the environments

ENVIRONMENT = "pamsim/PamArmPressure-v0"
ARMS = 32
SCALE = np.array([0.3, 3.0, 1.0, 1.0, 0.3, 3.0, 20.0, 10.0])
"""What observations are divided by before the first layer."""
CENTRE = np.array([0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0])
PPO = {
    "n_steps": 200,
    "batch_size": 1600,
    "n_epochs": 10,
    "gamma": 0.95,
    "gae_lambda": 0.9,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [64, 64], "log_std_init": -1.0},
}


def main() -> int:
    """Train, check the exported numbers against PyTorch's, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="sine")
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rig", default="mas20_arm")
    parser.add_argument("--load", type=float, default=1.2, help="[kg]")
    parser.add_argument("--out", type=Path, default=Path("scripts/results"))
    options = parser.parse_args()
    try:
        from stable_baselines3 import PPO as Learner
    except ImportError:
        print('stable-baselines3 is missing: pip install "pamsim[rl]"', file=sys.stderr)
        return 2
    import torch

    torch.set_num_threads(1)
    began = time.perf_counter()
    arms = _adapter()(
        gymnasium.make_vec(
            ENVIRONMENT, num_envs=ARMS, task=options.task, rig=options.rig, load=options.load
        ),
        options.seed,
    )
    # The rate falls to nothing: the last policy is then about the best one.
    learner = Learner(
        "MlpPolicy",
        arms,
        seed=options.seed,
        device="cpu",
        learning_rate=lambda left: 1e-3 * left,
        **PPO,
    )
    learner.learn(options.steps)
    layers = _layers(learner.policy)
    apart = _largest_difference(learner.policy, layers)
    stem = options.out / f"policy_{options.task}"
    options.out.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        stem.with_suffix(".npz"),
        centre=CENTRE,
        scale=SCALE,
        **{f"w_{k}": weight for k, (weight, _) in enumerate(layers)},
        **{f"b_{k}": bias for k, (_, bias) in enumerate(layers)},
    )
    page = {
        "schema": "pamsim-policy/1",
        "command": f"python scripts/train_policy.py --task {options.task} --steps {options.steps}"
        f" --seed {options.seed} --rig {options.rig} --load {options.load:g}",
        "environment": ENVIRONMENT,
        "arms": ARMS,
        "ppo": {**PPO, "learning_rate": "1e-3, falling linearly to 0"},
        "largest_difference_to_pytorch": apart,
        "seconds": round(time.perf_counter() - began),
        "versions": {
            "python": platform.python_version(),
            "pamsim": pamsim.__version__,
            **{
                name: importlib.metadata.version(name)
                for name in ("mujoco", "gymnasium", "stable-baselines3", "torch")
            },
        },
        "curve": {"steps": arms.curve_steps, "mean_episode_reward": arms.curve_rewards},
    }
    stem.with_suffix(".json").write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {stem}.npz and .json; last mean reward {arms.curve_rewards[-1]:.1f}")
    return 0


def _adapter() -> Any:
    """Class of a vector environment of Gymnasium as one of stable-baselines3."""
    from stable_baselines3.common.vec_env import VecEnv

    class Adapter(VecEnv):
        """Scales observations; notes the mean reward of each round of episodes."""

        def __init__(self, env: gymnasium.vector.VectorEnv, seed: int) -> None:
            super().__init__(
                env.num_envs,
                gymnasium.spaces.Box(-np.inf, np.inf, (len(SCALE),), np.float32),
                env.single_action_space,
            )
            self.env, self._first_seed = env, seed
            self._sum = np.zeros(env.num_envs)
            self._steps = 0
            self.curve_steps: list[int] = []
            self.curve_rewards: list[float] = []

        def reset(self) -> Any:
            return _scaled(self.env.reset(seed=self._first_seed)[0])

        def step_async(self, actions: Any) -> None:
            self._actions = actions

        def step_wait(self) -> Any:
            seen, reward, broken, over, _ = self.env.step(self._actions)
            self._sum += reward
            self._steps += self.num_envs
            done = broken | over
            infos: list[dict[str, Any]] = [{} for _ in done]
            if done.any():
                for arm in np.flatnonzero(done):
                    infos[arm] = {
                        "terminal_observation": _scaled(seen[arm]),
                        "TimeLimit.truncated": bool(over[arm]),
                    }
                self.curve_steps.append(self._steps)
                self.curve_rewards.append(round(float(self._sum[done].mean()), 3))
                self._sum[done] = 0.0
                # Gymnasium resets at the next step, stable-baselines3 expects it at once.
                seen = self.env.reset(options={"reset_mask": done})[0]
            return _scaled(seen), reward.astype(np.float32), done, infos

        def close(self) -> None:
            self.env.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(self.env, attr_name, None)] * self.num_envs

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise NotImplementedError("PPO sets no attributes")

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kw: Any) -> Any:
            raise NotImplementedError("PPO calls no methods of the environment")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * self.num_envs

    return Adapter


def _scaled(seen: Any) -> Any:
    return ((seen - CENTRE) / SCALE).astype(np.float32)


def _layers(policy: Any) -> list[tuple[Any, Any]]:
    """Weights and biases from the observation to the mean action, tanh between them."""
    hidden = [m for m in policy.mlp_extractor.policy_net if hasattr(m, "weight")]
    return [
        (m.weight.detach().numpy().astype(float), m.bias.detach().numpy().astype(float))
        for m in [*hidden, policy.action_net]
    ]


def _largest_difference(policy: Any, layers: list[tuple[Any, Any]]) -> float:
    """Between the exported numbers' action and PyTorch's, over a thousand observations."""
    seen = np.random.default_rng(0).normal(size=(1000, len(SCALE))).astype(np.float32)
    theirs = policy.predict(seen, deterministic=True)[0]
    value = seen.astype(float)
    for weight, bias in layers[:-1]:
        value = np.tanh(value @ weight.T + bias)
    weight, bias = layers[-1]
    ours = np.clip(value @ weight.T + bias, -1.0, 1.0)
    apart = float(np.abs(ours - theirs).max())
    if not apart < 1e-4:
        raise RuntimeError(f"the exported policy differs from PyTorch's by {apart:g}")
    return apart


if __name__ == "__main__":
    sys.exit(main())
