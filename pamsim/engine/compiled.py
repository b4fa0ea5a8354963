"""The kernel compiled to native function pointers that the engine calls without Python.

The laws are ordinary Python; here the functions the kernel reaches are handed to numba as they
stand. The machine code is cached on disk under a key that covers their source text, the constants
they use and the struct offsets, because numba alone would notice an edit only in this file.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable

from pamsim.core.compile_notice import compile_notice
from pamsim.engine.laws import Laws
from pamsim.engine.structs import callback_offsets
from pamsim.engine.user_laws import declare
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.exponential import SixParameter
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.kernel import state_rates, tendon_force, tension
from pamsim.physics.layout import AIR, SIGNATURE, SIZE, slot
from pamsim.physics.muscle_valves import fill_valve_of, line_sag, sensed_pressure
from pamsim.physics.supply import VALVE

_POINTER_SIZE, _INT_SIZE = 8, 4
_RK4 = int(mujoco.mjtIntegrator.mjINT_RK4)
NO_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
"""Option of a model whose actuators the engine leaves out."""
_PARTNER, _BACKLASH = slot("partner"), slot("chain.backlash")
_RESISTANCE, _SUPPLY_LINE = slot("valve.supply_resistance"), slot("valve.supply_line")
_SQUARE = slot("valve.supply_square")

_MOSTLY_OFF = (
    "chain.ripple",
    "chain.backlash",
    "chain.compliance",
    "friction.stribeck_force",
    "friction.coulomb_force",
    "friction.breakaway_force",
    "friction.tension_share",
    "braid.friction",
    "creep.stiffness",
    "creep.stiffness_2",
    "parallel_hysteresis.force",
    "parallel_hysteresis.force_per_pressure",
    "end_shape.loss",
    "threshold.pressure",
    "chamber.heat_rate",
    "chamber.leak_conductance",
    "chamber.laminar_leak_conductance",
    "valve.line_lag",
    "valve.line_slew_time",
    "valve.travel_time",
    "valve.dead_zone",
    "valve.tube_resistance",
    "valve.supply_resistance",
    "valve.supply_square",
)
"""Parameters that leave an effect out when they are 0."""

_USUAL = {
    slot("force.law"): FORCE_LAWS.code(SixParameter),
    slot("hysteresis.law"): OPERATORS.code(BoucWen),
    **dict.fromkeys(map(slot, _MOSTLY_OFF), 0.0),
}
"""What the rows of most muscles hold, for which the time step is compiled a second time."""


@dataclass(frozen=True)
class Natives:
    """Function pointers for the muscles' plugin and for ``mjcb_time``, and laws along a run.

    A step whose rates were last evaluated at another time than its beginning has evaluated the
    muscles between time points, as ``mj_RungeKutta`` does: ``advance`` then leaves no air, and the
    forces are not a number.

    The engine asks for the time a dozen times in each step, for its timers; the clock answers 0.

    ``pressures`` and ``pulls`` take a muscle's row, its states (n, s), its lengths (n,) and, the
    second, its rates (n,), and write gauge pressures and tensions (n,). They are compiled with the
    rest, which has just compiled their laws: in a process of their own it takes ten times as long.
    """

    act_dot: Any
    compute: Any
    advance: Any
    clock: Any
    pressures: Any
    pulls: Any


@intrinsic  # numba supplies the typing context: the function is called with the address alone
def as_pointer(typingctx: Any, address: Any) -> Any:
    """Turn an address read from a struct into something `numba.carray` accepts."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@register_jitable
def keyed_by(key: Any) -> None:
    """Make a callback close over its key and so enter it in numba's cache key; does nothing."""


@register_jitable
def doubles(address: Any, first: Any, count: Any) -> Any:
    """View of ``count`` mjtNums from the ``first`` of the array at an address."""
    pointer = as_pointer(address + 8 * first)  # pyright: ignore[reportCallIssue]
    return numba.carray(pointer, (count,), np.float64)


@register_jitable
def entry(address: Any, index: Any) -> Any:
    """One entry of the int array at an address."""
    pointer = as_pointer(address + 4 * index)  # pyright: ignore[reportCallIssue]
    return numba.carray(pointer, (1,), np.int32)[0]


@register_jitable
def muscle_row(address: Any, width: Any, index: Any) -> Any:
    """Parameter row of one actuator; empty if it is not a pamsim muscle."""
    if width < SIZE:
        return doubles(address, 0, 0)
    row = doubles(address, index * width, SIZE)
    if row[0] != SIGNATURE:
        return doubles(address, 0, 0)
    return row


