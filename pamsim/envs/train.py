"""Train a small policy on a rig with stable-baselines3's PPO, on the CPU."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from pamsim.controllers.neural_policy import NeuralPolicy, PolicyFile, write_policy
from pamsim.core.computation import Progress, versions
from pamsim.core.encoding import write_json
from pamsim.core.errors import EngineError, InputError
from pamsim.core.files import complete_file, refuse_existing
from pamsim.envs import ENVIRONMENT
from pamsim.envs.settings import env_settings

RIGS = 32
"""Stepped together."""

PPO: dict[str, Any] = {
    "n_steps": 200,
    "batch_size": 1600,
    "n_epochs": 10,
    "gamma": 0.95,
    "gae_lambda": 0.9,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [64, 64], "log_std_init": -1.0},
}
"""Settings of the learner."""

_RATE = 1e-3  # at first; it falls to 0, so that the last policy is about the best one
_TRIED = 1000  # observations at which the policy's numbers are compared with PyTorch's
_NEAR = 1e-4  # how near they are


@dataclass(frozen=True, kw_only=True, eq=False)
class Training:
    """A trained policy and how it came about.

    Attributes:
        policy: its numbers.
        settings: of the environment.
        seed: of learner and environment.
        steps: taken by all rigs together when a round of episodes ended.
        rewards: mean of those episodes.
        apart: largest difference between the policy's actions and PyTorch's.
        seconds: that it took [s].
    """

    policy: PolicyFile
    settings: dict[str, Any]
    seed: int
    steps: list[int] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    apart: float = 0.0
    seconds: float = 0.0

    def summary(self) -> str:
        """First and last mean reward of an episode, in one line."""
        return (
            f"{self.steps[-1]} steps in {self.seconds:.0f} s: mean reward of an episode from"
            f" {self.rewards[0]:.0f} to {self.rewards[-1]:.0f}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Settings, learning curve, versions."""
        return {
            "schema": "pamsim-policy/2",
            "environment": ENVIRONMENT,
            "settings": self.settings,
            "seed": self.seed,
            "rigs": RIGS,
            "ppo": {**PPO, "learning_rate": f"{_RATE:g}, falling linearly to 0"},
            "largest_difference_to_pytorch": self.apart,
            "seconds": round(self.seconds),
            "versions": versions("gymnasium", "stable-baselines3", "torch"),
            "curve": {"steps": self.steps, "mean_episode_reward": self.rewards},
        }

    def save(self, path: Path, *, force: bool = False) -> list[Path]:
        """Write the policy as ``path`` (.npz), and what `to_dict` gives beside it (.json).

        Raises:
            InputError: if a file is there already and ``force`` is not given.
        """
        numbers, record = files = policy_files(path)
        for file in files:
            refuse_existing(file, force)
        with complete_file(numbers) as part:
            write_policy(part, self.policy)
        write_json(record, self.to_dict())
        return files


def policy_files(path: Path) -> list[Path]:
    """Files of a policy: its numbers (.npz), and what it was trained with (.json).

    Raises:
        InputError: if the path names no file.
    """
    name = path.name.removesuffix(".npz")
    if name in ("", ".."):
        raise InputError(f"{path} is a folder; name a file to write, such as policy.npz")
    return [path.parent / f"{name}{suffix}" for suffix in (".npz", ".json")]


def train(
    *, steps: int, seed: int = 0, progress: Progress | None = None, **settings: Any
) -> Training:
    """Train a policy.

    Args:
        steps: of all rigs together; rounded up to whole rounds of 32 x 200.
        seed: of learner and environment.
        progress: called after each step of all rigs together.
        **settings: see `pamsim.envs.settings.EnvSettings`, with continuous actions.

    Raises:
        InputError: for on/off valves, an unknown setting, or less than one step.
        EngineError: without stable-baselines3; it names the fix.
    """
    if env_settings(settings).action == "on_off":
        raise InputError("a policy gives continuous actions; train it on `action` valve")
    if steps < 1:
        raise InputError(f"{steps} steps train nothing; give 100000 or more")
    try:
        import torch  # pyright: ignore[reportMissingImports]
        from stable_baselines3 import PPO as Learner  # pyright: ignore[reportMissingImports]

        from pamsim.envs.sb3_adapter import Sb3Rigs
    except ImportError as error:
        raise EngineError(
            f'training needs stable-baselines3: pip install "pamsim[rl]" ({error})'
        ) from None
    torch.set_num_threads(1)
    began, whole = time.perf_counter(), RIGS * PPO["n_steps"]
    total = -(-steps // whole) * whole
    env = gymnasium.make_vec(
        ENVIRONMENT, num_envs=RIGS, vectorization_mode="vector_entry_point", **settings
    )
    rigs, own = Sb3Rigs(env, seed), env.unwrapped.rigs
    given = {**PPO, "learning_rate": lambda left: _RATE * left, "seed": seed, "device": "cpu"}
    with contextlib.closing(rigs):
        learner = Learner("MlpPolicy", rigs, **given)

        def stepped(*_: object) -> bool:
            if progress is not None:
                progress(learner.num_timesteps, total, "training")
            return True

        learner.learn(total, callback=stepped)
    # From the observation to the mean action, tanh between the layers.
    net = learner.policy
    layers = [*(m for m in net.mlp_extractor.policy_net if hasattr(m, "weight")), net.action_net]
    weights, biases = (
        tuple(getattr(layer, part).detach().numpy().astype(float) for layer in layers)
        for part in ("weight", "bias")
    )
    policy = PolicyFile(
        joints=tuple(own.rig.joints),
        muscles=tuple(own.rig.muscles),
        command=own.kind.command,
        supply=own.top_pressure,
        centre=own.signals.centre,
        scale=own.signals.scale,
        weights=weights,
        biases=biases,
    )
    return Training(
        policy=policy,
        settings={name: str(value) for name, value in settings.items()},
        seed=seed,
        steps=rigs.steps,
        rewards=rigs.rewards,
        apart=_largest_difference(policy, net),
        seconds=time.perf_counter() - began,
    )


def _largest_difference(policy: PolicyFile, theirs: Any) -> float:
    """Between the actions by the exported numbers and PyTorch's; an error if they differ."""
    tried = np.random.default_rng(0).normal(size=(_TRIED, len(policy.centre))).astype(np.float32)
    actions = theirs.predict(tried, deterministic=True)[0]
    apart = float(np.abs(NeuralPolicy(policy=policy).action(tried.astype(float)) - actions).max())
    if not apart < _NEAR:
        raise EngineError(f"the exported policy differs from PyTorch's by {apart:g}")
    return apart
