"""Run one experiment on a rig and record it."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.kernel import gauge_pressure
from pamsim.actuator.regulation import regulator_time_constant
from pamsim.core.errors import InputError
from pamsim.core.experiment import Experiment
from pamsim.core.recording import Outcome, Recording
from pamsim.engine.callback import live
from pamsim.engine.rig import Rig, set_command
from pamsim.engine.state import reset, restore_state, save_state


def simulate(
    rig: Rig,
    experiment: Experiment,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    backend: str = "compiled",
    from_state: NDArray[np.float64] | None = None,
) -> Recording:
    """Run an experiment.

    The rig first comes to rest at the start pressures (held by the set-point regulator whatever the
    experiment's command), then time starts. Every sample is taken before the step that leaves it,
    so angle, pressure and tension belong to the same instant.

    Args:
        rig: see `pamsim.load_rig`.
        experiment: what to do. Its sampling period must be a whole number of time steps.
        timestep: [s]; the rig's own if left out.
        integrator: MJCF name such as ``implicitfast``; the rig's own if left out.
        backend: ``compiled`` or ``python``, see `pamsim.live`.
        from_state: ``final_state`` of an earlier recording to continue from instead of settling;
            the rig must be the same. Time goes on from there.

    Returns:
        The recording; if the run broke down, what was recorded before, with the outcome.

    Raises:
        InputError: if the experiment does not fit the rig or the time step.
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
    _check_regulators(rig, model.opt.timestep)
    steps = whole_steps(1.0 / experiment.sample_rate, model.opt.timestep)
    samples = 1 + round(experiment.duration * experiment.sample_rate)
    data = mujoco.MjData(model)
    with live(model, backend=backend):
        if from_state is None:
            _settle(model, data, experiment)
        else:
            restore_state(model, data, from_state)
        return _record(rig, model, data, experiment, samples, steps)


def whole_steps(period: float, timestep: float) -> int:
    """Number of time steps in a sampling period.

    Raises:
        InputError: if it is not whole; rounding it would stretch time unseen.
    """
    ratio = period / timestep
    steps = round(ratio)
    if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
        raise InputError(
            f"a sampling period of {period * 1e3:g} ms is not a whole number of time steps of"
            f" {timestep * 1e3:g} ms; choose a sample rate that divides {1.0 / timestep:g} Hz"
        )
    return steps


def _check_regulators(rig: Rig, timestep: float) -> None:
    # The regulators hold the start pressures in every experiment, whatever its command.
    for name, muscle in rig.muscles.items():
        limit = regulator_time_constant(muscle)
        if timestep > limit:
            raise InputError(
                f"a time step of {timestep * 1e3:g} ms is longer than the {limit * 1e3:.2g} ms in"
                f" which the pressure regulator of {name} settles; take a shorter step or a wider"
                " valve.regulator_band"
            )


def _settle(model: mujoco.MjModel, data: mujoco.MjData, experiment: Experiment) -> None:
    reset(model, data, experiment.start_pressure.tolist())
    set_command(model, "pressure")
    data.ctrl[:] = experiment.start_pressure
    mujoco.mj_step(model, data, round(experiment.settle / model.opt.timestep))
    set_command(model, experiment.command)
    data.time = 0.0


def _record(
    rig: Rig,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    experiment: Experiment,
    samples: int,
    steps: int,
) -> Recording:
    muscles = len(rig.muscles)
    start = data.time
    relative = np.arange(samples) / experiment.sample_rate
    commands = experiment.command_at(relative)
    angle = np.empty(samples)
    velocity = np.empty(samples)
    act = np.empty((samples, model.na))
    length = np.empty((samples, muscles))
    tension = np.empty((samples, muscles))
    final_state = save_state(model, data)
    position, rate = rig.angle_address, rig.velocity_address
    outcome, message, recorded = Outcome.COMPLETED, "ran to the end", samples
    for k in range(samples):
        broken = _breakdown(data, start + relative[k], 0.5 * model.opt.timestep)
        if broken is not None:
            outcome, reason = broken
            message = f"simulation broke down before t = {relative[k]:.4g} s: {reason}"
            recorded = k
            break
        data.ctrl[:] = commands[k]
        angle[k] = data.qpos[position]
        velocity[k] = data.qvel[rate]
        act[k] = data.act
        if k < samples - 1:
            mujoco.mj_step(model, data)
        else:
            final_state = save_state(model, data)
            mujoco.mj_forward(model, data)
        # Tendon lengths and forces are of the instant the step started from.
        length[k] = data.actuator_length
        tension[k] = -data.actuator_force
        if k < samples - 1 and steps > 1:
            mujoco.mj_step(model, data, steps - 1)
    keep = slice(0, recorded)
    return Recording(
        time=relative[keep],
        angle=angle[keep],
        velocity=velocity[keep],
        pressure=_pressures(model, act[keep], length[keep]),
        tension=tension[keep],
        command=commands[keep],
        command_kind=experiment.command,
        load=experiment.load,
        muscles=tuple(rig.muscles),
        outcome=outcome,
        message=message,
        final_state=final_state,
        meta={
            "rig": rig.name,
            "experiment": experiment.name,
            "timestep_s": float(model.opt.timestep),
            "sample_hz": experiment.sample_rate,
            "mujoco": mujoco.__version__,
        },
    )


def _breakdown(
    data: mujoco.MjData, expected_time: float, slack: float
) -> tuple[Outcome, str] | None:
    """What is wrong with the state, if anything; the engine itself would only print a warning."""
    if not (np.isfinite(data.act).all() and np.isfinite(data.qpos).all()):
        return (
            Outcome.NOT_FINITE,
            "a state is not finite; check parameters and start pressures, or take a smaller time"
            " step",
        )
    if data.warning.number.any():
        kind = mujoco.mjtWarning(int(np.flatnonzero(data.warning.number)[0]))
        return (
            Outcome.ENGINE_WARNING,
            f"MuJoCo warned of {kind.name.removeprefix('mjWARN_')}; take a smaller time step",
        )
    if abs(data.time - expected_time) > slack:
        return Outcome.TIME_STALLED, f"time is {data.time:.6g} s, not {expected_time:.6g} s"
    return None


def _pressures(
    model: mujoco.MjModel, act: NDArray[np.float64], length: NDArray[np.float64]
) -> NDArray[np.float64]:
    pressure = np.empty_like(length)
    for muscle in range(length.shape[1]):
        row = model.actuator_user[muscle].tolist()
        first = model.actuator_actadr[muscle]
        states = act[:, first : first + model.actuator_actnum[muscle]].tolist()
        lengths = length[:, muscle].tolist()
        pressure[:, muscle] = [
            gauge_pressure(row, a, at) for a, at in zip(states, lengths, strict=True)
        ]
    return pressure
