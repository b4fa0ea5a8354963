"""Steps per second of the environments against Gymnasium's InvertedPendulum-v5, at its frame skip.

    python scripts/benchmarks/environment_steps.py [--json FILE]

One arm against one pendulum, both as `gymnasium.make` gives them; 64 and 256 arms on one thread
against `SyncVectorEnv` of as many pendulums. Rounds alternate between the peers in one process, so
that a slow phase of the machine hits all of them; a ratio is the median over rounds. Random actions
all through, resets included. A pendulum's step is one of the RK4 integrator, four evaluations; an
arm's is one Euler step, one evaluation of mechanics, air and hysteresis of two muscles.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import gymnasium
import numpy as np
from timing import finish, in_turn, parser
from timing import seconds as seconds_of

from pamsim.envs import MAS20

VECTOR = "pamsim/PamArmPressure-v0"
PEER = "InvertedPendulum-v5"
FRAME_SKIPS = (2, 5, 10, 40)
"""The peer's own first, ours last."""
COUNTS = (64, 256)
ROUNDS = 15
SECONDS_PER_RUN = 0.15


def single(name: str, frame_skip: int) -> Callable[[int], None]:
    """Run one environment for some steps."""
    env = gymnasium.make(name, frame_skip=frame_skip)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(64)]

    def run(steps: int) -> None:
        for k in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[k % 64])
            if terminated or truncated:
                env.reset()

    return run


def many(env: gymnasium.vector.VectorEnv) -> Callable[[int], None]:
    """Run a vector environment for some steps of all."""
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(8)]

    def run(steps: int) -> None:
        for k in range(steps):
            env.step(actions[k % 8])

    return run


def compare(ours: Callable[[int], None], theirs: Callable[[int], None]) -> tuple[float, float]:
    """Median seconds per step of ours, and median of theirs by ours."""
    steps = [_calibrated(run) for run in (ours, theirs)]
    timers = (functools.partial(_per_step, *one) for one in zip((ours, theirs), steps, strict=True))
    own, other = in_turn(timers, ROUNDS)
    return float(np.median(own)), float(np.median(other / own))


def _per_step(run: Callable[[int], None], steps: int) -> float:
    return seconds_of(functools.partial(run, steps)) / steps


def _calibrated(run: Callable[[int], None]) -> int:
    run(5)
    return max(3, round(SECONDS_PER_RUN / _per_step(run, 20)))


def main() -> None:
    """Time the peers, print, write."""
    target = parser(__doc__).parse_args().json
    rows: list[dict[str, object]] = []
    for frame_skip in FRAME_SKIPS:
        alone = functools.partial(gymnasium.make, PEER, frame_skip=frame_skip)
        works = [(name, 1, single(name, frame_skip), single(PEER, frame_skip)) for name in MAS20]
        for count in COUNTS:
            arms = gymnasium.make_vec(
                VECTOR,
                num_envs=count,
                vectorization_mode="vector_entry_point",
                frame_skip=frame_skip,
                threads=1,
            )
            peers = gymnasium.vector.SyncVectorEnv([alone] * count)
            works.append((VECTOR, count, many(arms), many(peers)))
        for name, count, ours, theirs in works:
            own, ratio = compare(ours, theirs)
            rows.append(
                {
                    "environment": name,
                    "arms": count,
                    "frame_skip": frame_skip,
                    "steps_per_second": round(count / own),
                    "ratio": round(ratio, 3),
                }
            )
    page = {"peer": PEER, "rounds": ROUNDS, "rows": rows}
    finish("environment_steps.py", page, target, "gymnasium")


if __name__ == "__main__":
    main()
