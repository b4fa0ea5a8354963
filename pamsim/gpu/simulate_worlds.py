"""Many simulations at once on one device, each with its own parameters and commands."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.engine.batch import rest_states
from pamsim.engine.command_plan import Plan
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import Run, Signals, prepare
from pamsim.gpu.worlds import Worlds
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording


def simulate_worlds(
    jobs: Sequence[tuple[Rig, Experiment]],
    *,
    timestep: float | None = None,
    precision: str = "float64",
    device: str | None = None,
    threads: int | None = None,
) -> list[Recording]:
    """Run many experiments at once, on a GPU if there is one: a recording per job, in their order.

    Takes what `pamsim.simulate_batch` takes and gives the same to the rounding of single precision,
    see docs/gpu.md. The rigs are one rig with different parameters (`Rig.with_parameters`), the
    experiments are of one duration, sample rate and kind of drive. They come to rest on the CPU,
    those with one start once for all of them.

    Args:
        jobs: rig and experiment of each simulation.
        timestep: [s]; the rig's own if left out.
        precision: of the muscles, see `pamsim.gpu.worlds.Worlds`.
        device: name of Warp's, such as ``cuda:0`` or ``cpu``; its own choice if left out.
        threads: how many come to rest at a time; one per processor if left out.

    Raises:
        InputError: if Warp is not installed, an experiment does not fit its rig, jobs differ in
            what they have to share, or a rig has what does not run on a GPU.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
    """
    if not jobs:
        return []
    runs = [prepare(rig, experiment, timestep=timestep) for rig, experiment in jobs]
    for run in runs:
        refuse_above_supply(run.rig.muscles, run.experiment)
    first = runs[0]
    worlds = Worlds(first.rig, first.model, len(runs), precision=precision, device=device)
    commands = [run.experiment.command_at(first.times) for run in runs]
    plans = [run.plan(sent) for run, sent in zip(runs, commands, strict=True)]
    whole, *others = (_shared(run, plan) for run, plan in zip(runs, plans, strict=True))
    for number, own in enumerate(others, 1):
        for what in (name for name, value in own.items() if value != whole[name]):
            raise InputError(
                f"job {number} has another {what} than the first; simulate it in a call of its own"
            )
    states = rest_states(runs, threads=threads)
    worlds.put({i: (run.model, states[i]) for i, run in enumerate(runs)})
    trace, recordings = _trace(worlds, plans), []
    for i, (run, sent) in enumerate(zip(runs, commands, strict=True)):
        signals, broken = Signals(*(signal[:, i] for signal in trace)), None
        healthy = np.isfinite(np.hstack(signals)).all(axis=1)
        if not healthy.all():
            broken = int(np.argmin(healthy)), Outcome.NOT_FINITE, "a state is not finite"
        recordings.append(run.recording(signals, sent, worlds.state(i), broken))
    return recordings


def _shared(run: Run, plan: Plan) -> dict[str, Any]:
    """What is the same in all jobs, which go in step; refuses one that cannot run on a GPU."""
    if run.experiment.drives.joints:
        raise InputError("joints that are driven from outside do not run on a GPU; use simulate")
    if run.experiment.approach:
        raise InputError("an approach at rest does not run on a GPU; use simulate")
    if np.ptp(plan.timestep) > 1e-9 * run.model.opt.timestep:
        raise InputError(
            "a valve.delay that is no whole number of time steps does not run on a GPU; choose one"
            f" of whole {run.model.opt.timestep * 1e3:g} ms, or use simulate_batch"
        )
    return {
        "MJCF": run.rig.file.mjcf,
        "number of states": run.model.actuator_actnum.tolist(),
        "time step": run.model.opt.timestep,
        "duration or sample rate": run.samples,
        "sampling period": run.steps,
        "drive, valve.delay or time of a command": plan.steps.tolist(),
    }


def _trace(worlds: Worlds, plans: Sequence[Plan]) -> Signals:
    """Signals at every sample, as arrays (samples, n, ...)."""
    first, count = plans[0].first, plans[0].steps
    command = np.stack([plan.command for plan in plans], axis=1)
    read = [worlds.read()]
    for begin, end in pairwise(first[:-1]):
        for stretch in range(begin, end):
            worlds.step(command[stretch], int(count[stretch]))
        read.append(worlds.read())
    return Signals(*map(np.array, zip(*read, strict=True)))
