"""Steps per second of the full muscle law against MuJoCo's own <muscle>, on the same arm.

    python scripts/benchmarks/steps_per_second.py [--json FILE]

Peers: the built-in ``<muscle>`` on the same two tendons, and the same kernel as Python callback.
Rounds alternate between the peers in one process, so that a slow phase of the machine hits all of
them; a ratio is the median over rounds, and the record holds that of several runs.

Two more figures bound what a quicker kernel could reach: the engine with the muscles' plugin and
states and an empty law, and that with the exponentials and powers that the law takes from the C
library.
"""

from __future__ import annotations

import functools
import math
import os
import statistics
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import mujoco
import numba
import numpy as np
from numba import types
from timing import finish, in_turn, parser, seconds

import pamsim
from pamsim.engine import plugin
from pamsim.engine.mjcf import leave_out_visual_geoms
from pamsim.engine.rig import Rig

RUNS = 3
ROUNDS = 150
SECONDS_PER_RUN = 0.02
EMPTY, PYTHON = "pamsim, empty law", "pamsim, python"


def builtin_arm(rig: Rig) -> mujoco.MjModel:
    """The rig's MJCF with MuJoCo's built-in muscle on each tendon."""
    spec = mujoco.MjSpec.from_file(str(rig.file.mjcf))
    leave_out_visual_geoms(spec)  # as in the rig's own model
    for name, tendon in rig.file.tendons.items():
        actuator = spec.add_actuator()
        actuator.name = name
        actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
        actuator.target = tendon
        actuator.set_to_muscle(
            timeconst=[0.01, 0.04],
            tausmooth=0.0,
            range=[0.75, 1.05],
            force=1000.0,
            scale=200.0,
            lmin=0.5,
            lmax=1.6,
            vmax=1.5,
            fpmax=1.3,
            fvmax=1.2,
        )
        actuator.lengthrange = [-0.01, 0.01]
    model = spec.compile()
    model.dof_damping[:] = rig.model.dof_damping
    return model


@numba.cfunc(types.void(types.voidptr, types.voidptr, types.intc))
def no_rates(model: int, data: int, instance: int) -> None:
    """Rates of muscles whose law is empty."""


@numba.cfunc(types.void(types.voidptr, types.voidptr, types.intc, types.intc))
def no_forces(model: int, data: int, instance: int, capability: int) -> None:
    """Forces of them."""


@contextmanager
def empty_law() -> Iterator[None]:
    """Let the engine call functions that do nothing in the place of the kernel's."""
    entry = plugin.engine_entry(plugin.slot())
    kept = entry.actuator_act_dot, entry.compute
    entry.actuator_act_dot, entry.compute = no_rates.address, no_forces.address
    try:
        yield
    finally:
        entry.actuator_act_dot, entry.compute = kept


@numba.njit(error_model="numpy")
def c_library(steps: int, muscles: int, kappa: float, pressure: float) -> float:
    """What the law of one muscle takes from the C library in a step, and nothing else.

    Its pressure is mostly found in one round: four exponentials and a power. Force and flow take
    two exponentials and a power.
    """
    total = 0.0
    for step in range(steps):
        for muscle in range(muscles):
            x = -32.0 * (kappa + 1e-9 * step + 1e-3 * muscle)
            total += math.expm1(x) + math.expm1(0.9 * x) + math.expm1(0.8 * x) + math.expm1(0.7 * x)
            total += math.exp(0.6 * x) + math.expm1(0.5 * x)
            total += (pressure + step + muscle) ** 1.2
            total += (2.0 * pressure + step + muscle) ** (1.0 / 1.2 - 1.0)
    return total


def seconds_in_c_library(muscles: int) -> float:
    """Time per step that `c_library` takes [s]."""
    steps = 20_000
    c_library(1, muscles, 0.03, 3e5)
    return seconds(functools.partial(c_library, steps, muscles, 0.03, 3e5)) / steps


def one_run() -> dict[str, Any]:
    """Time all peers in turn."""
    rig = pamsim.load_rig("mas20_arm")
    ours = rig.model_for(command="valve")
    theirs = builtin_arm(rig)
    idle = rig.model_for(command="valve")
    idle.opt.gravity[:] = 0.0  # nothing holds the arm, which must not come to its stop
    ours_data, theirs_data = mujoco.MjData(ours), mujoco.MjData(theirs)
    pamsim.reset(ours, ours_data, (3e5, 2e5))
    ours_data.ctrl[:] = (0.02, -0.01)
    theirs_data.ctrl[:] = (0.4, 0.2)
    peers = {
        "pamsim, compiled": (ours, ours_data),
        "mujoco <muscle>": (theirs, theirs_data),
        EMPTY: (idle, mujoco.MjData(idle)),
        PYTHON: (ours, ours_data),
    }

    def per_step(peer: str, steps: int) -> float:
        backend = "python" if peer == PYTHON else "compiled"
        law = empty_law() if peer == EMPTY else nullcontext()
        with pamsim.live(ours, backend=backend), law:
            return seconds(functools.partial(mujoco.mj_step, *peers[peer], steps)) / steps

    counts = {peer: max(200, round(SECONDS_PER_RUN / per_step(peer, 2000))) for peer in peers}
    timers = [functools.partial(per_step, *one) for one in counts.items()]
    timers.append(functools.partial(seconds_in_c_library, ours.nu))
    *rates, in_library = 1.0 / in_turn(timers, ROUNDS)
    assert np.isfinite(ours_data.act).all()
    full, builtin_rate, bare, python = rates
    with_library = 1.0 / (1.0 / bare + 1.0 / in_library)
    medians = (float(np.median(values)) for values in rates)
    return {
        "steps_per_second": dict(zip(peers, medians, strict=True)),
        "full_law_over_builtin_muscle": float(np.median(full / builtin_rate)),
        "full_law_over_python_callback": float(np.median(full / python)),
        "empty_law_over_builtin_muscle": float(np.median(bare / builtin_rate)),
        "c_library_alone_over_builtin_muscle": float(np.median(with_library / builtin_rate)),
        "load_average": os.getloadavg()[0],
    }


def main() -> None:
    """Time the peers in several runs and print steps per second and ratios."""
    target = parser(__doc__).parse_args().json
    runs = [one_run() for _ in range(RUNS)]
    result: dict[str, Any] = {
        name: statistics.median(run[name] for run in runs)
        for name in runs[0]
        if name.endswith(("_muscle", "_callback"))
    }
    result |= {"runs": runs, "rounds": ROUNDS}
    finish("steps_per_second.py", result, target)


if __name__ == "__main__":
    main()
