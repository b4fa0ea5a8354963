"""Every controller on every task: error, overshoot, settling, valve switching, air.

    python scripts/controller_scoreboard.py [--json FILE]

Plants: the MAS-20 arm without and with 1.2 kg, the same with ten times the hysteresis, and one
whose load the designs do not know. A controller's one free number is chosen for each plant and task
by its RMSE on three tuning seeds; scores are means over five others. Trained policies
(`pamsim train`) have nothing to choose; they were trained with 1.2 kg and the rig's own
hysteresis.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import gymnasium
from records import parser, write
from tqdm import tqdm

import pamsim
import pamsim.envs  # registers the environments
from pamsim.controllers.controller import Controller
from pamsim.controllers.neural_policy import NeuralPolicy
from pamsim.controllers.suite import FAMILIES, Suite
from pamsim.core.computation import versions
from pamsim.core.errors import PamsimError
from pamsim.envs.closed_loop import Score, mean_score, run_episode, score

RESULTS = Path("scripts/results/controller_scoreboard.json")
POLICIES = ("sine", "step")
TASKS = ("sine", "step", "disturbance", "stiffness")
TUNING, SEEDS = (1000, 1005, 1012), (0, 1, 2, 3, 4)
"""Sines of the tuning seeds: 0.5, 0.9, 0.7 Hz. Some controllers oscillate on fast sines only."""
STRONG = {"hysteresis.force_per_pressure": 2e-4}
"""Ten times the rig's: 20 N/bar."""


@dataclass(frozen=True)
class Plant:
    """An arm, and what its designer takes it for."""

    name: str
    values: dict[str, float]
    load: float
    believed: float
    tasks: tuple[str, ...] = TASKS


PLANTS = (
    Plant("unloaded", {}, 0.0, 0.0),
    Plant("1.2 kg", {}, 1.2, 1.2),
    Plant("1.2 kg, ten times the hysteresis", STRONG, 1.2, 1.2, ("sine", "step")),
    Plant("1.2 kg, designed for none", {}, 1.2, 0.0, ("sine", "step")),
)


def environment(plant: Plant, task: str, command: str) -> gymnasium.Env:
    """The environment of a plant and task for a kind of command."""
    rig = pamsim.load_rig("mas20_arm").with_parameters(plant.values)
    return gymnasium.make("pamsim/Rig-v0", rig=rig, action=command, task=task, load=plant.load)


def driven(env: gymnasium.Env, controller: Controller, seeds: tuple[int, ...]) -> Score:
    """Mean score over some episodes."""
    return mean_score([score(run_episode(env, controller, seed)) for seed in seeds])


def rows_of(plant: Plant, bar: tqdm) -> list[dict[str, object]]:
    """Scores of all controllers on a plant."""
    rig = pamsim.load_rig("mas20_arm").with_parameters(plant.values)
    suite = Suite(rig=rig, load=plant.believed)
    rows = []
    for task in plant.tasks:
        pressure, valve = (environment(plant, task, kind) for kind in ("pressure_set", "valve"))
        for name, family in FAMILIES.items():
            bar.set_postfix_str(f"{plant.name}, {task}, {name}")
            tuned = []
            for value in family.tried:
                try:
                    controller = family.make(suite, value)
                except PamsimError as error:  # a margin that cannot be had is no candidate
                    bar.write(f"{name} {value:g}: {error}")
                    continue
                env = pressure if controller.command == "pressure_set" else valve
                tried = driven(env, controller, TUNING).rmse if len(family.tried) > 1 else 0.0
                tuned.append((tried, value, controller, env))
            if tuned:
                _, value, controller, env = min(tuned, key=lambda trial: trial[0])
                chosen = value if len(family.tried) > 1 else None
                rows.append(row(plant, task, name, chosen, driven(env, controller, SEEDS)))
            bar.update()
        for trained in POLICIES:
            path = RESULTS.parent / f"policy_{trained}.npz"
            policy = NeuralPolicy.read(path, rig)
            name = f"policy trained on {trained}"
            rows.append(row(plant, task, name, None, driven(pressure, policy, SEEDS)))
            bar.update()
        pressure.close()
        valve.close()
    return rows


def row(plant: Plant, task: str, name: str, chosen: float | None, got: Score) -> dict[str, object]:
    """One line of the board."""
    return {
        "plant": plant.name,
        "task": task,
        "controller": name,
        "chosen": chosen,
        "rmse_deg": _round(math.degrees(got.rmse)),
        "worst_deg": _round(math.degrees(got.worst)),
        "overshoot": _round(got.overshoot),
        "settling_s": _round(got.settling),
        "stiffness_error": _round(got.stiffness_error),
        "switching_hz": _round(got.switching),
        "air_mg_s": _round(got.air * 1e6),
        "reward": _round(got.reward),
    }


def _round(value: float) -> float | None:
    return None if math.isnan(value) else float(f"{value:.4g}")


def main() -> int:
    """Drive, print the RMSE, write."""
    target = parser(__doc__, RESULTS).parse_args().json
    rows: list[dict[str, object]] = []
    cells = sum(len(plant.tasks) for plant in PLANTS) * (len(FAMILIES) + len(POLICIES))
    with tqdm(total=cells, file=sys.stderr) as bar:
        for plant in PLANTS:
            rows += rows_of(plant, bar)
    page = {
        "schema": "pamsim-scoreboard/1",
        "command": "python scripts/controller_scoreboard.py",
        "tuning_seeds": TUNING,
        "seeds": SEEDS,
        "rows": rows,
        "versions": versions("scipy", "control", "gymnasium"),
    }
    write(page, target)
    for row in rows:
        print(f"{row['plant']:34} {row['task']:12} {row['controller']:32} {row['rmse_deg']} deg")
    return 0


if __name__ == "__main__":
    sys.exit(main())
