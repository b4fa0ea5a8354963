"""Run one experiment on a rig and record it; a large step as a trial to identify from."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np

from pamsim.core.errors import InputError, InvariantError
from pamsim.core.limits import RUN_STEPS
from pamsim.core.units import FloatArray
from pamsim.engine import checks
from pamsim.engine.command_plan import Plan, command_plan
from pamsim.engine.external import External, act, as_driven, check_range, external, set_off
from pamsim.engine.gauges import Gauges
from pamsim.engine.mjcf import may_collide
from pamsim.engine.preflight import check_shared, check_timestep, refuse_above_supply
from pamsim.engine.rig import Rig, load_rig
from pamsim.engine.sampling import (
    compiled_loop,
    empty_trace,
    engine_memory,
    first_breakdown,
    note_state,
    note_tendons,
    take_samples,
)
from pamsim.engine.state import (
    put_away,
    put_back,
    quieten,
    refuse_other_drive,
    restore_state,
    save_state,
    settle,
)
from pamsim.engine.stepping import EachStep, engine_warnings_held, live
from pamsim.physics.chain import chain_ripples
from pamsim.physics.learned import learns
from pamsim.physics.valves import ValvePair
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.trial import Trial, TrialSet

_CHECK_EVERY = 512  # samples between two checks for a breakdown


class Signals(NamedTuple):
    """What a recording is made of: at n samples, or of n worlds at one instant.

    Attributes:
        position: (n, nq) [rad or m].
        velocity: (n, nv) [rad/s or m/s].
        pressure: (n, m) gauge pressures as sensors at the valves see them [Pa].
        tension: (n, m) of the muscles [N].
    """

    position: FloatArray
    velocity: FloatArray
    pressure: FloatArray
    tension: FloatArray


@dataclass(frozen=True)
class Run:
    """An experiment with its model."""

    rig: Rig
    experiment: Experiment  # its muscles in the rig's order
    model: mujoco.MjModel  # the rig's, with load, command and time step of the experiment
    external: External  # joints that it drives from outside
    samples: int  # of the recording
    steps: int  # time steps per sample

    @property
    def times(self) -> FloatArray:
        """(n,) of the samples [s]."""
        return np.arange(self.samples) / self.experiment.sample_rate

    @property
    def valves(self) -> list[ValvePair]:
        """(m,) of the muscles."""
        return [muscle.valve for muscle in self.rig.muscles.values()]

    def plan(self, commands: FloatArray) -> Plan:
        """When which commands reach the valves, of commands (n, m + j) at the samples."""
        imposed, timestep = self.external.inertia > 0.0, float(self.model.opt.timestep)
        return command_plan(self.experiment, commands, self.valves, imposed, timestep, self.steps)

    def recording(
        self,
        signals: Signals,
        commands: FloatArray,
        final_state: FloatArray,
        broken: tuple[int, Outcome, str] | None = None,
        effort: FloatArray | None = None,
    ) -> Recording:
        """What was recorded, up to the sample at which the run broke down, as an outcome, why.

        The signals and commands (n, m + j) are of all samples, the efforts (n, j) on driven joints.
        """
        names, recorded, outcome = tuple(self.rig.muscles), self.samples, Outcome.COMPLETED
        message = "ran to the end"
        if broken is not None:
            recorded, outcome, reason = broken
            end = self.times[recorded]
            message = f"simulation broke down before t = {end:.4g} s: {reason}"
        keep, driven = slice(0, recorded), self.experiment.drives.joints
        efforts = np.empty((recorded, 0)) if effort is None else effort[keep]
        return Recording(
            time=self.times[keep],
            joints=self.rig.joints,
            positions=signals.position[keep, self.rig.position_addresses],
            velocities=signals.velocity[keep, self.rig.velocity_addresses],
            pressure=signals.pressure[keep],
            tension=signals.tension[keep],
            command=commands[keep],
            drive=self.experiment.drives.stated(names),
            load=self.experiment.load,
            muscles=names,
            outcome=outcome,
            message=message,
            final_state=final_state,
            meta={
                "rig": self.rig.name,
                "experiment": self.experiment.name,
                "timestep_s": float(self.model.opt.timestep),
                "sample_hz": self.experiment.sample_rate,
                "mujoco": mujoco.__version__,
            },
            effort=dict(zip(driven, efforts.T, strict=True)),
        )


def simulate(
    rig: Rig | str | os.PathLike[str],
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    backend: str = "compiled",
    from_state: FloatArray | None = None,
    each_step: EachStep | None = None,
) -> Recording:
    """Run an experiment.

    The rig first comes to rest at the start pressures (held by the set-point regulator whatever the
    experiment's command), with creep relaxed, then time starts. Every sample is taken before the
    step that leaves it, so angle, pressure and tension belong to the same instant. Commands reach
    the valves late by ``valve.delay``, and smaller openings by ``valve.closing_delay`` more; the
    recording holds them as commanded.

    Args:
        rig: as `pamsim.load_rig` returns it, or a name or path that it takes.
        experiment: what to do. Its sampling period must be a whole number of time steps.
        timestep: [s]; the rig's own if left out.
        integrator: MJCF name such as ``implicitfast``; the rig's own if left out.
        backend: ``compiled`` or ``python``, see `pamsim.live`.
        from_state: ``final_state`` of an earlier recording to continue from instead of settling;
            the rig must be the same, without delays of its valves, and a pressure that was measured
            must be measured on. Time goes on from there.
        each_step: called before every time step, with the command already in ``data.ctrl``, and
            free to change that, the muscles' parameters and states, and ``data.qfrc_applied`` of
            joints that the experiment does not drive. While the rig comes to rest, time is
            negative. If it has a memory, use one object per run.

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
    data = mujoco.MjData(rig.model)
    run = prepare(rig, experiment, timestep=timestep, integrator=integrator, data=data)
    if from_state is not None and any(v.delay + v.closing_delay for v in run.valves):
        raise InputError(
            "a run with valve.delay or valve.closing_delay cannot be continued: its state does not"
            " hold the commands under way; simulate the whole experiment at once"
        )
    refuse_above_supply(rig.muscles, run.experiment)
    with live(run.model, backend=backend), engine_warnings_held():
        if from_state is None:
            settle(run.model, data, run.experiment, run.external, each_step=each_step)
            set_off(data, run.external, run.experiment, run.model.opt.timestep)
        else:
            restore_state(run.model, data, from_state)
            refuse_other_drive(run.model, data)
        recording = record(run, data, backend=backend, each_step=each_step)
        if recording.outcome is not Outcome.COMPLETED and checks.is_on():
            checks.raise_found([run.model])
            raise InvariantError(recording.message)
    return recording


def prepare(
    rig: Rig,
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    data: mujoco.MjData | None = None,
) -> Run:
    """Check an experiment against a rig and set up its model; arguments as of `simulate`.

    Data of the rig's model or a copy of it, overwritten, saves making one.

    Raises:
        InputError: if the experiment does not fit the rig or the time step, or the rig not itself.
        EngineError: if the rig's integrator cannot carry the muscles' memory.
    """
    drives, where = experiment.drives, f"rig {rig.name!r}"
    rig.names.check_driven(drives.joints, where)
    order = drives.order(tuple(rig.muscles), where)
    if order != sorted(order):  # the experiment names the muscles in an order of its own
        muscles = order[: len(drives.muscles)]
        experiment = replace(
            experiment,
            drive={drives.names[i]: drives.muscles[i] for i in muscles} | dict(drives.joints),
            command_value=experiment.command_value[:, order],
            start_pressure=experiment.start_pressure[muscles],
        )
        drives = experiment.drives
    model = rig.model_for(
        load=experiment.load,
        command=drives.muscles,
        timestep=timestep,
        integrator=integrator,
        data=data,
    )
    step, rate = float(model.opt.timestep), experiment.sample_rate
    steps = (experiment.settle + experiment.duration) / step
    if steps > RUN_STEPS:
        raise InputError(
            f"{experiment.duration:g} s in steps of {step * 1e3:g} ms are {steps:,.0f} steps; a run"
            f" has {RUN_STEPS:,} at most"
        )
    check_range(model, drives, experiment.command_value)
    on = external(model, drives)
    try:
        check_timestep(model, rig.limits)
    except InputError:  # what holds or moves joints adds inertia, which allows longer steps
        check_timestep(as_driven(model, on), rig.limits)
    check_shared(model)
    samples, each = 1 + round(experiment.duration * rate), whole_steps(1.0 / rate, step)
    return Run(rig, experiment, model, on, samples, each)


def whole_steps(period: float, timestep: float) -> int:
    """Number of time steps in a sampling period.

    Raises:
        InputError: if it is not whole; rounding it would change the time scale.
    """
    ratio = period / timestep
    steps = round(ratio) if math.isfinite(ratio) else 0
    if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
        raise InputError(
            f"a sampling period of {period * 1e3:g} ms is not a whole number of time steps of"
            f" {timestep * 1e3:g} ms; choose a sample rate that divides {1.0 / timestep:g} Hz"
        )
    return steps


def record(
    run: Run,
    data: mujoco.MjData,
    *,
    backend: str = "compiled",
    each_step: EachStep | None = None,
) -> Recording:
    """Record a run from the present state of its model's data on; arguments as of `simulate`."""
    model, experiment, on = run.model, run.experiment, run.external
    muscles, timestep, times = run.rig.muscles, float(model.opt.timestep), run.times
    expected, commands = data.time + times, experiment.command_at(times)
    plan, memory = run.plan(commands), engine_memory(model, data)
    trace, final_state = empty_trace(model, run.samples, len(on.dofs)), save_state(model, data)
    pressure, tension = np.empty((2, run.samples, len(muscles)))
    # Friction, teeth and what was learned make the force on a tendon another than its muscle's; a
    # hook may add them.
    braked = each_step is not None or any(
        m.friction.acts or learns(m.learned) or chain_ripples(m.chain) for m in muscles.values()
    )
    gauges = Gauges(model, backend=backend)

    def gauge(begin: int, end: int) -> None:
        now = slice(begin, end)
        gauges.set_parameters(0, model)
        pressure[now] = gauges.pressures(trace.act[now], trace.length[now])
        tension[now] = -trace.force[now]
        if braked:
            tension[now] = gauges.tensions(trace.act[now], trace.length[now], trace.speed[now])

    # A hook may change the muscles from step to step, so they are read at once.
    gauge_each = None if each_step is None else lambda sample: gauge(sample, sample + 1)
    native = backend == "compiled" and each_step is None and not may_collide(model)
    addresses = int(model._address), int(data._address)
    last, broken = run.samples - 1, None
    arrival = round(experiment.approach * experiment.sample_rate)
    kept = put_away(model) if arrival else None
    # A model that cannot be stepped raises an error at the first sample, in the engine's binding.
    stops = {0, min(arrival, last), *range(1, run.samples, _CHECK_EVERY), run.samples}
    for begin, end in pairwise(sorted(stops)):
        if kept is not None and begin == arrival:
            put_back(model, kept)
            quieten(model, data, experiment.start_pressure)
        fields = memory, plan, on, trace, begin, min(end, last)
        if native and begin:
            compiled_loop()(*addresses, *fields, None, None)
        else:
            take_samples(model, data, *fields, each_step, gauge_each)
        if end == run.samples:
            note_state(memory, trace, last)
            stretch = plan.first[last]
            data.ctrl[:] = plan.command[stretch]
            data.qfrc_applied[on.dofs] = 0.0
            final_state = save_state(model, data)
            act(data, on, plan.external[stretch], timestep)
            if each_step is not None:
                each_step(model, data)
            mujoco.mj_forward(model, data)
            note_tendons(memory, on, trace, last)
            if gauge_each is not None:
                gauge_each(last)
        broken = first_breakdown(trace, expected, 0.5 * timestep, begin, end)
        if broken is not None:
            break
    model.opt.timestep = timestep
    if kept is not None:
        put_back(model, kept)
    if each_step is None:
        gauge(0, run.samples if broken is None else broken[0])
    given = commands[:, len(muscles) :]  # what an imposed motion took is measured
    effort = np.where(on.inertia > 0.0, trace.effort, given)
    signals = Signals(trace.position, trace.velocity, pressure, tension)
    return run.recording(signals, commands, final_state, broken, effort)


def simulated_step(
    rig: str,
    *,
    pressure: Sequence[float] = (487e3, 0.0),
    load: float = 0.0,
    duration: float = 6.0,
) -> TrialSet:
    """A large step of a rig: all muscles rest at the highest set point, then take their own.

    Args:
        rig: name of a shipped rig, or path of a rig folder.
        pressure: set points after the step, gauge [Pa].
        load: mass on the arm [kg].
        duration: [s].

    Raises:
        InputError: as `pamsim.simulate`.
        SimulationError: if the run broke down.
    """
    loaded = load_rig(rig)
    start = [max(pressure, default=0.0)] * len(pressure)
    step = pressure_step(start, pressure, duration=duration, load=load, name="simulated step")
    run = simulate(loaded, step).completed()
    trial = Trial(
        name="simulated_step",
        protocol="simulated_step",
        drive=run.drive,
        load=run.load,
        time=run.time,
        command=run.command,
        measured=run.signals(),
        muscle_names=run.names.named_muscles,
    )
    return TrialSet(rig=loaded.name, trials=(trial,))