@register_jitable
def switched_off(groups: Any, index: Any, disabled: Any) -> Any:
    """Whether the group of an actuator is among the disabled ones."""
    group = entry(groups, index)
    return 0 <= group < 31 and (disabled >> group) & 1 == 1


def _compile(key: str, word: Mapping[str, int]) -> tuple[Any, Any, Any, Any]:
    """Compile the plugin's functions.

    The inner functions close over nothing but numbers and a string: numba makes its cache key from
    them, and functions among them would give a new key in every process.

    Args:
        key: fingerprint of the laws.
        word: position of each struct field, in units of eight bytes; of the codes among the
            options in units of four.
    """
    actuators, nuser, user = word["nactuator"], word["nuser_actuator"], word["actuator_user"]
    actadr, actnum = word["actuator_actadr"], word["actuator_actnum"]
    ctrladr, outadr = word["actuator_ctrladr"], word["actuator_outadr"]
    plugin, group = word["actuator_plugin"], word["actuator_group"]
    time, ctrl, act, act_dot = word["time"], word["ctrl"], word["act"], word["act_dot"]
    length, velocity = word["actuator_length"], word["actuator_velocity"]
    force = word["actuator_force"]
    timestep = word["timestep"]
    integrator, disabled = word["integrator"], word["disableactuator"]
    flags, stamps = word["disableflags"], word["plugin_data"]
    model_words = 1 + max(
        actuators, nuser, user, actadr, actnum, ctrladr, outadr, plugin, group, timestep
    )
    options = 1 + max(integrator, disabled, flags)
    data_words = 1 + max(stamps, time, ctrl, act, act_dot, length, velocity, force)

    @numba.cfunc(
        types.void(types.voidptr, types.voidptr, types.intc), cache=True, error_model="numpy"
    )
    def rates_and_tensions(model_pointer, data_pointer, instance):
        keyed_by(key)
        model = numba.carray(model_pointer, (model_words,), np.int64)
        data = numba.carray(data_pointer, (data_words,), np.int64)
        clock = numba.carray(data_pointer, (data_words,), np.float64)
        option = numba.carray(model_pointer, (model_words,), np.float64)
        codes = numba.carray(model_pointer, (options,), np.int32)
        doubles(data[stamps], instance, 1)[0] = clock[time]
        for index in range(model[actuators]):
            if entry(model[plugin], index) != instance:
                continue
            row = muscle_row(model[user], model[nuser], index)
            if row.size == 0:
                continue
            first = entry(model[actadr], index)
            count = entry(model[actnum], index)
            out = entry(model[outadr], index)
            rates = doubles(data[act_dot], first, count)
            if switched_off(model[group], index, codes[disabled]):
                rates[:] = 0.0
                continue
            opposing = 0.0
            if row[_BACKLASH] > 0.0 and row[_PARTNER] > 0.0:
                other = int(row[_PARTNER]) - 1
                opposing = tension(
                    muscle_row(model[user], model[nuser], other),
                    doubles(data[act], entry(model[actadr], other), entry(model[actnum], other)),
                    doubles(data[length], entry(model[outadr], other), 1)[0],
                    doubles(data[velocity], entry(model[outadr], other), 1)[0],
                )
            sag = 0.0
            if row[_RESISTANCE] + row[_SQUARE] > 0.0:
                valves = np.empty((model[actuators], VALVE))
                on_line = 0
                for other in range(model[actuators]):
                    par = muscle_row(model[user], model[nuser], other)
                    if par.size > 0 and par[_SUPPLY_LINE] == row[_SUPPLY_LINE]:
                        states = doubles(
                            data[act], entry(model[actadr], other), entry(model[actnum], other)
                        )
                        at = doubles(data[length], entry(model[outadr], other), 1)[0]
                        sent = doubles(data[ctrl], entry(model[ctrladr], other), 1)[0]
                        fill_valve_of(
                            par, states, at, sent, clock[time], option[timestep], valves[on_line]
                        )
                        on_line += 1
                own = doubles(data[act], first, count)
                sag = line_sag(row, own, valves[:on_line], option[timestep])
            pull = state_rates(
                row,
                doubles(data[act], first, count),
                rates,
                doubles(data[length], out, 1)[0],
                doubles(data[velocity], out, 1)[0],
                doubles(data[ctrl], entry(model[ctrladr], index), 1)[0],
                clock[time],
                option[timestep],
                opposing,
                sag,
            )
            # The engine keeps what stands here until `forces` runs: minus 0 for a slack muscle.
            doubles(data[force], out, 1)[0] = -pull

    @numba.cfunc(
        types.void(types.voidptr, types.voidptr, types.intc, types.intc),
        cache=True,
        error_model="numpy",
    )
    def forces(model_pointer, data_pointer, instance, _):
        keyed_by(key)
        model = numba.carray(model_pointer, (model_words,), np.int64)
        data = numba.carray(data_pointer, (data_words,), np.int64)
        option = numba.carray(model_pointer, (model_words,), np.float64)
        codes = numba.carray(model_pointer, (options,), np.int32)
        for index in range(model[actuators]):
            if entry(model[plugin], index) != instance:
                continue
            row = muscle_row(model[user], model[nuser], index)
            if row.size == 0:
                continue
            first = entry(model[actadr], index)
            count = entry(model[actnum], index)
            out = entry(model[outadr], index)
            its_force = doubles(data[force], out, 1)
            if switched_off(model[group], index, codes[disabled]):
                its_force[0] = 0.0
                continue
            states = doubles(data[act], first, count)
            at = doubles(data[length], out, 1)[0]
            speed = doubles(data[velocity], out, 1)[0]
            pull = -its_force[0]
            if pull == 0.0 and math.copysign(1.0, pull) < 0.0:  # the engine's own 0
                pull = tension(row, states, at, speed)
            if codes[integrator] == _RK4:
                pull = np.nan  # states between time points would break the muscles' memory
            # The engine's force lengthens the tendon; a muscle shortens it.
            its_force[0] = -tendon_force(row, states, pull, at, speed, option[timestep])

    @numba.cfunc(types.void(types.voidptr, types.voidptr, types.intc), cache=True)
    def advance(model_pointer, data_pointer, instance):
        model = numba.carray(model_pointer, (model_words,), np.int64)
        data = numba.carray(data_pointer, (data_words,), np.int64)
        clock = numba.carray(data_pointer, (data_words,), np.float64)
        option = numba.carray(model_pointer, (model_words,), np.float64)
        codes = numba.carray(model_pointer, (options,), np.int32)
        began = doubles(data[stamps], instance, 1)[0]
        if began + option[timestep] == clock[time] or codes[flags] & NO_ACTUATION:
            return
        for index in range(model[actuators]):
            if entry(model[plugin], index) == instance:
                last = entry(model[actadr], index) + entry(model[actnum], index) - AIR
                doubles(data[act], last, 1)[0] = np.nan

    @numba.cfunc(types.float64(), cache=True)
    def clock():
        return 0.0

    return rates_and_tensions, forces, advance, clock


