"""State of a model with muscles: charged, at rest, saved and restored bit for bit.

Physics states what one muscle at rest is (`pamsim.physics.rest_state`). `charge` puts all muscles
in that state where they are, `reset` does so in the model's initial position, and `settle` goes on
from there to where the whole rig rests; `quieten` ends that under the command to come.
"""

from __future__ import annotations

import math
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine import checks
from pamsim.engine.external import NOTHING, External, place
from pamsim.engine.mjcf import measure_tendons
from pamsim.engine.preflight import MuscleLimits, check_timestep
from pamsim.engine.rig import set_command
from pamsim.engine.stepping import EachStep, advance, muscle_ids
from pamsim.physics import rest_state
from pamsim.physics.chain import chain_length
from pamsim.physics.chamber_pressure import gauge_pressure
from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.record import Parameters, joined_states, slot, split_states, view
from pamsim.physics.static_muscle import muscle_length
from pamsim.physics.valves import MEASURED, PULSE, VALVE
from pamsim.recordings.experiment import Experiment

_FULL = mujoco.mjtState.mjSTATE_INTEGRATION

_REST_BLOCK = 0.1  # time between two checks whether a rig has come to rest [s]
_REST = 1e-10  # largest relative change of a state over that time in a rig at rest
_ROUNDING = 1e-9
_COMPRESSED = 10.0  # by no motion has a muscle's air so many times the pressure of its supply
_AWAY = (
    "creep.stiffness",
    "creep.stiffness_2",
    "first_stroke.force",
    "softening.share",
    "valve.dead_zone",
    "valve.hysteresis",
    "valve.least_set_point",
    "valve.regulator_dead_band",
)
_AWAY_MEANWHILE = [slot(name) for name in _AWAY]


@dataclass(frozen=True, kw_only=True)
class RestSteps:
    """Time steps in which a rig comes to rest, longer ones once it hardly moves.

    Where dry friction or hysteresis leaves a rig depends on how it swings to rest: steps that damp
    the swings leave it elsewhere.
    """

    later: float  # time step once it hardly moves [s]
    swinging: float = math.inf  # time step before, if shorter [s]
    swings: float = 0.0  # how long the rig swings [s]

    def phases(self, duration: float) -> tuple[tuple[float, float], ...]:
        """Time step and length of each part of a way to rest of some duration [s]."""
        if self.swinging >= self.later:
            return ((self.later, duration),)
        first = min(self.swings, duration)
        return (self.swinging, first), (self.later, duration - first)


def reset(
    model: mujoco.MjModel, data: mujoco.MjData, pressures: float | Sequence[float] = 0.0
) -> None:
    """Reset to the model's initial position with every chamber charged.

    After a bare ``mj_resetData`` the chambers are at the atmosphere and creep is not relaxed.

    Args:
        model: a model with pamsim muscles.
        data: its data, overwritten.
        pressures: gauge pressure [Pa] of all muscles, or one per muscle in actuator order.

    Raises:
        InputError: if the number of pressures is wrong, one is not above vacuum, or a muscle is
            longer than its fibres or has no volume where it is, or its law fails there.
    """
    mujoco.mj_resetData(model, data)
    charge(model, data, pressures)


def charge(
    model: mujoco.MjModel, data: mujoco.MjData, pressures: float | Sequence[float] | FloatArray
) -> None:
    """Set every chamber to a gauge pressure at the present position, and clear all other memory.

    It is for starts elsewhere than in the model's initial position, such as in a keyframe. Creep is
    relaxed there, and a lagged command has the value that keeps the valves shut: under the command
    ``pressure_set`` that pressure, else 0. Arguments and errors as of `reset`.
    """
    ids = muscle_ids(model)
    try:
        wanted = np.broadcast_to(np.asarray(pressures, dtype=float), len(ids))
    except ValueError:
        raise InputError(
            f"{np.size(pressures)} pressures for {len(ids)} muscles; give one, or one per muscle"
        ) from None
    measure_tendons(model, data)
    muscles = _muscles(model, data)
    for index, pressure, (m, act, length) in zip(ids, wanted.tolist(), muscles, strict=True):
        name = model.actuator(index).name
        _check_length(name, m, length, pressure)
        try:
            states = rest_state.rest(m, len(act), length, pressure)
        except (ArithmeticError, ValueError) as error:  # where compiled code has infinity or NaN
            at = traceback.extract_tb(error.__traceback__)[-1]
            raise InputError(
                f"the force law of muscle {name!r} fails where it starts, at {pressure:g} Pa"
                f" (gauge): {at.filename}, line {at.lineno}, `{at.line}`: {error}"
            ) from error
        air = states[-1]
        if not (isinstance(air, float) and np.isfinite(air) and air > 0.0):
            raise InputError(
                f"muscle {name!r} cannot be filled to {pressure:g} Pa (gauge): either that is not"
                " above vacuum (gauge pressures are zero at the atmosphere), or its force law has"
                f" no volume at its length of {muscle_length(m, length):.4g} m where it starts"
            )
        act[:] = states


