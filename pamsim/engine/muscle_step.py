"""The muscles' part of an engine step: one text, which numba compiles and Python runs.

The engine hands a plugin the addresses of mjModel and mjData. `pamsim.engine.structs` views both as
records, so ``data.time`` here is that of the struct, and arrays are read through `doubles` and
`integer`.
"""

from __future__ import annotations

import ctypes
import functools
import math
from types import SimpleNamespace
from typing import Any, TypeAlias

import mujoco
import numpy as np

from pamsim.core.units import FloatArray
from pamsim.physics.chamber_pressure import chamber_pressure
from pamsim.physics.invariants import (
    ABOVE_SUPPLY,
    FINITE,
    NOTHING,
    broken_invariant,
    not_finite,
)
from pamsim.physics.kernel import state_rates, tendon_force, tension
from pamsim.physics.muscle_valves import asks_too_much, cross_flow
from pamsim.physics.record import SIGNATURE, SIZE, STATE_NAMES, view
from pamsim.physics.supply import VALVE, fill_valve_of, sags, supply_sag

ModelStruct: TypeAlias = Any
DataStruct: TypeAlias = Any
Instance: TypeAlias = int

COUNT = len(STATE_NAMES)
"""States of a muscle that have a name; they are the last of its ``act``."""

_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
_NO_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)


# --- memory: each has a compiled counterpart in `pamsim.engine.memory` ---


def doubles(address: int, first: int, count: int) -> FloatArray:
    """View of some numbers of the array at an address; any unit."""
    numbers = (ctypes.c_double * count).from_address(address + 8 * first)
    return np.ctypeslib.as_array(numbers)


def memory_at(address: int, count: int) -> Any:
    """Some numbers of the array at an address, which are only read; any unit."""
    return doubles(address, 0, count).tolist()


def integer(address: int, index: int) -> int:
    """One number of the array of C integers at an address."""
    return ctypes.c_int.from_address(address + 4 * index).value


class _StatesView:
    """States of a muscle by name, read and written in place."""

    __slots__ = ("_numbers",)

    def __init__(self, numbers: FloatArray) -> None:
        self._numbers = numbers


def _state(place: int) -> property:
    def read(states: Any) -> float:
        return states._numbers.item(place)

    def write(states: Any, value: float) -> None:
        states._numbers[place] = value

    return property(read, write)


for _place, _name in enumerate(STATE_NAMES):
    setattr(_StatesView, _name, _state(_place))


@functools.lru_cache(maxsize=256)
def _viewed(row: bytes) -> SimpleNamespace:
    return view(np.frombuffer(row))


def muscle_at(address: int) -> Any:
    """Parameters of the muscle whose row is at an address; not to be written."""
    return _viewed(ctypes.string_at(address, 8 * SIZE))


def states_at(address: int) -> Any:
    """Named states of the muscle, the first of which is at an address."""
    return _StatesView(doubles(address, 0, COUNT))


def address_of(record: Any) -> int:
    """Address of a struct, or in compiled code of any record."""
    return record.address


def report(model: int, data: int, code: float, actuator: int, value: float, bound: float) -> None:
    """Note a broken invariant, see `pamsim.engine.checks`."""
    from pamsim.engine import checks

    checks.report(model, data, code, actuator, value, bound)


# --- the step ---


def row_of(model: ModelStruct, index: int) -> int:
    """Address of an actuator's parameters; 0 if it is no pamsim muscle."""
    if model.nuser_actuator < SIZE:
        return 0
    row = model.actuator_user + 8 * index * model.nuser_actuator
    return row if doubles(row, 0, 1)[0] == SIGNATURE else 0


def act_of(model: ModelStruct, states: int, index: int) -> int:
    """Address of an actuator's states in ``act`` or in its rates."""
    return states + 8 * integer(model.actuator_actadr, index)


def memory_size(model: ModelStruct, index: int) -> int:
    """Number of an actuator's states that are its memory of hysteresis; they come first."""
    return integer(model.actuator_actnum, index) - COUNT


def number_of(values: int, places: int, index: int) -> float:
    """An actuator's entry of an array that is addressed by another; any unit."""
    return doubles(values, integer(places, index), 1)[0]


def switched_off(model: ModelStruct, index: int) -> bool:
    """Whether the group of an actuator is among the disabled ones."""
    group = integer(model.actuator_group, index)
    return 0 <= group < 31 and (model.disableactuator >> group) & 1 == 1


