"""Run one experiment on a rig and record it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.experiment import Experiment
from pamsim.core.recording import Outcome, Recording
from pamsim.engine.backlash_check import check_backlash
from pamsim.engine.callback import live
from pamsim.engine.chamber_trace import gauge_pressures, tensions
from pamsim.engine.contacts import may_collide
from pamsim.engine.delayed_command import arriving_commands
from pamsim.engine.rig import Rig
from pamsim.engine.sampling import (
    Plan,
    each_step_command,
    held_commands,
    note_state,
    note_tendons,
    plan_of,
    take_compiled,
    take_interpreted,
)
from pamsim.engine.settle import EachStep, settle
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.supply_check import check_supply
from pamsim.engine.timestep_check import check_timestep
from pamsim.engine.trace import empty_trace, first_breakdown

_CHECK_EVERY = 64
"""Samples between two checks for a breakdown."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """An experiment with its model.

    Attributes:
        rig: that runs it.
        experiment: what to do.
        model: the rig's, with load, command and time step of the experiment.
        samples: of the recording.
        steps: time steps per sample.
    """

    rig: Rig
    experiment: Experiment
    model: mujoco.MjModel
    samples: int
    steps: int


def simulate(
    rig: Rig,
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    backend: str = "compiled",
    from_state: NDArray[np.float64] | None = None,
    each_step: EachStep | None = None,
) -> Recording:
    """Run an experiment.

    The rig first comes to rest at the start pressures (held by the set-point regulator whatever the
    experiment's command), then time starts. Every sample is taken before the step that leaves it,
    so angle, pressure and tension belong to the same instant. Creep is
    relaxed by then. Commands reach the valves late by ``valve.delay``; the recording holds them
    as commanded.

    Args:
        rig: see `pamsim.load_rig`.
        experiment: what to do. Its sampling period must be a whole number of time steps.
        timestep: [s]; the rig's own if left out.
        integrator: MJCF name such as ``implicitfast``; the rig's own if left out.
        backend: ``compiled`` or ``python``, see `pamsim.live`.
        from_state: ``final_state`` of an earlier recording to continue from instead of settling;
            the rig must be the same, without ``valve.delay``. Time goes on from there.
        each_step: called before every time step, with the command already in ``data.ctrl``, and
            free to change that, the muscles' parameters and states, and ``data.qfrc_applied``.
            While the rig comes to rest, time is negative. If it has a memory, use one object per
            run.

    Returns:
        The recording; if the run broke down, what was recorded before, with the outcome.

    Raises:
        InputError: if the experiment does not fit the rig or the time step.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
    """
    if from_state is not None and any(_delays(rig)):
        raise InputError(
            "a run with valve.delay cannot be continued: its state does not hold the commands"
            " under way; simulate the whole experiment at once"
        )
    run = prepare(rig, experiment, timestep=timestep, integrator=integrator)
    data = mujoco.MjData(run.model)
    with live(run.model, backend=backend):
        if from_state is None:
            settle(run.model, data, experiment, each_step=each_step)
        else:
            restore_state(run.model, data, from_state)
        return record(run, data, backend=backend, each_step=each_step)


def prepare(
    rig: Rig,
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
) -> Run:
    """Check an experiment against a rig and set up its model.

    Raises:
        InputError: if the experiment does not fit the rig or the time step, or the rig not itself.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
    """
    muscles = len(rig.muscles)
    if experiment.command_value.shape[1] != muscles:
        raise InputError(
            f"the experiment commands {experiment.command_value.shape[1]} muscles,"
            f" rig {rig.name!r} has {muscles}"
        )
    model = rig.model_for(
        load=experiment.load,
        command=experiment.command,
        timestep=timestep,
        integrator=integrator,
    )
    check_timestep(model, rig.muscles)
    check_backlash(model, rig.muscles)
    check_supply(model)
    return Run(
        rig=rig,
        experiment=experiment,
        model=model,
        samples=1 + round(experiment.duration * experiment.sample_rate),
        steps=whole_steps(1.0 / experiment.sample_rate, model.opt.timestep),
    )


def whole_steps(period: float, timestep: float) -> int:
    """Number of time steps in a sampling period.

    Raises:
        InputError: if it is not whole; rounding it would change the time scale.
    """
    ratio = period / timestep
    steps = round(ratio)
    if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
        raise InputError(
            f"a sampling period of {period * 1e3:g} ms is not a whole number of time steps of"
            f" {timestep * 1e3:g} ms; choose a sample rate that divides {1.0 / timestep:g} Hz"
        )
    return steps


def _delays(rig: Rig) -> list[float]:
    return [muscle.valve.delay for muscle in rig.muscles.values()]


def record(
    run: Run,
    data: mujoco.MjData,
    *,
    backend: str = "compiled",
    each_step: EachStep | None = None,
) -> Recording:
    """Run an experiment on a live model from the present state on.

    Args:
        run: see `prepare`.
        data: of its model; stepped in place.
        backend: the one the model is live with.
        each_step: see `simulate`.
    """
    model, experiment = run.model, run.experiment
    relative = np.arange(run.samples) / experiment.sample_rate
    expected = data.time + relative
    timestep = float(model.opt.timestep)
    commands = experiment.command_at(relative)
    plan = _plan(run, commands)
    final_state = save_state(model, data)
    trace = empty_trace(model, run.samples)
    # Friction and the sprocket's teeth make the force on a tendon another than its muscle's.
    braked = any(m.friction.acts or m.chain.ripple for m in run.rig.muscles.values())
    pulls = np.empty_like(trace.force)

    def pull(sample: int) -> None:
        now = slice(sample, sample + 1)
        pulls[sample] = tensions(
            model, trace.act[now], trace.length[now], trace.speed[now], backend=backend
        )

    # A hook may change the muscles from step to step, so their tension is computed at once.
    hooked = each_step is not None
    each_pull = pull if braked and hooked else None
    native = backend == "compiled" and not hooked and not may_collide(model)
    last, broken = run.samples - 1, None
    for begin in range(0, run.samples, _CHECK_EVERY):
        end = min(begin + _CHECK_EVERY, run.samples)
        if native:
            take_compiled(model, data, plan, trace, begin, min(end, last))
        else:
            stop = min(end, last)
            take_interpreted(model, data, plan, trace, begin, stop, each_step, each_pull)
        if end == run.samples:
            note_state(data, trace, last)
            data.ctrl[:] = plan.command[plan.first[last]]
            final_state = save_state(model, data)
            if each_step is not None:
                each_step(model, data)
            mujoco.mj_forward(model, data)
            note_tendons(data, trace, last)
            if each_pull is not None:
                each_pull(last)
        broken = first_breakdown(trace, expected, 0.5 * timestep, begin, end)
        if broken is not None:
            break
    model.opt.timestep = timestep
    outcome, message, recorded = Outcome.COMPLETED, "ran to the end", run.samples
    if broken is not None:
        recorded, outcome, reason = broken
        message = f"simulation broke down before t = {relative[recorded]:.4g} s: {reason}"
    keep = slice(0, recorded)
    tension = -trace.force[keep]
    if braked and each_step is None:
        tension = tensions(
            model, trace.act[keep], trace.length[keep], trace.speed[keep], backend=backend
        )
    elif braked:
        tension = pulls[keep]
    return Recording(
        time=relative[keep],
        joints=run.rig.joints,
        positions=trace.position[keep, run.rig.position_addresses],
        velocities=trace.velocity[keep, run.rig.velocity_addresses],
        pressure=gauge_pressures(model, trace.act[keep], trace.length[keep], backend=backend),
        tension=tension,
        command=commands[keep],
        command_kind=experiment.command,
        load=experiment.load,
        muscles=tuple(run.rig.muscles),
        outcome=outcome,
        message=message,
        final_state=final_state,
        meta={
            "rig": run.rig.name,
            "experiment": experiment.name,
            "timestep_s": timestep,
            "sample_hz": experiment.sample_rate,
            "mujoco": mujoco.__version__,
        },
    )


def _plan(run: Run, commands: NDArray[np.float64]) -> Plan:
    """When which commands reach the valves."""
    delays, start = _delays(run.rig), run.experiment.start_pressure
    timestep = float(run.model.opt.timestep)
    if run.experiment.command == "measured":
        ends = timestep * np.arange(1, run.samples * run.steps + 1)
        return each_step_command(run.experiment.command_at(ends), timestep, run.steps)
    if not any(delays):
        return held_commands(commands, timestep, run.steps)
    before = start.tolist() if run.experiment.command == "pressure" else [0.0] * len(start)
    return plan_of(arriving_commands(commands, before, delays, timestep, run.steps))