def _check_length(name: str, m: Parameters, tendon: float, pressure: float) -> None:
    """Refuse a muscle that is longer than its fibres, which a gauge pressure may stretch."""
    length = muscle_length(m, chain_length(m.chain, tendon))
    stretched = 1.0 + m.braid.extensibility * max(pressure, 0.0)
    straight = m.braid.nominal_length * stretched / math.cos(m.braid.fibre_angle)
    if length > (1.0 + _ROUNDING) * straight and not law_pushes(m):
        raise InputError(
            f"muscle {name!r} would be {length:.4g} m long where it starts, but its fibres are"
            f" straight at {straight:.4g} m; give a smaller length_at_zero (of pamsim.attach, or"
            " mounting.length_at_zero of a rig), a longer braid.nominal_length or another position"
        )


def quieten(model: mujoco.MjModel, data: mujoco.MjData, pressures: FloatArray) -> None:
    """Have creep relaxed and valves shut at the present position; all other memory stays.

    The command of the model is already the one to come; pressures (m,) are gauge [Pa].
    """
    measure_tendons(model, data)
    for pressure, (m, act, length) in zip(pressures.tolist(), _muscles(model, data), strict=True):
        s, z = split_states(act)
        rest_state.quieten(m, s, length, pressure)
        act[:] = joined_states(s, z)