def opposing_tension(model: ModelStruct, data: DataStruct, m: Any) -> float:
    """Tension of the muscle at the other end of a chain with backlash [N]; 0 without."""
    if m.chain.backlash == 0.0 or m.partner == 0.0:
        return 0.0
    other = int(m.partner) - 1
    if switched_off(model, other):
        return 0.0
    states, memory = act_of(model, data.act, other), memory_size(model, other)
    return tension(
        muscle_at(row_of(model, other)),
        states_at(states + 8 * memory),
        memory_at(states, memory),
        number_of(data.actuator_length, model.actuator_outadr, other),
        number_of(data.actuator_velocity, model.actuator_outadr, other),
    )


def flow_across(model: ModelStruct, data: DataStruct, index: int, back: float) -> float:
    """Mass flow that leaks in from the muscle at the other end of a chain [kg/s]; 0 without a leak.

    Args:
        model: struct of the engine.
        data: struct of the engine.
        index: of the muscle's actuator.
        back: time by which the states have moved on at their rates since the flow [s]: 0, or the
            time step after it.
    """
    m = muscle_at(row_of(model, index))
    if m.partner == 0.0:
        return 0.0
    other = int(m.partner) - 1
    fed = muscle_at(row_of(model, other))
    size = m.chamber.cross_leak_conductance + fed.chamber.cross_leak_conductance
    if size == 0.0 or switched_off(model, other):
        return 0.0
    pressure = _pressure_back(model, data, index, back)
    return cross_flow(m, fed, pressure, _pressure_back(model, data, other, back))


def _pressure_back(model: ModelStruct, data: DataStruct, index: int, back: float) -> float:
    """Absolute pressure in a muscle [Pa], see `flow_across`."""
    count = integer(model.actuator_actnum, index)
    now = doubles(act_of(model, data.act, index), 0, count)
    rates = doubles(act_of(model, data.act_dot, index), 0, count)
    then = np.empty(count)
    for i in range(count):
        then[i] = now[i] - back * rates[i] if back > 0.0 else now[i]
    memory = count - COUNT
    length = number_of(data.actuator_length, model.actuator_outadr, index)
    s = states_at(then.ctypes.data + 8 * memory)
    return chamber_pressure(muscle_at(row_of(model, index)), s, then[:memory], length)


def supply_fall(model: ModelStruct, data: DataStruct, index: int) -> float:
    """Fall of a muscle's supply by the flow to all muscles on it [Pa].

    Args:
        model: struct of the engine.
        data: struct of the engine.
        index: of the muscle's actuator.
    """
    m = muscle_at(row_of(model, index))
    valves = np.empty((model.nactuator, VALVE))
    on_line = 0
    for other in range(model.nactuator):
        row = row_of(model, other)
        if row == 0 or switched_off(model, other):
            continue
        fed = muscle_at(row)
        if fed.valve.supply_line != m.valve.supply_line:
            continue
        states, memory = act_of(model, data.act, other), memory_size(model, other)
        length = number_of(data.actuator_length, model.actuator_outadr, other)
        s = states_at(states + 8 * memory)
        fill_valve_of(
            fed,
            s,
            chamber_pressure(fed, s, memory_at(states, memory), length),
            number_of(data.ctrl, model.actuator_ctrladr, other),
            data.time,
            model.timestep,
            valves[on_line],
        )
        on_line += 1
    own = states_at(act_of(model, data.act, index) + 8 * memory_size(model, index))
    return supply_sag(m, own, valves[:on_line], model.timestep)


def step_rates(model: ModelStruct, data: DataStruct, instance: Instance) -> None:
    """Write the rates of all states of the muscles of a plugin instance.

    The tension is left in ``actuator_force`` until `step_forces` runs.

    Args:
        model: struct of the engine.
        data: struct of the engine.
        instance: of the plugin.
    """
    doubles(data.plugin_data, instance, 1)[0] = data.time
    for index in range(model.nactuator):
        if integer(model.actuator_plugin, index) != instance:
            continue
        count = integer(model.actuator_actnum, index)
        act, act_dot = act_of(model, data.act, index), act_of(model, data.act_dot, index)
        row = row_of(model, index)
        if row == 0 or switched_off(model, index):
            rates = doubles(act_dot, 0, count)
            for i in range(count):
                rates[i] = 0.0
            continue
        m, memory = muscle_at(row), count - COUNT
        pull = state_rates(
            m,
            states_at(act + 8 * memory),
            memory_at(act, memory),
            states_at(act_dot + 8 * memory),
            doubles(act_dot, 0, memory),
            number_of(data.actuator_length, model.actuator_outadr, index),
            number_of(data.actuator_velocity, model.actuator_outadr, index),
            number_of(data.ctrl, model.actuator_ctrladr, index),
            data.time,
            model.timestep,
            opposing_tension(model, data, m),
            supply_fall(model, data, index) if sags(m) else 0.0,
            flow_across(model, data, index, 0.0),
        )
        # Minus 0 for a slack muscle: a plain 0 is the engine's own.
        doubles(data.actuator_force, integer(model.actuator_outadr, index), 1)[0] = -pull


