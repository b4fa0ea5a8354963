"""Processor time of a 480 x 480 frame of the environments against InvertedPendulum-v5's.

    python scripts/benchmarks/frames.py [--json FILE]

Each environment draws in a process of its own, since one process has one current OpenGL context.
Rounds alternate between them; a step stands before every frame and is not counted. A ratio is the
median over rounds. Processor time, not wall time: software OpenGL takes several threads.
"""

from __future__ import annotations

import functools
import os
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import gymnasium
import numpy as np
from timing import finish, in_turn, parser

from pamsim.envs import MAS20

PEER = "InvertedPendulum-v5"
SIZE = 480
ROUNDS, FRAMES = 15, 8

_drawn: list[Callable[[], float]] = []


def start(name: str) -> None:
    """Make an environment and draw its first frame, in a worker process."""
    env = gymnasium.make(name, render_mode="rgb_array", width=SIZE, height=SIZE)
    env.reset(seed=0)
    env.action_space.seed(0)

    def frame() -> float:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
        began = time.process_time()
        picture = env.render()
        seconds = time.process_time() - began
        if np.ptp(picture) == 0:
            raise RuntimeError(f"{name} draws nothing")
        return seconds

    frame()
    _drawn.append(frame)


def draw() -> float:
    """Median processor time of some frames [s], in a worker process."""
    return statistics.median(_drawn[0]() for _ in range(FRAMES))


def drawn(pool: ProcessPoolExecutor) -> float:
    """`draw` in a pool's process."""
    return pool.submit(draw).result()


def main() -> None:
    """Time the frames, print a table, write it if asked."""
    target = parser(__doc__).parse_args().json
    os.environ.setdefault("MUJOCO_GL", "egl")  # for the workers, which import MuJoCo afresh
    names = (PEER, *MAS20, "pamsim/Rig-v0")
    spawn = get_context("spawn")
    pools = {
        name: ProcessPoolExecutor(1, mp_context=spawn, initializer=start, initargs=(name,))
        for name in names
    }
    timers = (functools.partial(drawn, pool) for pool in pools.values())
    peer, *times = in_turn(timers, ROUNDS)
    rows = []
    for name, own in zip(names[1:], times, strict=True):
        seconds, ratios = float(np.median(own)), np.sort(own / peer).tolist()
        ratio, spread = statistics.median(ratios), [ratios[ROUNDS // 6], ratios[-1 - ROUNDS // 6]]
        rows.append(
            {
                "environment": name,
                "milliseconds": round(1e3 * seconds, 2),
                "ratio": round(ratio, 3),
                "middle_two_thirds": [round(side, 3) for side in spread],
            }
        )
    for pool in pools.values():
        pool.shutdown()
    page = {"peer": PEER, "rounds": ROUNDS, "rows": rows}
    finish("frames.py", page, target, "gymnasium")


if __name__ == "__main__":
    main()
