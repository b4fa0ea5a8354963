"""State of a model with muscles: charge the chambers, save everything, restore it bit for bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine.preflight import check_lengths
from pamsim.engine.stepping import muscle_ids
from pamsim.physics import rest_state
from pamsim.physics.chamber_pressure import gauge_pressure
from pamsim.physics.record import Parameters, joined_states, split_states, view

FloatArray = NDArray[np.float64]
_FULL = mujoco.mjtState.mjSTATE_INTEGRATION


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
            longer than its fibres.
    """
    mujoco.mj_resetData(model, data)
    charge(model, data, pressures)


def charge(
    model: mujoco.MjModel, data: mujoco.MjData, pressures: float | Sequence[float] | FloatArray
) -> None:
    """Set every chamber to a gauge pressure at the present position, and clear all other memory.

    Creep is relaxed there, and a lagged command has the value that keeps the valves shut: under
    the command ``pressure`` that pressure, else 0.

    Args:
        model: a model with pamsim muscles.
        data: its data; ``act`` of the muscles is overwritten.
        pressures: gauge pressure [Pa] of all muscles, or one per muscle in actuator order.

    Raises:
        InputError: if the number of pressures is wrong, one is not above vacuum, or a muscle is
            longer than its fibres or has no volume where it is.
    """
    ids = muscle_ids(model)
    try:
        wanted = np.broadcast_to(np.asarray(pressures, dtype=float), (len(ids),))
    except ValueError:
        raise InputError(
            f"{np.size(pressures)} pressures for {len(ids)} muscles; give one, or one per muscle"
        ) from None
    _measure_tendons(model, data)
    check_lengths(model, data, wanted)
    for index, pressure, (m, act, length) in zip(
        ids, wanted.tolist(), _muscles(model, data), strict=True
    ):
        states = rest_state.rest(m, len(act), length, pressure)
        air = states[-1]
        if not (isinstance(air, float) and np.isfinite(air) and air > 0.0):
            raise InputError(
                f"muscle {index} cannot be filled to {pressure:g} Pa (gauge): either that is not"
                " above vacuum (gauge pressures are zero at the atmosphere), or its force law has"
                f" no volume at the tendon's length of {length:g} m"
            )
        act[:] = states


def quieten(model: mujoco.MjModel, data: mujoco.MjData, pressures: FloatArray) -> None:
    """Have creep relaxed and valves shut at the present position; all other memory stays.

    Args:
        model: a model with pamsim muscles whose command is already the one to come.
        data: its data; ``act`` is changed in place.
        pressures: (m,) gauge pressure of each muscle in actuator order [Pa].
    """
    _measure_tendons(model, data)
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


def _measure_tendons(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    # Positions and tendon lengths only: this part of the engine evaluates no muscle.
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    mujoco.mj_transmission(model, data)


def save_state(model: mujoco.MjModel, data: mujoco.MjData) -> FloatArray:
    """Everything the next step depends on, ``act`` and time included.

    Returns:
        (mj_stateSize,) vector for `restore_state`.
    """
    state = np.empty(mujoco.mj_stateSize(model, _FULL))
    mujoco.mj_getState(model, data, state, _FULL)
    return state


def restore_state(model: mujoco.MjModel, data: mujoco.MjData, state: FloatArray) -> None:
    """Set what `save_state` saved; the continuation is then bit-identical.

    Raises:
        InputError: if the state is of another model.
    """
    size = mujoco.mj_stateSize(model, _FULL)
    if state.shape != (size,):
        raise InputError(f"state has shape {state.shape}, this model's is ({size},)")
    mujoco.mj_setState(model, data, state, _FULL)
