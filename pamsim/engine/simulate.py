"""Run one experiment on a rig and record it."""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, InvariantError
from pamsim.core.limits import RUN_STEPS
from pamsim.engine import checks
from pamsim.engine.delayed_command import arriving_commands
from pamsim.engine.external import External, act, as_driven, check_range, effort, external
from pamsim.engine.gauges import Gauges
from pamsim.engine.mjcf import may_collide
from pamsim.engine.preflight import check_shared, check_timestep, refuse_above_supply
from pamsim.engine.rig import Rig, load_rig
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
from pamsim.engine.stepping import live
from pamsim.engine.trace import empty_trace, engine_warnings_held, first_breakdown
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording

_CHECK_EVERY = 512
"""Samples between two checks for a breakdown."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """An experiment with its model.

    Attributes:
        rig: that runs it.
        experiment: what to do, its muscles in the rig's order.
        model: the rig's, with load, command and time step of the experiment.
        external: joints that it drives from outside.
        samples: of the recording.
        steps: time steps per sample.
    """

    rig: Rig
    experiment: Experiment
    model: mujoco.MjModel
    external: External
    samples: int
    steps: int


def simulate(
    rig: Rig | str | os.PathLike[str],
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
        rig: as `pamsim.load_rig` returns it, or a name or path that it takes.
        experiment: what to do. Its sampling period must be a whole number of time steps.
        timestep: [s]; the rig's own if left out.
        integrator: MJCF name such as ``implicitfast``; the rig's own if left out.
        backend: ``compiled`` or ``python``, see `pamsim.live`.
        from_state: ``final_state`` of an earlier recording to continue from instead of settling;
            the rig must be the same, without ``valve.delay``. Time goes on from there.
        each_step: called before every time step, with the command already in ``data.ctrl``, and
            free to change that, the muscles' parameters and states, and ``data.qfrc_applied`` of
            joints that the experiment does not drive.
            While the rig comes to rest, time is negative. If it has a memory, use one object per
            run.

    Returns:
        The recording; if the run broke down, what was recorded before, with the outcome.

    Raises:
        InputError: if the experiment does not fit the rig or the time step, or asks for more
            pressure than the supply has.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
        InvariantError: while `pamsim.checks` is on, if the run reaches a state that cannot be, or
            breaks down.
    """
    rig = rig if isinstance(rig, Rig) else load_rig(rig)
    if from_state is not None and any(_delays(rig)):
        raise InputError(
            "a run with valve.delay cannot be continued: its state does not hold the commands"
            " under way; simulate the whole experiment at once"
        )
    data = mujoco.MjData(rig.model)
    run = prepare(rig, experiment, timestep=timestep, integrator=integrator, data=data)
    refuse_above_supply(rig.muscles, run.experiment)
    with live(run.model, backend=backend), engine_warnings_held():
        if from_state is None:
            settle(run.model, data, run.experiment, run.external, each_step=each_step)
        else:
            restore_state(run.model, data, from_state)
        return record(run, data, backend=backend, each_step=each_step, from_rest=from_state is None)


def prepare(
    rig: Rig,
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    data: mujoco.MjData | None = None,
) -> Run:
    """Check an experiment against a rig and set up its model.

    Args:
        rig: to run it on.
        experiment: what is done.
        timestep: [s]; the rig's own if left out.
        integrator: MJCF name; the rig's own if left out.
        data: of a model of this rig file, overwritten; saves making one.

    Raises:
        InputError: if the experiment does not fit the rig or the time step, or the rig not itself.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
    """
    experiment = _in_order(experiment, rig)
    drives = experiment.drives
    model = rig.model_for(
        load=experiment.load,
        command=drives.muscles,
        timestep=timestep,
        integrator=integrator,
        data=data,
    )
    steps = (experiment.settle + experiment.duration) / model.opt.timestep
    if steps > RUN_STEPS:
        raise InputError(
            f"{experiment.duration:g} s in steps of {model.opt.timestep * 1e3:g} ms are"
            f" {steps:,.0f} steps; a run has {RUN_STEPS:,} at most"
        )
    on = external(model, drives)
    check_timestep(as_driven(model, on), rig.muscles)
    check_shared(model)
    check_range(model, drives, experiment.command_value)
    return Run(
        rig=rig,
        experiment=experiment,
        model=model,
        external=on,
        samples=1 + round(experiment.duration * experiment.sample_rate),
        steps=whole_steps(1.0 / experiment.sample_rate, model.opt.timestep),
    )


