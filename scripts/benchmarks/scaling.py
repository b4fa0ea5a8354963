"""How the cost of pamsim grows with the amount of work, as exponents.

    python scripts/benchmarks/scaling.py [--json FILE] [--rounds 30]

Of each kind of work several sizes are timed in turn, so that a slow phase of the machine hits all
of them; the best round of each counts, since a shared machine only ever adds time. The exponent is
the slope of log time by log size over all sizes, with its standard error. Time is the processor's,
in which waiting for it does not count.

Two threads of `simulate_batch` are timed against one by the clock on the wall, on step responses of
2 s: of shorter runs, setting up under Python's lock is a large part.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from scipy.stats import linregress
from timing import finish, in_turn, parser, seconds

import pamsim
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.engine.attach import attach, compile_model
from pamsim.engine.batch import simulate_batch
from pamsim.physics.hysteresis.fractional_maxwell import FractionalMaxwell
from pamsim.physics.hysteresis.preisach import Preisach
from pamsim.physics.muscle import Muscle
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.trial import Trial

Work = Callable[[], object]
STEPS = 400
DURATION = 0.2


def arm(joints: int, muscles: Sequence[Muscle]) -> mujoco.MjModel:
    """A chain of links, one joint each; the muscles pull on the first joint from both sides."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 5e-4
    body = spec.worldbody
    for i in range(joints):
        body = body.add_body(name=f"link_{i}", pos=[0.0, 0.0, 0.1 if i else 0.0])
        body.add_joint(name=f"joint_{i}", axis=[0.0, 1.0, 0.0])
        body.add_geom(size=[0.02, 0.0, 0.0], mass=0.1, contype=0, conaffinity=0)
    for i, muscle in enumerate(muscles):
        tendon = spec.add_tendon(name=f"tendon_{i}")
        tendon.wrap_joint("joint_0", -0.012 if i % 2 else 0.012)
        attach(spec, tendon=f"tendon_{i}", muscle=muscle)
    model = compile_model(spec)
    model.dof_damping[:] = 0.3
    return model


def steps_of(model: mujoco.MjModel) -> Work:
    """Time steps of a model from rest under pressure."""
    data = mujoco.MjData(model)

    def run() -> None:
        pamsim.reset(model, data, (2e5,) * model.nu)
        data.ctrl[:] = 0.02
        with pamsim.live(model):
            mujoco.mj_step(model, data, STEPS)
        assert np.isfinite(data.act).all()

    return run


def experiment(number: int) -> Experiment:
    """A short experiment at rest under set points of its own."""
    start = np.array([2e5 + 1e3 * number, 2e5])
    return Experiment(
        drive="pressure_set",
        command_time=np.zeros(1),
        command_value=start[np.newaxis],
        start_pressure=start,
        duration=DURATION,
        settle=0.0,
        name=f"trial_{number}",
    )


def batch(rig: pamsim.Rig, count: int, threads: int) -> Work:
    """A batch of simulations."""
    jobs = [(rig, experiment(number)) for number in range(count)]
    return lambda: simulate_batch(jobs, threads=threads)


def trial(rig: pamsim.Rig, number: int) -> Trial:
    """What a simulation of the rig measures."""
    planned = experiment(number)
    run = pamsim.simulate(rig, planned)
    return Trial(
        name=planned.name,
        protocol="constant",
        drive="pressure_set",
        load=0.0,
        time=run.time,
        command=np.repeat(planned.command_value, run.time.size, axis=0),
        measured={"angle": run.angle},
    )


def prediction(rig: pamsim.Rig, trials: tuple[Trial, ...]) -> Work:
    """The prediction that `calibrate` and `diagnose` make of trials for one set of parameters."""
    data = CalibrationData(sources=(), rig=rig.name, trials=trials, tables=())
    predictor = TrialPredictor(rig, data, threads=1)
    predictor.linearise_starts(rig)
    return lambda: predictor.predictions([rig])


def kinds() -> dict[str, tuple[tuple[int, ...], Callable[[int], Work]]]:
    """Kind of work -> sizes, and what does one size of it."""
    rig = pamsim.load_rig("mas20_arm")
    one, two = (replace(muscle, command="valve") for muscle in rig.muscles.values())
    assert one.hysteresis is not None
    loop = {"force_per_pressure": one.hysteresis.force_per_pressure}
    trials = tuple(trial(rig, number) for number in range(32))

    preisach = functools.partial(Preisach, low_contraction=-0.05, high_contraction=0.3, **loop)
    fractional = functools.partial(
        FractionalMaxwell, order=0.3, time_constant=1.0, span=0.05, **loop
    )

    def with_operator(operator: Preisach | FractionalMaxwell) -> Work:
        return steps_of(arm(1, [replace(one, hysteresis=operator)] * 2))

    doubling = (1, 2, 4, 8, 16, 32)
    return {
        "muscles": (doubling, lambda size: steps_of(arm(1, [one, two] * (size // 2) or [one]))),
        "joints": (doubling, lambda size: steps_of(arm(size, [one, two]))),
        "simulations": (doubling, lambda size: batch(rig, size, 1)),
        "trials": (doubling, lambda size: prediction(rig, trials[:size])),
        "preisach_levels": ((12, 25, 50, 100, 200), lambda n: with_operator(preisach(levels=n))),
        "fractional_branches": (
            (4, 8, 16, 32, 64),
            lambda n: with_operator(fractional(branches=n)),
        ),
    }


def best_of(works: Sequence[Work], rounds: int) -> list[float]:
    """Least processor time of each [s] over rounds in which they alternate."""
    timers = [functools.partial(seconds, work, time.process_time) for work in works]
    in_turn(timers, 1)
    return np.min(in_turn(timers, rounds), axis=1).tolist()


def threads_gains(rounds: int) -> list[float]:
    """How much quicker 16 step responses of 2 s, each from a rest of its own, are on two threads.

    Of each round, ascending: their median counts, since two threads are slowed more often than one.
    """
    rig = pamsim.load_rig("mas20_arm")
    starts = [2e5 + 1e3 * number for number in range(16)]
    jobs = [(rig, pamsim.pressure_step((p, p), (p, 1e5), duration=2.0)) for p in starts]
    works = [functools.partial(simulate_batch, jobs, threads=threads) for threads in (1, 2)]
    simulate_batch(jobs)
    one, two = in_turn((functools.partial(seconds, work) for work in works), rounds)
    return np.sort(one / two).tolist()


def main() -> None:
    """Time every kind of work and print its exponents."""
    options = parser(__doc__, rounds=30).parse_args()
    rows: list[dict[str, Any]] = []
    for name, (sizes, of_size) in kinds().items():
        times = best_of([of_size(size) for size in sizes], options.rounds)
        line = linregress(np.log(sizes), np.log(times))
        rows.append(
            {
                "work": name,
                "sizes": sizes,
                "seconds": times,
                "exponent": float(line.slope),
                "standard_error": float(line.stderr),
            }
        )
    gains = threads_gains(options.rounds)
    result = {
        "rows": rows,
        "two_threads_over_one": float(np.median(gains)),
        "range": [gains[len(gains) // 4], gains[-1 - len(gains) // 4]],
        "rounds": options.rounds,
    }
    finish("scaling.py", result, options.json)


if __name__ == "__main__":
    main()
