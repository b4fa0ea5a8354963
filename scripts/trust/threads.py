"""Whether simulations in several threads equal those that run alone, to the bit.

    python scripts/trust/threads.py [--runs 1000] [--threads 4] [--seed 0] [--json FILE]

Each run draws a rig (one joint or two, with random parameters), an input and a way to step it:
`pamsim.simulate`, plain ``mj_step``, ``mj_step1`` and ``mj_step2``, ``mj_forward`` with
``mj_Euler``, ``mujoco.rollout``, an environment, or `pamsim.live` that opens and shuts between
steps. All runs are done one after the other, then again in threads, while another thread sets and
removes callbacks of the engine as another library would. A run fails if any number of its final
state differs. Exits 1 if one fails.
"""

from __future__ import annotations

import functools
import hashlib
import sys
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
from stepping_functions import CALLBACKS, FUNCTIONS, Function, another_library, nothing
from tqdm import tqdm

import pamsim
import pamsim.envs  # registers the environments
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, print_and_write

ROUNDS = 10
"""Calls of a function, of 20 steps each."""
RIGS = ("mas20_arm", "two_joint_arm")


def simulated(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """Final state of `pamsim.simulate`."""
    pressures = rng.uniform(1e5, 4e5, (2, len(rig.muscles)))
    step = pamsim.pressure_step(*pressures, duration=0.1)
    state = pamsim.simulate(rig, step).completed().final_state
    assert state is not None
    return state


def driven(rig: Rig, rng: np.random.Generator, function: Function) -> FloatArray:
    """State after many steps under random valve openings."""
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, rng.uniform(1e5, 4e5, len(rig.muscles)).tolist())
    data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
    return [function(model, data, nothing) for _ in range(ROUNDS)][-1]


def episode(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """After steps of an environment."""
    env = gymnasium.make("pamsim/Rig-v0", rig=rig.name)
    observation, _ = env.reset(seed=int(rng.integers(2**31)))
    for _ in range(5):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation = env.step(action)[0]
    env.close()
    return np.asarray(observation, dtype=float)


STEPPED = (
    "mj_step(nstep)", "mj_step1, mj_step2", "mj_forward, mj_Euler", "rollout, one thread",
    "pamsim.live, mj_step",
)  # fmt: skip
WAYS: dict[str, Callable[[Rig, np.random.Generator], FloatArray]] = {
    "simulated": simulated,
    **{name: functools.partial(driven, function=FUNCTIONS[name][0]) for name in STEPPED},
    "episode": episode,
}


def run(seed: int) -> str:
    """Digest of one run."""
    rng = np.random.default_rng(seed)
    rig = pamsim.load_rig(RIGS[rng.integers(len(RIGS))])
    rig = rig.with_parameters({"valve.conductance_fill": float(rng.uniform(1e-9, 3e-9))})
    return hashlib.sha256(WAYS[way(seed)](rig, rng).tobytes()).hexdigest()


def way(seed: int) -> str:
    """How a run is stepped."""
    return list(WAYS)[seed % len(WAYS)]


def disturb(stop: threading.Event) -> None:
    """Set and remove callbacks until `stop` is set."""
    while not stop.wait(0.001):
        with another_library(CALLBACKS[:3]):  # under the others the engine compiles no model
            stop.wait(0.001)


def main() -> int:
    """Run, compare, print and keep the counts."""
    given = parser(__doc__, runs=1000, threads=4, seed=0).parse_args()
    seeds = range(given.seed, given.seed + given.runs)
    alone = [run(seed) for seed in tqdm(seeds, desc="alone", file=sys.stderr)]
    stop = threading.Event()
    disturber = threading.Thread(target=disturb, args=(stop,))
    disturber.start()
    try:
        with ThreadPoolExecutor(given.threads) as pool:
            results = pool.map(run, seeds)
            together = list(tqdm(results, desc="threads", total=given.runs, file=sys.stderr))
    finally:
        stop.set()
        disturber.join()
    differ = [seed for seed, a, b in zip(seeds, alone, together, strict=True) if a != b]
    failed = Counter(way(seed) for seed in differ)
    result = {
        **head(
            f"python scripts/trust/threads.py --runs {given.runs}"
            f" --threads {given.threads} --seed {given.seed}"
        ),
        "runs": {one: sum(way(s) == one for s in seeds) for one in WAYS},
        "failed": {one: failed[one] for one in WAYS},
    }
    print_and_write(result, given.json)
    return 1 if differ else 0


if __name__ == "__main__":
    raise SystemExit(main())