def step_forces(model: ModelStruct, data: DataStruct, instance: Instance) -> None:
    """Write the forces of the muscles of a plugin instance; arguments as `step_rates`.

    The engine's force lengthens the tendon; a muscle shortens it. The force is no number where the
    actuator's parameters are not those of a muscle, as after a way through a file with six digits,
    and under an integrator that evaluates the muscles between time points.
    """
    for index in range(model.nactuator):
        if integer(model.actuator_plugin, index) != instance:
            continue
        force = doubles(data.actuator_force, integer(model.actuator_outadr, index), 1)
        if switched_off(model, index):
            force[0] = 0.0
            continue
        row = row_of(model, index)
        if row == 0 or model.integrator == _RK4:
            force[0] = math.nan
            continue
        act, memory = act_of(model, data.act, index), memory_size(model, index)
        m, s = muscle_at(row), states_at(act + 8 * memory)
        length = number_of(data.actuator_length, model.actuator_outadr, index)
        velocity = number_of(data.actuator_velocity, model.actuator_outadr, index)
        pull = -force[0]
        if pull == 0.0 and math.copysign(1.0, pull) < 0.0:
            pull = tension(m, s, memory_at(act, memory), length, velocity)
        force[0] = -tendon_force(m, s, pull, length, velocity, model.timestep)


def step_end(model: ModelStruct, data: DataStruct, instance: Instance) -> None:
    """Leave no air after a step that began at another time than its rates were evaluated at.

    Such a step has evaluated the muscles between time points, as ``mj_RungeKutta`` does. Arguments
    as `step_rates`.
    """
    began = doubles(data.plugin_data, instance, 1)[0]
    if began + model.timestep == data.time or model.disableflags & _NO_ACTUATION:
        return
    for index in range(model.nactuator):
        if integer(model.actuator_plugin, index) == instance:
            count = integer(model.actuator_actnum, index)
            doubles(act_of(model, data.act, index), count - 1, 1)[0] = math.nan


def checked_step_end(model: ModelStruct, data: DataStruct, instance: Instance) -> None:
    """`step_end`, and report what the step has broken, see `pamsim.engine.checks`."""
    step_end(model, data, instance)
    if model.disableflags & _NO_ACTUATION:
        return
    at_model, at_data, found = address_of(model), address_of(data), np.empty(2)
    for index in range(model.nactuator):
        row = row_of(model, index)
        if integer(model.actuator_plugin, index) != instance or row == 0:
            continue
        if switched_off(model, index):
            continue
        count, act = integer(model.actuator_actnum, index), act_of(model, data.act, index)
        act_dot, out = act_of(model, data.act_dot, index), integer(model.actuator_outadr, index)
        sent = number_of(data.ctrl, model.actuator_ctrladr, index)
        m = muscle_at(row)
        if asks_too_much(m, sent):
            supply = m.valve.supply_pressure
            report(at_model, at_data, ABOVE_SUPPLY, index, sent, supply)
        states, rates = doubles(act, 0, count), doubles(act_dot, 0, count)
        place = not_finite(states)
        if place > 0:
            value = states[count - place]
            report(at_model, at_data, FINITE, index, value, float(place))
            return
        before = np.empty(count)
        for i in range(count):
            before[i] = states[i] - model.timestep * rates[i]
        memory = count - COUNT
        code = broken_invariant(
            m,
            states_at(before.ctypes.data + 8 * memory),
            before[:memory],
            states_at(act + 8 * memory),
            states_at(act_dot + 8 * memory),
            doubles(data.actuator_length, out, 1)[0],
            doubles(data.actuator_velocity, out, 1)[0],
            doubles(data.actuator_force, out, 1)[0],
            sent,
            data.time - model.timestep,
            model.timestep,
            flow_across(model, data, index, model.timestep),
            found,
        )
        if code > NOTHING:  # not where the laws could not be compiled, and the force is no number
            report(at_model, at_data, code, index, found[0], found[1])
            return
    moving = 0.0
    for place in doubles(data.qpos, 0, model.nq):
        moving += place
    for speed in doubles(data.qvel, 0, model.nv):
        moving += speed
    if not math.isfinite(moving):
        report(at_model, at_data, FINITE, -1, moving, 0.0)