def _in_order(experiment: Experiment, rig: Rig) -> Experiment:
    """An experiment with its muscles in the rig's order.

    Raises:
        InputError: if it does not drive each of them, or a joint that the rig does not have.
    """
    drives, where = experiment.drives, f"rig {rig.name!r}"
    rig.names.check_driven(drives.joints, where)
    order = drives.order(tuple(rig.muscles), where)
    if order == sorted(order):
        return experiment
    muscles = order[: len(drives.muscles)]
    names = [drives.names[i] for i in muscles]
    moved = replace(drives, muscles=tuple(drives.muscles[i] for i in muscles), names=tuple(names))
    return replace(
        experiment,
        drive=moved.stated(names),
        command_value=experiment.command_value[:, order],
        start_pressure=experiment.start_pressure[muscles],
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
    from_rest: bool = True,
    tried: bool = False,
    above_supply: bool = False,
) -> Recording:
    """Run an experiment on a model from the present state on.

    Args:
        run: see `prepare`.
        data: of its model; stepped in place.
        backend: what evaluates the muscles, see `pamsim.live`.
        each_step: see `simulate`.
        from_rest: False where a motion that is imposed goes on.
        tried: True for one of many, whose outcome is read: to break down is no error then, with
            `pamsim.checks` on either.
        above_supply: True where set points may be above the supply's pressure.
    """
    model, experiment = run.model, run.experiment
    relative = np.arange(run.samples) / experiment.sample_rate
    expected = data.time + relative
    timestep = float(model.opt.timestep)
    commands = experiment.command_at(relative)
    plan = commands_of(run, commands)
    on = run.external
    if from_rest:
        _begin_moving(run, data, plan)
    final_state = save_state(model, data)
    trace = empty_trace(model, run.samples, len(on.joints))
    # Friction and the sprocket's teeth make the force on a tendon another than its muscle's.
    braked = any(m.friction.acts or m.chain.ripple for m in run.rig.muscles.values())
    pulls = np.empty_like(trace.force)

    gauges = Gauges(model, backend=backend)

    def pull(sample: int) -> None:
        now = slice(sample, sample + 1)
        gauges.set_parameters(0, model)
        pulls[sample] = gauges.tensions(trace.act[now], trace.length[now], trace.speed[now])[0]

    # A hook may change the muscles from step to step, so their tension is computed at once.
    hooked = each_step is not None
    each_pull = pull if braked and hooked else None
    native = backend == "compiled" and not hooked and not may_collide(model)
    last, broken = run.samples - 1, None
    for begin in range(0, run.samples, _CHECK_EVERY):
        end = min(begin + _CHECK_EVERY, run.samples)
        if native:
            take_compiled(model, data, plan, on, trace, begin, min(end, last))
        else:
            stop = min(end, last)
            take_interpreted(model, data, plan, on, trace, begin, stop, each_step, each_pull)
        if end == run.samples:
            note_state(data, trace, last)
            data.ctrl[:] = plan.command[plan.first[last]]
            data.qfrc_applied[on.dofs] = 0.0
            final_state = save_state(model, data)
            if on.joints:
                act(data, on, plan.external[plan.first[last]], timestep)
            if each_step is not None:
                each_step(model, data)
            mujoco.mj_forward(model, data)
            note_tendons(data, trace, last)
            trace.effort[last] = effort(data, on)
            if each_pull is not None:
                each_pull(last)
        broken = first_breakdown(trace, expected, 0.5 * timestep, begin, end)
        if broken is not None:
            break
    model.opt.timestep = timestep
    if above_supply:
        checks.allow_above_supply(model)
    outcome, message, recorded = Outcome.COMPLETED, "ran to the end", run.samples
    if broken is not None:
        recorded, outcome, reason = broken
        message = f"simulation broke down before t = {relative[recorded]:.4g} s: {reason}"
        if tried:
            checks.forget(model)
        elif checks.is_on():
            checks.raise_found([model])
            raise InvariantError(message)
    keep = slice(0, recorded)
    gauges = Gauges(model, backend=backend)
    tension = -trace.force[keep]
    if braked and each_step is None:
        tension = gauges.tensions(trace.act[keep], trace.length[keep], trace.speed[keep])
    elif braked:
        tension = pulls[keep]
    return Recording(
        time=relative[keep],
        joints=run.rig.joints,
        positions=trace.position[keep, run.rig.position_addresses],
        velocities=trace.velocity[keep, run.rig.velocity_addresses],
        pressure=gauges.pressures(trace.act[keep], trace.length[keep]),
        tension=tension,
        command=commands[keep],
        drive=experiment.drives.stated(tuple(run.rig.muscles)),
        load=experiment.load,
        muscles=tuple(run.rig.muscles),
        outcome=outcome,
        message=message,
        final_state=final_state,
        meta=origin(run, timestep),
        effort=_efforts(run, trace.effort[keep], commands[keep]),
    )


