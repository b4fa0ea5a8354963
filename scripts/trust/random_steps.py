"""Random rigs under random inputs with every step checked: is a state ever reached that cannot be?

    python scripts/trust/random_steps.py [--steps 1e8] [--seed 0] [--workers 1] [--kept FOLDER]
        [--json FILE]

A third of the batches run `pamsim.simulate`: a shipped rig with up to three effects that a
diagnosis knows, each number drawn from the range that a search may use, with another hysteresis
operator now and then, under valve openings, pulses or set points that change at random times, a
random load, and a random torque at a joint. The others play episodes of the environments of the
same rigs, half of them with on/off valves, with random actions and, in a third, randomized rigs,
loads and torques. `pamsim.checks` is on all the time.

A batch that reaches a state that cannot be is written down with its error, and done again without
the checks: if its outcome then reports that it broke down, no wrong number went unnoticed. Batches
are kept one by one: a run that was cut off goes on. Exits 1 if one failed unreported.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import pamsim
import pamsim.envs  # registers the environments
from pamsim.comparison.effects_on_rig import candidates
from pamsim.core.errors import InputError, InvariantError
from pamsim.engine.rig import Rig
from pamsim.recordings.recording import Outcome

sys.path.insert(0, str(Path(__file__).parents[1]))
from random_episodes import Seen
from records import Task, fingerprint, head, kept_rows, parser, print_and_write

BATCH = 96_000
"""Steps of a batch."""

TORQUE = {"mas20_arm": 5.0, "two_joint_arm": 3.0, "equimus_leg": 1.0}
"""Rig -> largest torque from outside [N m]."""

LOAD = 2.5  # [kg]
OPERATORS = ("bouc_wen", "maxwell_slip")
COMMANDS = ("valve", "pulse", "pressure_set")
RIGS, FRAME_SKIP = 8, 40
KINDS = ("simulate", "environment", "on_off")


def random_rig(name: str, rng: np.random.Generator) -> Rig:
    """A shipped rig with some effects of random size, whose time step fits them."""
    rig = pamsim.load_rig(name)
    if rng.random() < 0.2:
        rig = rig.with_operator(str(rng.choice(OPERATORS)))
    known, _ = candidates(rig)
    for number in rng.choice(len(known), rng.integers(0, 4), replace=False):
        free = known[number].parameters
        rig = rig.with_parameters({p.name: float(rng.uniform(p.low, p.high)) for p in free})
    return rig


def random_experiment(rig: Rig, rng: np.random.Generator) -> pamsim.Experiment:
    """Commands that change at random times, and a torque that runs between random values."""
    steps = BATCH * float(rig.model.opt.timestep)
    duration = float(np.round(steps, 2))
    times = np.concatenate([[0.0], np.cumsum(rng.exponential(0.2, int(duration / 0.2)) + 0.01)])
    times = times[times < duration]
    command, muscles = str(rng.choice(COMMANDS)), list(rig.muscles)
    drive = dict.fromkeys(muscles, command)
    top = rig.supply_pressure
    values = rng.uniform(-1.0, 1.0, (len(times), len(muscles)))
    values[rng.random(values.shape) < 0.2] = 0.0
    if command == "pressure_set":
        values = rng.uniform(0.0, top, values.shape)
    if rng.random() < 0.5:
        drive[next(iter(rig.joints))] = "torque"
        most = TORQUE[rig.name]
        values = np.column_stack([values, rng.uniform(-most, most, len(times))])
    return pamsim.Experiment(
        drive=drive,
        command_time=times,
        command_value=values,
        start_pressure=rng.uniform(0.0, top, len(muscles)),
        duration=duration,
        load=float(rng.uniform(0.0, LOAD)) if rig.file.load_body else 0.0,
    )


def simulated(name: str, rng: np.random.Generator) -> dict[str, Any]:
    """One run of `pamsim.simulate`."""
    refused = 0
    while True:
        rig = None
        try:
            rig = random_rig(name, rng)
            run = pamsim.simulate(rig, random_experiment(rig, rng))
            break
        except InputError:  # a combination that the rig, its time step or the effect refuses
            refused += 1
    top = rig.supply_pressure
    return {
        "steps": round(run.time[-1] / rig.model.opt.timestep) if len(run.time) else 0,
        "refused": refused,
        "reported": run.outcome is not Outcome.COMPLETED,
        "lowest": float(run.pressure.min(initial=top) / top),
        "highest": float(run.pressure.max(initial=0.0) / top),
    }


def played(name: str, rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """Episodes of the vector environment, of on/off valves or another kind of action."""
    wild = bool(rng.random() < 1.0 / 3.0)
    per_episode = 100
    rounds = max(1, round(BATCH / (RIGS * per_episode * FRAME_SKIP)))
    takes_load = bool(pamsim.load_rig(name).file.load_body)
    env = gymnasium.make_vec(
        "pamsim/Rig-v0",
        num_envs=RIGS,
        vectorization_mode="vector_entry_point",
        rig=name,
        action=kind if kind == "on_off" else str(rng.choice(("pressure_set", "valve"))),
        max_episode_steps=per_episode,
        frame_skip=FRAME_SKIP,
        task="disturbance" if wild else "step",
        load=(0.0, LOAD) if wild and takes_load else 0.0,
        randomize=wild,
    )
    top, seen = env.rigs.top_pressure, Seen()
    seed = int(rng.integers(2**31))
    env.action_space.seed(seed)
    for number in range(rounds):
        env.reset(seed=seed + number)
        seen.play(env, rng, per_episode)
    env.close()
    return {
        "steps": rounds * per_episode * FRAME_SKIP * RIGS,
        "refused": 0,
        "reported": seen.broken > 0,
        "lowest": seen.lowest / top,
        "highest": seen.highest / top,
    }


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """One batch with the switch on, and if it failed once more without, for its outcome."""
    task = kind, name, seed
    try:
        return one_batch(task, on=True)
    except InvariantError as error:
        row = {"steps": 0, "refused": 0, "failed": str(error)}
    return {**row, "reported": one_batch(task, on=False)["reported"]}


def one_batch(task: Task, on: bool) -> dict[str, Any]:
    """What a batch counts with `pamsim.checks` on or off."""
    kind, name, seed = task
    rng = np.random.default_rng([seed, KINDS.index(kind), list(TORQUE).index(name)])
    with pamsim.checks(on):
        return simulated(name, rng) if kind == "simulate" else played(name, rng, kind)


def main() -> int:
    """Run the batches, print and keep what was found."""
    asked = parser(__doc__, steps=1e8, seed=0, workers=1)
    asked.add_argument("--kept", type=Path, default=Path("out/random_steps"), metavar="FOLDER")
    given = asked.parse_args()
    per_seed = [(kind, name) for kind in KINDS for name in TORQUE]
    seeds = range(given.seed, given.seed + -(-round(given.steps / BATCH) // len(per_seed)))
    tasks = [(kind, name, seed) for seed in seeds for kind, name in per_seed]
    os.environ["PYTHONWARNINGS"] = "ignore"
    mark = fingerprint("pamsim", __file__)
    rows = kept_rows(run_one, tasks, given.kept, mark, given.workers)
    rows = {task: rows[task] for task in tasks}
    good = [row for row in rows.values() if "failed" not in row]
    failed = {f"{k} {n} {s}": row for (k, n, s), row in rows.items() if "failed" in row}
    result = {
        **head(f"python scripts/trust/random_steps.py --steps {given.steps:g} --seed {given.seed}"),
        "batches": Counter(f"{kind} {name}" for kind, name, _ in tasks),
        "steps": sum(row["steps"] for row in good),
        "refused": sum(row["refused"] for row in rows.values()),
        "lowest_pressure_over_supply": min(row["lowest"] for row in good),
        "highest_pressure_over_supply": max(row["highest"] for row in good),
        "broke_down": {name: row["failed"] for name, row in failed.items() if row["reported"]},
        "failed": {name: row["failed"] for name, row in failed.items() if not row["reported"]},
    }
    print_and_write(result, given.json)
    return 1 if result["failed"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
