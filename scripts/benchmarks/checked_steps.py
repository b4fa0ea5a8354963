"""What `pamsim.checks` costs: time of a step with the switch on and off.

    python scripts/benchmarks/checked_steps.py [--json FILE]

Rounds alternate in one process, so that a slow phase of the machine hits all of them; the ratios
are medians over rounds. ``bare`` is the switch off and without the plugin's own function after
each step, which guards against steps that evaluate muscles between time points.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from timing import finish, in_turn, parser

import pamsim
from pamsim.engine import plugin

ROUNDS, STEPS = 101, 2000


@contextmanager
def bare() -> Iterator[None]:
    """Without any function of the plugin after a step."""
    with pamsim.checks(False):
        entry = plugin.engine_entry(plugin.slot())
        kept, entry.advance = entry.advance, None
        try:
            yield
        finally:
            entry.advance = kept


HOW = {"on": pamsim.checks, "off": lambda: pamsim.checks(False), "bare": bare}


def seconds(model: mujoco.MjModel, data: mujoco.MjData, how: str) -> float:
    """Time of a step."""
    with HOW[how](), pamsim.live(model):
        began = time.perf_counter()
        mujoco.mj_step(model, data, STEPS)
        return (time.perf_counter() - began) / STEPS


def main() -> None:
    """Time them and print the ratios."""
    target = parser(__doc__).parse_args().json
    model = pamsim.load_rig("mas20_arm").model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (3e5, 2e5))
    data.ctrl[:] = (0.02, -0.01)
    timers = [functools.partial(seconds, model, data, how) for how in HOW]
    in_turn(timers, 1)
    times = dict(zip(HOW, in_turn(timers, ROUNDS), strict=True))
    result = {
        "microseconds": {how: round(1e6 * float(np.median(times[how])), 2) for how in HOW},
        "on_over_off": round(float(np.median(times["on"] / times["off"])), 2),
        "off_over_bare": round(float(np.median(times["off"] / times["bare"])), 2),
        "rounds": ROUNDS,
    }
    finish("checked_steps.py", result, target)


if __name__ == "__main__":
    main()
