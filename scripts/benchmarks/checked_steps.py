"""What `pamsim.checks` costs: time of a step with the switch on and off.

    python scripts/benchmarks/checked_steps.py [--json FILE]

Rounds alternate in one process, so that a slow phase of the machine hits all of them; the ratios
are medians over rounds. ``bare`` is the switch off and without the plugin's own function after
each step, which guards against steps that evaluate muscles between time points.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco
import numpy as np

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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    target = parser.parse_args().json
    model = pamsim.load_rig("mas20_arm").model_for(command="valve")
    data = mujoco.MjData(model)
    pamsim.reset(model, data, (3e5, 2e5))
    data.ctrl[:] = (0.02, -0.01)
    for how in HOW:
        seconds(model, data, how)
    times: dict[str, list[float]] = {how: [] for how in HOW}
    for _ in range(ROUNDS):
        for how in HOW:
            times[how].append(seconds(model, data, how))
    ratio = {how: np.array(times[how]) / times["bare"] for how in HOW}
    result = {
        "microseconds": {how: round(1e6 * float(np.median(times[how])), 2) for how in HOW},
        "on_over_off": round(float(np.median(np.array(times["on"]) / times["off"])), 2),
        "off_over_bare": round(float(np.median(ratio["off"])), 2),
        "rounds": ROUNDS,
        "versions": {"mujoco": mujoco.__version__, "python": platform.python_version()},
        "command": "python scripts/benchmarks/checked_steps.py",
    }
    print(json.dumps(result, indent=1))
    if target is not None:
        target.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
