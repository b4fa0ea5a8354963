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
from collections.abc import Mapping
from dataclasses import dataclass

import gymnasium
from records import RESULTS, parser, print_and_write
from tqdm import tqdm

import pamsim
import pamsim.envs  # registers the environments
from pamsim.controllers.controller import Controller
from pamsim.controllers.neural_policy import NeuralPolicy
from pamsim.controllers.suite import FAMILIES, Suite
from pamsim.core.computation import versions
from pamsim.core.errors import PamsimError
from pamsim.envs.closed_loop import Score, mean_score, run_episode, score

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


def tuned(
    name: str, suite: Suite, envs: Mapping[str, gymnasium.Env]
) -> tuple[float | None, Controller] | None:
    """The free number of a family of controllers that is best on the tuning seeds, if it has one.

    Args:
        name: of the family.
        suite: what it is designed on.
        envs: kind of command -> environment.

    Returns:
        The number and its controller; None if no controller can be designed.
    """
    family, found = FAMILIES[name], []
    for value in family.tried:
        try:
            controller = family.make(suite, value)
        except PamsimError as error:  # a margin that cannot be had is no candidate
            tqdm.write(f"{name} {value:g}: {error}")
            continue
        if len(family.tried) == 1:
            return None, controller
        rmse = driven(envs[controller.command], controller, TUNING).rmse
        found.append((rmse, value, controller))
    return min(found, key=lambda trial: trial[0])[1:] if found else None


def rows_of(plant: Plant, bar: tqdm) -> list[dict[str, object]]:
    """Scores of all controllers on a plant."""
    rig = pamsim.load_rig("mas20_arm").with_parameters(plant.values)
    suite = Suite(rig=rig, load=plant.believed)
    rows = []
    for task in plant.tasks:
        envs = {kind: environment(plant, task, kind) for kind in ("pressure_set", "valve")}
        for name in FAMILIES:
            bar.set_postfix_str(f"{plant.name}, {task}, {name}")
            if best := tuned(name, suite, envs):
                chosen, controller = best
                got = driven(envs[controller.command], controller, SEEDS)
                rows.append(row(plant, task, name, chosen, got))
            bar.update()
        for trained in POLICIES:
            path = RESULTS / f"policy_{trained}.npz"
            policy = NeuralPolicy.read(path, rig)
            name = f"policy trained on {trained}"
            got = driven(envs["pressure_set"], policy, SEEDS)
            rows.append(row(plant, task, name, None, got))
            bar.update()
        for env in envs.values():
            env.close()
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
    """Drive, print, write."""
    target = parser(__doc__, RESULTS / "controller_scoreboard.json").parse_args().json
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
    print_and_write(page, target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
