"""Many simulations at once on one device, each with its own parameters and commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.batch import rest_states
from pamsim.engine.command_plan import Plan
from pamsim.engine.preflight import refuse_above_supply
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import Run, prepare
from pamsim.gpu.worlds import Readings, Worlds
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
    """Run many experiments at once, on a GPU if there is one.

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

    Returns:
        One recording per job, in their order.

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
    times = np.arange(first.samples) / first.experiment.sample_rate
    commands = [run.experiment.command_at(times) for run in runs]
    plans = [run.plan(sent) for run, sent in zip(runs, commands, strict=True)]
    for number, (run, plan) in enumerate(zip(runs, plans, strict=True)):
        _check_shared(number, run, plan, first, plans[0])
    states = rest_states(runs, threads=threads)
    worlds.put({i: (run.model, states[i]) for i, run in enumerate(runs)})
    trace = _traced(worlds, plans)
    return [
        _recording(run, i, trace, times, sent, worlds.state(i))
        for i, (run, sent) in enumerate(zip(runs, commands, strict=True))
    ]


def _check_shared(number: int, run: Run, plan: Plan, first: Run, whole: Plan) -> None:
    """Refuse a job that cannot go in step with the first one."""
    if run.experiment.drives.joints:
        raise InputError("joints that are driven from outside do not run on a GPU; use simulate")
    if np.ptp(plan.timestep) > 1e-9 * run.model.opt.timestep:
        raise InputError(
            "a valve.delay that is no whole number of time steps does not run on a GPU; choose one"
            f" of whole {run.model.opt.timestep * 1e3:g} ms, or use simulate_batch"
        )
    shared = {
        "MJCF": (run.rig.file.mjcf, first.rig.file.mjcf),
        "number of states": (run.model.na, first.model.na),
        "time step": (run.model.opt.timestep, first.model.opt.timestep),
        "duration or sample rate": (run.samples, first.samples),
        "sampling period": (run.steps, first.steps),
        "drive or valve.delay": (plan.steps.tolist(), whole.steps.tolist()),
    }
    for what, (own, other) in shared.items():
        if own != other:
            raise InputError(
                f"job {number} has another {what} than the first; simulate it in a call of its own"
            )


def _traced(worlds: Worlds, plans: Sequence[Plan]) -> list[Readings]:
    """Readings at every sample."""
    first, count = plans[0].first, plans[0].steps
    command = np.stack([plan.command for plan in plans], axis=1)
    trace: list[Readings] = []
    for sample in range(len(first) - 1):
        trace.append(worlds.read())
        if sample < len(first) - 2:
            for stretch in range(first[sample], first[sample + 1]):
                worlds.step(command[stretch], int(count[stretch]))
    return trace


def _recording(
    run: Run,
    number: int,
    trace: Sequence[Readings],
    times: FloatArray,
    commands: FloatArray,
    final_state: FloatArray,
) -> Recording:
    """The recording of one world, up to where its state is no number."""
    position, velocity, pressure, tension = (
        np.stack([getattr(reading, name)[number] for reading in trace])
        for name in ("position", "velocity", "pressure", "tension")
    )
    healthy = np.isfinite(np.concatenate([position, velocity, pressure, tension], axis=1))
    broken = np.flatnonzero(~healthy.all(axis=1))
    count = int(broken[0]) if len(broken) else len(times)
    outcome, message = Outcome.COMPLETED, "ran to the end"
    if len(broken):
        outcome = Outcome.NOT_FINITE
        message = f"simulation broke down before t = {times[count]:.4g} s: a state is not finite"
    keep, experiment = slice(0, count), run.experiment
    return Recording(
        time=times[keep],
        joints=run.rig.joints,
        positions=position[keep, run.rig.position_addresses],
        velocities=velocity[keep, run.rig.velocity_addresses],
        pressure=pressure[keep],
        tension=tension[keep],
        command=commands[keep],
        drive=experiment.drives.stated(tuple(run.rig.muscles)),
        load=experiment.load,
        muscles=tuple(run.rig.muscles),
        outcome=outcome,
        message=message,
        final_state=final_state,
        meta=run.meta,
    )