def _compile_along(key: str) -> tuple[Any, Any]:
    """Compile the laws along a run; like the plugin's functions they close over a string alone."""
    signal, states = types.float64[::1], types.float64[:, ::1]

    @numba.njit(
        types.void(signal, states, signal, signal),
        cache=True,
        nogil=True,
        error_model="numpy",
    )
    def pressures(row, states, length, out):
        keyed_by(key)
        for k in range(length.size):
            out[k] = sensed_pressure(row, states[k], length[k])

    @numba.njit(
        types.void(signal, states, signal, signal, signal),
        cache=True,
        nogil=True,
        error_model="numpy",
    )
    def pulls(row, states, length, speed, out):
        keyed_by(key)
        for k in range(length.size):
            out[k] = tension(row, states[k], length[k], speed[k])

    return pressures, pulls


@functools.cache
def compiled_kernel() -> Natives:
    """Compile the kernel, or load it from numba's cache.

    Returns:
        Its functions. They must stay referenced while the engine may call them, which this
        function's cache does.
    """
    with compile_notice("the muscles", "about ten seconds"):
        return _compiled_kernel()


def _compiled_kernel() -> Natives:
    declare()
    each_step = Laws((state_rates, tendon_force), _USUAL)
    others = Laws((tension, fill_valve_of, line_sag, sensed_pressure))
    key = each_step.key + others.key
    act_dot, compute, advance, clock = (native.ctypes for native in _compile(key, words()))
    pressures, pulls = _compile_along(key)
    return Natives(act_dot, compute, advance, clock, pressures, pulls)


def words() -> dict[str, int]:
    """Position of each struct field, as `_compile` takes it."""
    offsets = callback_offsets()
    word = {name: offset // _POINTER_SIZE for name, offset in offsets.items()}
    codes = ("integrator", "disableflags", "disableactuator")
    return word | {name: offsets[name] // _INT_SIZE for name in codes}
