"""Ten thousand episodes of random actions per environment: does anything break?

    python scripts/random_episodes.py [--episodes 10000] [--json FILE]

Counts episodes that broke down, engine warnings and numbers that are not finite, and notes the
lowest and highest pressure of all. Actions are uniform in their space, held for 1 to 20 steps, so
that muscles are driven to both ends; a third of the runs has randomized arms, loads and torques.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import gymnasium
import numpy as np
from records import RESULTS, parser, print_and_write
from tqdm import tqdm

import pamsim.envs  # registers the environments
from pamsim.envs import MAS20

RIGS, STEPS, FRAME_SKIP = 200, 100, 40


@dataclass
class Seen:
    """What episodes came to: numbers that broke down or are not finite, and pressures [Pa]."""

    broken: int = 0
    strange: int = 0
    lowest: float = np.inf
    highest: float = -np.inf

    def play(self, env: gymnasium.vector.VectorEnv, rng: np.random.Generator, steps: int) -> None:
        """Random actions, each held for 1 to 20 steps, after a reset."""
        held, action = np.zeros(env.num_envs, dtype=int), env.action_space.sample()
        for _ in range(steps):
            new = held == 0
            action[new] = env.action_space.sample()[new]
            held = np.where(new, rng.integers(1, 21, env.num_envs), held) - 1
            observation, reward, terminated, _, info = env.step(action)
            self.strange += int((~np.isfinite(observation)).sum() + (~np.isfinite(reward)).sum())
            self.broken += int(terminated.sum())
            self.lowest = min(self.lowest, float(info["pressure"].min()))
            self.highest = max(self.highest, float(info["pressure"].max()))


def play(name: str, episodes: int) -> dict[str, object]:
    """Random episodes of one environment."""
    rounds = -(-episodes // RIGS)
    rng, seen = np.random.default_rng(0), Seen()
    warnings, supply = 0, 0.0
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
        seen.play(env, rng, STEPS)
        warnings += env.rigs.plant.warnings()
        env.close()
    return {
        "environment": name,
        "episodes": rounds * RIGS,
        "broke_down": seen.broken,
        "engine_warnings": warnings,
        "not_finite": seen.strange,
        "lowest_pressure_kpa": round(seen.lowest / 1e3, 3),
        "highest_pressure_kpa": round(seen.highest / 1e3, 3),
        "supply_kpa": supply / 1e3,
    }


def main() -> int:
    """Play, print, write; 1 if something broke."""
    options = parser(__doc__, RESULTS / "random_episodes.json", episodes=10_000).parse_args()
    rows = [play(name, options.episodes) for name in MAS20]
    page = {
        "command": f"python scripts/random_episodes.py --episodes {options.episodes}",
        "pamsim": pamsim.__version__,
        "rigs": RIGS,
        "steps": STEPS,
        "frame_skip": FRAME_SKIP,
        "rows": rows,
    }
    print_and_write(page, options.json)
    return int(any(r["broke_down"] or r["engine_warnings"] or r["not_finite"] for r in rows))


if __name__ == "__main__":
    sys.exit(main())
