"""The kernel as plain Python callbacks: slow, for debugging."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.kernel import (
    fill_valve_of,
    line_sag,
    state_rates,
    tendon_force,
    tension,
)
from pamsim.actuator.layout import is_muscle, slot
from pamsim.engine.callback import muscle_ids
from pamsim.pneumatics.supply import VALVE

_PARTNER, _BACKLASH = slot("partner"), slot("chain.backlash")
_RESISTANCE, _SUPPLY_LINE = slot("valve.supply_resistance"), slot("valve.supply_line")


def dyn(model: mujoco.MjModel, data: mujoco.MjData, index: int) -> float:
    """``mjcb_act_dyn``: write the rates of one muscle's states into ``data.act_dot``."""
    row = model.actuator_user[index]
    if not is_muscle(row):
        return 0.0
    states = _states(model, index)
    out = model.actuator_outadr[index]
    rates = data.act_dot[states]
    state_rates(
        row.tolist(),
        data.act[states].tolist(),
        rates,
        float(data.actuator_length[out]),
        float(data.actuator_velocity[out]),
        float(data.ctrl[model.actuator_ctrladr[index]]),
        data.time,
        model.opt.timestep,
        _opposing(model, data, row),
        _sag(model, data, index),
    )
    return float(rates[-1])


def gain(model: mujoco.MjModel, data: mujoco.MjData, index: int) -> float:
    """``mjcb_act_gain``: 0 for a muscle; 1, the engine's own default, for any other."""
    return 0.0 if is_muscle(model.actuator_user[index]) else 1.0


def bias(model: mujoco.MjModel, data: mujoco.MjData, index: int) -> float:
    """``mjcb_act_bias``: minus the force, since the engine's lengthens the tendon."""
    row = model.actuator_user[index]
    if not is_muscle(row):
        return 0.0
    out = model.actuator_outadr[index]
    par, act = row.tolist(), data.act[_states(model, index)].tolist()
    length, velocity = float(data.actuator_length[out]), float(data.actuator_velocity[out])
    pull = tension(par, act, length, velocity)
    return -tendon_force(par, act, pull, length, velocity, model.opt.timestep)


def _opposing(model: mujoco.MjModel, data: mujoco.MjData, row: NDArray[np.float64]) -> float:
    """Tension of the muscle at the other end of a chain with backlash [N]."""
    if row[_BACKLASH] == 0.0 or row[_PARTNER] == 0.0:
        return 0.0
    other = int(row[_PARTNER]) - 1
    return tension(
        model.actuator_user[other].tolist(),
        data.act[_states(model, other)].tolist(),
        float(data.actuator_length[model.actuator_outadr[other]]),
        float(data.actuator_velocity[model.actuator_outadr[other]]),
    )


def _sag(model: mujoco.MjModel, data: mujoco.MjData, index: int) -> float:
    """Fall of the supply's pressure by the flow to all muscles on it [Pa]."""
    rows = model.actuator_user
    if rows[index, _RESISTANCE] == 0.0:
        return 0.0
    valves: list[list[float]] = []
    for other in muscle_ids(model):
        if rows[other, _SUPPLY_LINE] == rows[index, _SUPPLY_LINE]:
            par, act = rows[other].tolist(), data.act[_states(model, other)].tolist()
            length = float(data.actuator_length[model.actuator_outadr[other]])
            command = float(data.ctrl[model.actuator_ctrladr[other]])
            valves.append([0.0] * VALVE)
            fill_valve_of(par, act, length, command, data.time, model.opt.timestep, valves[-1])
    own = data.act[_states(model, index)].tolist()
    return line_sag(rows[index].tolist(), own, valves, model.opt.timestep)


def _states(model: mujoco.MjModel, index: int) -> slice:
    first = model.actuator_actadr[index]
    return slice(first, first + model.actuator_actnum[index])