def origin(run: Run, timestep: float) -> dict[str, Any]:
    """What a recording states of where it came from.

    Args:
        run: that was recorded.
        timestep: in which it was stepped [s].
    """
    return {
        "rig": run.rig.name,
        "experiment": run.experiment.name,
        "timestep_s": timestep,
        "sample_hz": run.experiment.sample_rate,
        "mujoco": mujoco.__version__,
    }


def _efforts(
    run: Run, acted: NDArray[np.float64], commands: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Torque or force on each driven joint: as given, or what its imposed motion took."""
    given = commands[:, len(run.experiment.drives.muscles) :]
    values = np.where(run.external.inertia > 0.0, acted, given)
    return dict(zip(run.external.joints, values.T, strict=True))


def commands_of(run: Run, commands: NDArray[np.float64]) -> Plan:
    """When which commands reach the valves, and what acts on driven joints.

    Args:
        run: see `prepare`.
        commands: (n, m + j) at its samples.
    """
    drives, start = run.experiment.drives, run.experiment.start_pressure
    muscles, timestep = len(drives.muscles), float(run.model.opt.timestep)
    pairs = list(zip(_delays(run.rig), drives.muscles, strict=True))
    delays = [0.0 if kind == "measured" else delay for delay, kind in pairs]
    before = [
        p if kind == "pressure_set" else 0.0 for p, (_, kind) in zip(start, pairs, strict=True)
    ]
    between = np.array(drives.between)
    if not any(between):
        if not any(delays):
            return held_commands(commands, timestep, run.steps)
        return plan_of(arriving_commands(commands, before, delays, timestep, run.steps))
    ends = timestep * np.arange(1, run.samples * run.steps + 1)
    values = run.experiment.command_at(ends)
    values[:, ~between] = np.repeat(commands[:, ~between], run.steps, axis=0)
    plan = each_step_command(values[:, :muscles], timestep, run.steps)
    if any(delays):
        late = arriving_commands(values[:, :muscles], before, delays, timestep, 1)
        samples = (late[k : k + run.steps] for k in range(0, len(late), run.steps))
        plan = plan_of([list(itertools.chain(*sample)) for sample in samples])
    if not drives.joints:
        return plan
    ends = np.cumsum(plan.timestep * plan.count)
    acting = run.experiment.command_at(ends)[:, muscles:]
    middle = run.experiment.command_at(ends - 0.5 * plan.timestep)[:, muscles:]
    imposed = run.external.inertia > 0.0
    acting[:, ~imposed] = middle[:, ~imposed]
    last = int(plan.first[-2])
    if last >= 3:  # the motion goes on, or stopping at the last sample would show as a blow
        one, two, three = acting[last - 3 : last, imposed]
        acting[last, imposed] = one - 3.0 * two + 3.0 * three
    return replace(plan, external=acting)


def _begin_moving(run: Run, data: mujoco.MjData, plan: Plan) -> None:
    """Give joints whose motion is imposed its first speed, or it would begin with a blow."""
    on, first = run.external, run.experiment.command_value[0, len(run.experiment.drives.muscles) :]
    if len(plan.external) < 2:
        return
    for i in np.flatnonzero(on.inertia):
        one, two = plan.external[:2, i]
        data.qvel[on.dofs[i]] = (3.0 * one - two - 2.0 * first[i]) / plan.timestep[0]
