"""The kernel as plain Python functions of the muscles' plugin: slow, for a debugger."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine import checks
from pamsim.engine.structs import callback_offsets
from pamsim.physics.invariants import (
    ABOVE_SUPPLY,
    FINITE,
    NOTHING,
    broken_invariant,
    never_charged,
)
from pamsim.physics.kernel import state_rates, tendon_force, tension
from pamsim.physics.layout import AIR, is_muscle, slot
from pamsim.physics.muscle_valves import asks_too_much, fill_valve_of, line_sag, sags
from pamsim.physics.supply import VALVE

_PARTNER, _BACKLASH = slot("partner"), slot("chain.backlash")
_SUPPLY_LINE = slot("valve.supply_line")
_SUPPLY = slot("valve.supply_pressure")


@dataclass(frozen=True)
class _Muscle:
    """One muscle of a model, with views of the engine's arrays.

    Attributes:
        row: parameters.
        act: (n,) states.
        rates: (n,) of them.
        length: (1,) of the tendon [m].
        velocity: (1,) of it [m/s].
        force: (1,) on it [N].
        command: (1,).
    """

    row: list[float]
    act: NDArray[np.float64]
    rates: NDArray[np.float64]
    length: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    command: NDArray[np.float64]

    @property
    def tension(self) -> float:
        """Tension [N]."""
        at, speed = float(self.length[0]), float(self.velocity[0])
        return tension(self.row, self.act.tolist(), at, speed)


def rates(model: int, data: int, instance: int) -> None:
    """Write the rates of all states of the muscles of a plugin instance.

    Args:
        model: address of it.
        data: address of it.
        instance: of the plugin.
    """
    every = _muscles(model, data)
    timestep, time = _number(model, "timestep"), _number(data, "time")
    _doubles(data, "plugin_data", instance, 1)[0] = time
    for index in _of(instance, model, every):
        muscle = every[index]
        if _switched_off(model, index):
            muscle.rates[:] = 0.0
            continue
        state_rates(
            muscle.row,
            muscle.act.tolist(),
            muscle.rates,
            float(muscle.length[0]),
            float(muscle.velocity[0]),
            float(muscle.command[0]),
            time,
            timestep,
            _opposing(muscle, every),
            _sag(muscle, every, time, timestep),
        )


def forces(model: int, data: int, instance: int) -> None:
    """Write the forces of the muscles of a plugin instance.

    The engine's force lengthens the tendon; a muscle shortens it. The arguments are those of
    `rates`.
    """
    every = _muscles(model, data)
    timestep, integrator = _number(model, "timestep"), _code(model, "integrator")
    for index in _of(instance, model, every):
        muscle = every[index]
        if _switched_off(model, index):
            muscle.force[0] = 0.0
            continue
        at, speed = float(muscle.length[0]), float(muscle.velocity[0])
        pull = math.nan if integrator == mujoco.mjtIntegrator.mjINT_RK4 else muscle.tension
        act = muscle.act.tolist()
        muscle.force[0] = -tendon_force(muscle.row, act, pull, at, speed, timestep)


def advance(model: int, data: int, instance: int) -> None:
    """Leave no air after a step that began at another time than its rates were evaluated at.

    It has evaluated the muscles between time points. Arguments as of `rates`.
    """
    began = _doubles(data, "plugin_data", instance, 1)[0]
    if began + _number(model, "timestep") == _number(data, "time"):
        return
    if _code(model, "disableflags") & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
        return
    every = _muscles(model, data)
    for index in _of(instance, model, every):
        every[index].act[-AIR] = math.nan


def check(model: int, data: int, instance: int) -> None:
    """Report what the last step has broken, see `pamsim.engine.checks`; arguments as of `rates`."""
    advance(model, data, instance)
    if _code(model, "disableflags") & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
        return
    timestep, time = _number(model, "timestep"), _number(data, "time")
    every, found = _muscles(model, data), [0.0, 0.0]
    for index in _of(instance, model, every):
        muscle = every[index]
        if _switched_off(model, index):
            continue
        if never_charged(muscle.act.tolist()):
            return
        sent = float(muscle.command[0])
        if asks_too_much(muscle.row, sent):
            checks.report(model, data, ABOVE_SUPPLY, index, sent, float(muscle.row[_SUPPLY]))
        code = broken_invariant(
            muscle.row,
            (muscle.act - timestep * muscle.rates).tolist(),
            muscle.act.tolist(),
            muscle.rates.tolist(),
            float(muscle.length[0]),
            float(muscle.velocity[0]),
            float(muscle.force[0]),
            sent,
            time - timestep,
            timestep,
            found,
        )
        if code != NOTHING:
            checks.report(model, data, code, index, found[0], found[1])
            return
    moving = [
        number
        for field, size in (("qpos", "nq"), ("qvel", "nv"))
        for number in _doubles(data, field, 0, _integer(model, size))
    ]
    if not math.isfinite(sum(moving)):
        checks.report(model, data, FINITE, -1, sum(moving), 0.0)


def _of(instance: int, model: int, muscles: dict[int, _Muscle]) -> Iterator[int]:
    """Ids of the muscles of an instance."""
    plugin = _integers(model, "actuator_plugin", 1 + max(muscles, default=-1))
    return (index for index in muscles if plugin[index] == instance)


def _switched_off(model: int, index: int) -> bool:
    """Whether the group of an actuator is disabled."""
    group = _integers(model, "actuator_group", index + 1)[index]
    return 0 <= group < 31 and bool(_code(model, "disableactuator") >> group & 1)


def _opposing(muscle: _Muscle, every: dict[int, _Muscle]) -> float:
    """Tension of the muscle at the other end of a chain with backlash [N]."""
    if muscle.row[_BACKLASH] == 0.0 or muscle.row[_PARTNER] == 0.0:
        return 0.0
    return every[int(muscle.row[_PARTNER]) - 1].tension


def _sag(muscle: _Muscle, every: dict[int, _Muscle], time: float, timestep: float) -> float:
    """Fall of the supply's pressure by the flow to all muscles on it [Pa]."""
    if not sags(muscle.row):
        return 0.0
    valves: list[list[float]] = []
    for other in every.values():
        if other.row[_SUPPLY_LINE] == muscle.row[_SUPPLY_LINE]:
            at, command = float(other.length[0]), float(other.command[0])
            valves.append([0.0] * VALVE)
            fill_valve_of(other.row, other.act.tolist(), at, command, time, timestep, valves[-1])
    return line_sag(muscle.row, muscle.act.tolist(), valves, timestep)


