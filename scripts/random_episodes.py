"""Ten thousand episodes of random actions per environment: does anything break?

    python scripts/random_episodes.py [--episodes 10000] [--json FILE]

Counts episodes that broke down, engine warnings and numbers that are not finite, and notes the
lowest and highest pressure of all. Actions are uniform in their space, held for 1 to 20 steps, so
that muscles are driven to both ends; a third of the runs has randomized arms, loads and torques.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from records import parser, write
from tqdm import tqdm

import pamsim.envs  # registers the environments
from pamsim.envs import MAS20

RIGS, STEPS, FRAME_SKIP = 200, 100, 40
RESULTS = Path("scripts/results/random_episodes.json")


def random_steps(
    env: gymnasium.vector.VectorEnv, rng: np.random.Generator, steps: int
) -> Iterator[tuple[Any, ...]]:
    """What an environment answers to steps of random actions, each held for 1 to 20 steps."""
    held, action = np.zeros(env.num_envs, dtype=int), env.action_space.sample()
    for _ in range(steps):
        new = held == 0
        action[new] = env.action_space.sample()[new]
        held = np.where(new, rng.integers(1, 21, env.num_envs), held) - 1
        yield env.step(action)


def play(name: str, episodes: int) -> dict[str, object]:
    """Random episodes of one environment."""
    rounds = -(-episodes // RIGS)
    rng = np.random.default_rng(0)
    lowest, highest = np.inf, -np.inf
    broken = warnings = strange = 0
    supply = 0.0
    for number in tqdm(range(rounds), desc=name, file=sys.stderr):
        wild = number % 3 == 2
        env = gymnasium.make_vec(
            name,
            num_envs=RIGS,
            vectorization_mode="vector_entry_point",
            max_episode_steps=STEPS,
            frame_skip=FRAME_SKIP,
            task="disturbance" if wild else "step",
            load=(0.0, 2.5) if wild else 1.2,
            randomize=wild,
        )
        supply = env.rigs.top_pressure
        env.action_space.seed(number)
        env.reset(seed=RIGS * number)
        for observation, reward, terminated, _, info in random_steps(env, rng, STEPS):
            strange += int((~np.isfinite(observation)).sum() + (~np.isfinite(reward)).sum())
            broken += int(terminated.sum())
            lowest = min(lowest, float(info["pressure"].min()))
            highest = max(highest, float(info["pressure"].max()))
        warnings += env.rigs.plant.warnings()
        env.close()
    return {
        "environment": name,
        "episodes": rounds * RIGS,
        "broke_down": broken,
        "engine_warnings": warnings,
        "not_finite": strange,
        "lowest_pressure_kpa": round(lowest / 1e3, 3),
        "highest_pressure_kpa": round(highest / 1e3, 3),
        "supply_kpa": supply / 1e3,
    }


def main() -> int:
    """Play, print, write; 1 if something broke."""
    options = parser(__doc__, RESULTS, episodes=10_000).parse_args()
    rows = [play(name, options.episodes) for name in MAS20]
    page = {
        "command": f"python scripts/random_episodes.py --episodes {options.episodes}",
        "pamsim": pamsim.__version__,
        "rigs": RIGS,
        "steps": STEPS,
        "frame_skip": FRAME_SKIP,
        "rows": rows,
    }
    for row in rows:
        print(row)
    write(page, options.json)
    return int(any(r["broke_down"] or r["engine_warnings"] or r["not_finite"] for r in rows))


if __name__ == "__main__":
    sys.exit(main())