def pressures(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
    """Gauge pressures of all muscles at the last computed tendon lengths.

    Returns:
        (m,) [Pa], in actuator order.
    """
    return np.array(
        [gauge_pressure(m, *split_states(act), length) for m, act, length in _muscles(model, data)]
    )


def _muscles(
    model: mujoco.MjModel, data: mujoco.MjData
) -> Iterator[tuple[Parameters, FloatArray, float]]:
    """Parameters, states (a view) and length of the tendon [m] of each muscle."""
    for index in muscle_ids(model):
        first, count = model.actuator_actadr[index], model.actuator_actnum[index]
        length = float(data.actuator_length[model.actuator_outadr[index]])
        yield view(model.actuator_user[index]), data.act[first : first + count], length


def save_state(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
    """Everything the next step depends on, ``act`` and time included.

    Returns:
        (mj_stateSize,) vector for `restore_state`.
    """
    state = np.empty(mujoco.mj_stateSize(model, _FULL))
    mujoco.mj_getState(model, data, state, _FULL)
    return state


def restore_state(model: mujoco.MjModel, data: mujoco.MjData, state: ArrayLike) -> None:
    """Set what `save_state` saved; the continuation is then bit-identical.

    The lengths of the tendons are those of that state, for `pressures`.

    Raises:
        InputError: if the state is of another model.
    """
    state, size = np.asarray(state, dtype=float), mujoco.mj_stateSize(model, _FULL)
    if state.shape != (size,):
        raise InputError(f"state has shape {state.shape}, this model's is ({size},)")
    mujoco.mj_setState(model, data, state, _FULL)
    measure_tendons(model, data)


def refuse_other_drive(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Refuse a restored state of a run in which the states of muscles meant something else.

    Raises:
        InputError: naming the muscle.
    """
    measure_tendons(model, data)
    for index, (m, act, length) in zip(muscle_ids(model), _muscles(model, data), strict=True):
        s, z = split_states(act)
        pressure, atmosphere = gauge_pressure(m, s, z, length), m.chamber.atmosphere
        fits = pressure + atmosphere >= m.chamber.floor
        if m.command != MEASURED:
            fits &= pressure <= _COMPRESSED * (m.valve.supply_pressure + atmosphere)
        has_line = m.valve.line_lag + m.valve.line_slew_time > 0.0
        if has_line and m.command in (VALVE, PULSE):
            fits &= abs(s.line) <= 1.0
        if not fits:
            raise InputError(
                f"from_state: muscle {model.actuator(index).name!r} had another drive in the run"
                f" that it is the state of, and would begin at {pressure / 1e3:.4g} kPa with a"
                f" command of {s.line:.4g} on its line; give it the drive of that run"
            )


def settle(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    experiment: Experiment,
    on: External = NOTHING,
    *,
    steps: RestSteps | None = None,
    each_step: EachStep | None = None,
) -> None:
    """Bring a model to rest at the start pressures of an experiment and set time to 0.

    It ends early once nothing moves. Creep, which would delay that, is switched off meanwhile: a
    relaxed creep element carries no force at rest. So are first stroke and softening, which are to
    come, and so is what keeps the valves shut near the set point: the muscles come to rest at the
    start pressures themselves, however they were reached. Where hysteresis leaves them depends on
    the way there, which is the same for every command. Joints that are driven from outside are
    under the first torque or force, or held where their motion begins. The command of the model is
    that of the experiment afterwards. Time steps are the model's own if left out.
    """
    set_command(model, "pressure_set")
    pressures, timestep = experiment.start_pressure, model.opt.timestep
    first = experiment.command_value[0, len(experiment.drives.muscles) :]
    mujoco.mj_resetData(model, data)
    place(data, on, first)
    charge(model, data, pressures)
    kept = put_away(model)
    data.ctrl[:] = pressures
    data.time = -experiment.settle
    now = _configuration(data)
    steps = steps or RestSteps(later=timestep)
    for step, duration in steps.phases(experiment.settle):
        model.opt.timestep = step
        left, block = round(duration / step), max(1, round(_REST_BLOCK / step))
        while left > 0:
            before = now
            advance(model, data, pressures, min(block, left), each_step)
            left -= block
            place(data, on, first)
            now = _configuration(data)
            # Rounding keeps a joint at zero from ever being still relative to its own angle.
            still = np.abs(now - before) <= _REST * np.abs(now) + 1e-3 * _REST
            if still.all() and (np.abs(data.qvel) <= _REST).all():
                break
    model.opt.timestep = timestep
    put_back(model, kept)
    set_command(model, experiment.drives.muscles)
    quieten(model, data, pressures)
    data.time = 0.0


def put_away(model: mujoco.MjModel) -> FloatArray:
    """Switch off what is not to act while a rig comes to rest; returns it for `put_back`."""
    kept = model.actuator_user[:, _AWAY_MEANWHILE].copy()
    model.actuator_user[:, _AWAY_MEANWHILE] = 0.0
    return kept


def put_back(model: mujoco.MjModel, kept: FloatArray) -> None:
    """Switch on what `put_away` has switched off."""
    model.actuator_user[:, _AWAY_MEANWHILE] = kept


def settle_quickly(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    experiment: Experiment,
    limits: Sequence[MuscleLimits],
    steps: RestSteps,
    on: External = NOTHING,
) -> None:
    """`settle` in longer time steps, for a rig with `Rig.limits`.

    This leaves rest where it is, but memory a little off. It settles in the model's own time step
    where a muscle does not allow a longer one, or the rig breaks down in it.
    """
    timestep = float(model.opt.timestep)
    model.opt.timestep = steps.later
    try:
        check_timestep(model, limits)
        model.opt.timestep = timestep
        settle(model, data, experiment, on, steps=steps)
        if not data.warning.number.any() and np.isfinite(_configuration(data)).all():
            return
        checks.forget(model)
    except InputError:
        pass
    finally:
        model.opt.timestep = timestep
    settle(model, data, experiment, on)


def _configuration(data: mujoco.MjData) -> FloatArray:
    return np.concatenate([data.qpos, data.act])
