"""The compiled function that checks the muscles after each step; see `pamsim.engine.checks`."""

from __future__ import annotations

import ctypes
import functools
import math
from collections.abc import Mapping
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types

from pamsim.engine.compiled import (
    NO_ACTUATION,
    compiled_kernel,
    doubles,
    entry,
    keyed_by,
    muscle_row,
    switched_off,
    words,
)
from pamsim.engine.laws import Laws
from pamsim.physics.invariants import (
    ABOVE_SUPPLY,
    FINITE,
    NOTHING,
    broken_invariant,
    never_charged,
)
from pamsim.physics.layout import slot
from pamsim.physics.muscle_valves import asks_too_much

_SUPPLY = slot("valve.supply_pressure")

SYMBOL = "pamsim_broken_invariant"
"""Under which compiled code finds what reports a broken invariant."""

_report: Any = types.ExternalFunction(
    SYMBOL,
    types.void(*[types.voidptr] * 2, types.float64, types.intc, types.float64, types.float64),
)

ADVANCE = "pamsim_advance"
"""Under which it finds what the engine calls while nothing is checked."""

_advance: Any = types.ExternalFunction(
    ADVANCE, types.void(types.voidptr, types.voidptr, types.intc)
)


def _compile(key: str, word: Mapping[str, int]) -> Any:
    """Compile the check; like the plugin's functions it closes over numbers and a string alone."""
    actuators, nuser, user = word["nactuator"], word["nuser_actuator"], word["actuator_user"]
    actadr, actnum = word["actuator_actadr"], word["actuator_actnum"]
    ctrladr, outadr = word["actuator_ctrladr"], word["actuator_outadr"]
    plugin, group = word["actuator_plugin"], word["actuator_group"]
    time, ctrl, act, act_dot = word["time"], word["ctrl"], word["act"], word["act_dot"]
    length, velocity = word["actuator_length"], word["actuator_velocity"]
    force, timestep, disabled = word["actuator_force"], word["timestep"], word["disableactuator"]
    flags = word["disableflags"]
    nq, nv, qpos, qvel = word["nq"], word["nv"], word["qpos"], word["qvel"]
    width = 1 + max(word.values())

    @numba.cfunc(
        types.void(types.voidptr, types.voidptr, types.intc), cache=True, error_model="numpy"
    )
    def after_step(model_pointer, data_pointer, instance):
        keyed_by(key)
        _advance(model_pointer, data_pointer, instance)
        model = numba.carray(model_pointer, (width,), np.int64)
        data = numba.carray(data_pointer, (width,), np.int64)
        clock = numba.carray(data_pointer, (width,), np.float64)
        option = numba.carray(model_pointer, (width,), np.float64)
        codes = numba.carray(model_pointer, (width,), np.int32)
        if codes[flags] & NO_ACTUATION:
            return
        step = option[timestep]
        found = np.empty(2)
        for index in range(model[actuators]):
            if entry(model[plugin], index) != instance:
                continue
            row = muscle_row(model[user], model[nuser], index)
            if row.size == 0 or switched_off(model[group], index, codes[disabled]):
                continue
            first = entry(model[actadr], index)
            count = entry(model[actnum], index)
            out = entry(model[outadr], index)
            states = doubles(data[act], first, count)
            rates = doubles(data[act_dot], first, count)
            if never_charged(states):
                return
            sent = doubles(data[ctrl], entry(model[ctrladr], index), 1)[0]
            if asks_too_much(row, sent):
                _report(model_pointer, data_pointer, ABOVE_SUPPLY, index, sent, row[_SUPPLY])
            before = np.empty(count)
            for i in range(count):
                before[i] = states[i] - step * rates[i]
            code = broken_invariant(
                row,
                before,
                states,
                rates,
                doubles(data[length], out, 1)[0],
                doubles(data[velocity], out, 1)[0],
                doubles(data[force], out, 1)[0],
                sent,
                clock[time] - step,
                step,
                found,
            )
            if code != NOTHING:
                _report(model_pointer, data_pointer, code, index, found[0], found[1])
                return
        moving = 0.0
        for place in doubles(data[qpos], 0, model[nq]):
            moving += place
        for speed in doubles(data[qvel], 0, model[nv]):
            moving += speed
        if not math.isfinite(moving):
            _report(model_pointer, data_pointer, FINITE, -1, moving, 0.0)

    return after_step


@functools.cache
def compiled_check(report: int) -> Any:
    """Compile the check, or load it from numba's cache.

    Args:
        report: address of what is called with model, data, code, actuator, number and bound.

    Returns:
        ctypes function pointer, which stays referenced by this function's cache.
    """
    natives = compiled_kernel()
    laws = Laws((broken_invariant, never_charged, asks_too_much))
    llvm.add_symbol(SYMBOL, report)
    llvm.add_symbol(ADVANCE, ctypes.cast(natives.advance, ctypes.c_void_p).value or 0)
    return _compile(laws.key, words()).ctypes
