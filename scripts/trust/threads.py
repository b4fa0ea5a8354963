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
from mujoco import rollout
from tqdm import tqdm

import pamsim
import pamsim.envs  # registers the environments
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, print_and_write

STEPS = 200
RIGS = ("mas20_arm", "two_joint_arm")


def simulated(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """Final state of `pamsim.simulate`."""
    pressures = rng.uniform(1e5, 4e5, (2, len(rig.muscles)))
    step = pamsim.pressure_step(*pressures, duration=0.1)
    state = pamsim.simulate(rig, step).completed().final_state
    assert state is not None
    return state


def stepped(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """By ``mj_step``."""
    mujoco.mj_step(model, data, STEPS)


def halves(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """By ``mj_step1`` and ``mj_step2``."""
    for _ in range(STEPS):
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)


def forward(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """By ``mj_forward`` and ``mj_Euler``."""
    for _ in range(STEPS):
        mujoco.mj_forward(model, data)
        mujoco.mj_Euler(model, data)


def scopes(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """In scopes that open and shut."""
    for _ in range(10):
        with pamsim.live(model):
            mujoco.mj_step(model, data, STEPS // 20)
        mujoco.mj_step(model, data, STEPS // 20)


def rolled_out(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """By ``mujoco.rollout``."""
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, start, kind)
    controls = np.tile(data.ctrl, (STEPS, 1))
    states, _ = rollout.rollout(model, mujoco.MjData(model), start, controls)
    mujoco.mj_setState(model, data, states.reshape(STEPS, -1)[-1], kind)


def driven(
    rig: Rig, rng: np.random.Generator, advance: Callable[[mujoco.MjModel, mujoco.MjData], None]
) -> FloatArray:
    """State after `STEPS` steps under random valve openings."""
    model = rig.model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, rng.uniform(1e5, 4e5, len(rig.muscles)).tolist())
    data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
    advance(model, data)
    return pamsim.save_state(model, data)


def episode(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """After steps of an environment."""
    env = gymnasium.make("pamsim/Rig-v0", rig=rig.name)
    observation, _ = env.reset(seed=int(rng.integers(2**31)))
    for _ in range(5):
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        observation = env.step(action)[0]
    env.close()
    return np.asarray(observation, dtype=float)


WAYS: dict[str, Callable[[Rig, np.random.Generator], FloatArray]] = {
    "simulated": simulated,
    **{
        advance.__name__: functools.partial(driven, advance=advance)
        for advance in (stepped, halves, forward, scopes, rolled_out)
    },
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


def another_library(stop: threading.Event) -> None:
    """Set and remove callbacks until `stop` is set."""
    names = ("act_dyn", "act_gain", "act_bias")
    while not stop.wait(0.001):
        for name in names:
            getattr(mujoco, f"set_mjcb_{name}")(lambda *_: 1e3)
        stop.wait(0.001)
        for name in names:
            getattr(mujoco, f"set_mjcb_{name}")(None)


def main() -> int:
    """Run, compare, print and keep the counts."""
    given = parser(__doc__, runs=1000, threads=4, seed=0).parse_args()
    seeds = range(given.seed, given.seed + given.runs)
    alone = [run(seed) for seed in tqdm(seeds, desc="alone", file=sys.stderr)]
    stop = threading.Event()
    disturber = threading.Thread(target=another_library, args=(stop,))
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
