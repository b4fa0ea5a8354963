"""64 step responses: `simulate_batch` against scipy's LSODA at equal error of the final angle.

    python scripts/benchmarks/batch_vs_lsoda.py [--json FILE] [--rounds 5]

LSODA integrates the equations of the independent plant (`tests.plant`), compiled, which
share no line with the engine's muscles and describe the same arm. Its relative tolerance is the
loosest that brings the median error of the final angles to that of pamsim at a time step, or
below. The error of each is that against its own solution in much shorter steps. Both come to rest
at the start pressures, pamsim in steps of 8 ms, and then take the step, on one thread. The script
fails where no tolerance is as good.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.extending import register_jitable
from scipy.integrate import solve_ivp
from timing import finish, in_turn, parser, seconds

import pamsim
from pamsim.core.units import FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.jit import reached_functions
from pamsim.engine.state import RestSteps

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.plant.rates import write_rates
from tests.plant.read_rig import Numbers, read_rig
from tests.plant.records import ANGLE
from tests.plant.run import at_zero, run

COUNT = 64
SETTLE, DURATION = 2.0, 2.0
TIMESTEPS = (5e-4, 1e-3, 2e-3, 4e-3, 8e-3)  # the first is the rig's own
REST_STEP = 8e-3  # of its settling; what memory that costs is in the error
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
REFERENCE_STEP, PLANTS_STEP = 2.5e-5, 5e-5


def experiments() -> list[pamsim.Experiment]:
    """Steps between pressures drawn evenly, with loads up to 2 kg."""
    rng = np.random.default_rng(0)
    return [
        replace(
            pamsim.pressure_step(
                rng.uniform(1e5, 4e5, 2),
                rng.uniform(0.5e5, 4.5e5, 2),
                duration=DURATION,
                load=float(rng.uniform(0.0, 2.0)),
            ),
            settle=SETTLE,
            sample_rate=1.0 / TIMESTEPS[-1],
        )
        for _ in range(COUNT)
    ]


def compiled_rates() -> Any:
    """``rates(t, y, joint, muscles, plays, commands, work, out)`` of the plant, as machine code."""
    for function in reached_functions(write_rates):
        register_jitable(function)

    @numba.njit(error_model="numpy")
    def rates(t, y, joint, muscles, plays, commands, work, out):
        write_rates(joint[0], muscles, plays, y, t, commands, True, 0.0, False, work, out)

    return rates


def by_lsoda(
    rates: Any, numbers: Numbers, start: FloatArray, final: FloatArray, tolerance: float
) -> float:
    """Final angle [rad]."""
    states, plays = at_zero(numbers, start)
    work, out = np.zeros((3, len(start))), np.zeros(len(states))

    def right_side(t: float, y: FloatArray, command: FloatArray) -> FloatArray:
        rates(t, y, numbers.joint, numbers.muscles, plays, command, work, out)
        return out.copy()

    scale = np.maximum(np.abs(states), 1e-3)
    for command, duration in ((start, SETTLE), (final, DURATION)):
        solution = solve_ivp(
            right_side,
            (0.0, duration),
            states,
            method="LSODA",
            rtol=tolerance,
            atol=tolerance * 1e-3 * scale,
            args=(command,),
        )
        if not solution.success:
            return float("nan")
        states = solution.y[:, -1]
    return float(states[ANGLE])


def timed(own: Callable[[], object], other: Callable[[], object], rounds: int) -> dict[str, Any]:
    """Median processor times [s] of both in turn, and the ratio with its spread."""
    timers = (partial(seconds, work, time.process_time) for work in (own, other))
    ours, theirs = in_turn(timers, rounds)
    ratios = theirs / ours
    return {
        "pamsim_s": float(np.median(ours)),
        "lsoda_s": float(np.median(theirs)),
        "lsoda_over_pamsim": float(np.median(ratios)),
        "range": [float(ratios.min()), float(ratios.max())],
    }


def main() -> None:
    """Find the tolerance, time both in turn, print and write."""
    args = parser(__doc__, rounds=5).parse_args()
    rig, steps = pamsim.load_rig("mas20_arm"), experiments()
    jobs = [(rig, step) for step in steps]
    plants = [read_rig(rig, step.load) for step in steps]
    ends = [step.start_pressure for step in steps], [step.command_value[-1] for step in steps]
    rates, names = compiled_rates(), tuple(rig.muscles)

    def batch(timestep: float, rest_step: float = REST_STEP) -> FloatArray:
        runs = simulate_batch(
            jobs, threads=1, timestep=timestep, rest_steps=RestSteps(later=rest_step)
        )
        return np.array([one.completed().angle[-1] for one in runs])

    def lsoda(tolerance: float) -> FloatArray:
        return np.array(
            [by_lsoda(rates, *one, tolerance) for one in zip(plants, *ends, strict=True)]
        )

    true_batch = batch(REFERENCE_STEP, REFERENCE_STEP)
    true_plant = np.array(
        [
            run(plant, step, rig=rig.name, muscles=names, step=PLANTS_STEP).angle[-1]
            for plant, step in zip(plants, steps, strict=True)
        ]
    )
    errors = {t: float(np.median(np.abs(lsoda(t) - true_plant))) for t in TOLERANCES}
    rows: list[dict[str, Any]] = []
    for timestep in TIMESTEPS:
        allowed = float(np.median(np.abs(batch(timestep) - true_batch)))
        good = [t for t, error in errors.items() if error <= allowed]
        if not good:
            raise SystemExit(f"no tolerance brings LSODA to {np.degrees(allowed):g} deg: {errors}")
        rows.append(timed(partial(batch, timestep), partial(lsoda, max(good)), args.rounds))
        rows[-1] |= {
            "timestep_ms": timestep * 1e3,
            "error_deg": float(np.degrees(allowed)),
            "lsoda_tolerance": max(good),
            "lsoda_error_deg": float(np.degrees(errors[max(good)])),
        }
    result = {
        "simulations": COUNT,
        "simulated_seconds_each": SETTLE + DURATION,
        "largest_difference_of_the_references_deg": float(
            np.degrees(np.abs(true_batch - true_plant).max())
        ),
        "rows": rows,
        "rounds": args.rounds,
    }
    finish("batch_vs_lsoda.py", result, args.json, "scipy")


if __name__ == "__main__":
    main()