def _muscles(model: int, data: int) -> dict[int, _Muscle]:
    """Id -> muscle of a model, in order."""
    count = _integer(model, "nactuator")
    width = _integer(model, "nuser_actuator")
    rows = _doubles(model, "actuator_user", 0, count * width).reshape(count, width)
    first, states = (
        _integers(model, name, count) for name in ("actuator_actadr", "actuator_actnum")
    )
    out, control = (
        _integers(model, name, count) for name in ("actuator_outadr", "actuator_ctrladr")
    )
    return {
        i: _Muscle(
            row=rows[i].tolist(),
            act=_doubles(data, "act", first[i], states[i]),
            rates=_doubles(data, "act_dot", first[i], states[i]),
            length=_doubles(data, "actuator_length", out[i], 1),
            velocity=_doubles(data, "actuator_velocity", out[i], 1),
            force=_doubles(data, "actuator_force", out[i], 1),
            command=_doubles(data, "ctrl", control[i], 1),
        )
        for i in range(count)
        if is_muscle(rows[i])
    }


def _doubles(struct: int, field: str, first: int, count: int) -> NDArray[np.float64]:
    """View of some entries of an array of numbers."""
    at = ctypes.c_void_p.from_address(struct + callback_offsets()[field]).value or 0
    return np.ctypeslib.as_array((ctypes.c_double * count).from_address(at + 8 * first))


def _integers(struct: int, field: str, count: int) -> list[int]:
    """An array of integers."""
    at = ctypes.c_void_p.from_address(struct + callback_offsets()[field]).value or 0
    return list((ctypes.c_int * count).from_address(at))


def _integer(struct: int, field: str) -> int:
    return ctypes.c_int64.from_address(struct + callback_offsets()[field]).value


def _number(struct: int, field: str) -> float:
    return ctypes.c_double.from_address(struct + callback_offsets()[field]).value


def _code(model: int, option: str) -> int:
    return ctypes.c_int.from_address(model + callback_offsets()[option]).value
