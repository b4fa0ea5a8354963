"""The muscles' part of an engine step as machine code, without Python in it.

`pamsim.engine.muscle_step` and the physics are ordinary Python, handed to numba as they stand. The
step calls the kernel, and the kernel the laws, through `pamsim.engine.function_table`: numba
optimises and emits every function again in each one that calls it. The machine code is cached on
disk under a key that covers the source, its constants and the layouts of the engine's structs and
of a muscle's numbers: numba alone would notice an edit only in this file.
"""

# Numba's options are a dictionary.
# pyright: reportCallIssue=false, reportArgumentType=false

from __future__ import annotations

import ctypes
import functools
import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import types

from pamsim.core.compilation import compile_notice
from pamsim.engine import (
    by_address,
    checks,
    function_table,
    law_table,
    memory,
    muscle_step,
    structs,
)
from pamsim.engine.function_table import KIND
from pamsim.engine.jit import OPTIONS, fingerprint, hand_to_numba, own_copy, reached_functions
from pamsim.engine.law_table import PARTS
from pamsim.engine.memory import address_of, compiled_as, keyed_by
from pamsim.engine.muscle_step import (
    check_step,
    doubles,
    integer,
    memory_at,
    muscle_at,
    report,
    states_at,
    step_end,
    step_forces,
    step_rates,
    supply_fall,
)
from pamsim.numba_cache import numba
from pamsim.physics.chamber_pressure import chamber_pressure, consistent_pressure
from pamsim.physics.kernel import state_rates, tension
from pamsim.physics.record import STATES, record_dtype, view
from pamsim.physics.static_muscle import volume_varies
from pamsim.physics.supply import sags

_PARTS: tuple[FunctionType, ...] = (
    state_rates,
    chamber_pressure,
    tension,
    consistent_pressure,
    supply_fall,
)
"""Functions of the kernel that are compiled each by itself, when a muscle first needs one."""

_HOOKS = (doubles, memory_at, integer, muscle_at, states_at, report, *_PARTS)
"""Functions that compiled code has in another form."""

# The functions themselves: compiled code that calls them by their names is sent to the table.
_own = [own_copy(function) for function in _PARTS]

for _part, _function in enumerate(_PARTS):
    compiled_as(_function, OPTIONS)(by_address.called(_function, f"{PARTS} * KIND + {_part}"))


def _compiled_part(part: int) -> Any:
    records = {
        "Parameters": record_dtype(),
        "ModelStruct": structs.model_dtype(),
        "DataStruct": structs.data_dtype(),
    }
    with compile_notice("the muscles", "about five seconds"):
        return by_address.compiled(_own[part], hand_over(_own[part]), records)


function_table.made_by(PARTS, _compiled_part)


def prepare(rows: Iterable[Any]) -> None:
    """Compile what some muscles need, or load it from numba's cache.

    Args:
        rows: (SIZE,) each, of a muscle.

    Raises:
        EngineError: if a code in a row stands for no law that is known here.
        InputError: if a law cannot be compiled.
    """
    keys: set[int] = set()
    for row in {row.tobytes(): row for row in rows}.values():  # runs of one rig have the same
        m = view(row)
        needed = {
            state_rates: True,
            chamber_pressure: True,
            tension: m.chain.backlash > 0.0,
            consistent_pressure: volume_varies(m),
            supply_fall: sags(m),
        }
        keys.update(PARTS * KIND + part for part, one in enumerate(_PARTS) if needed[one])
        keys.update(law_table.keys_of(m))
    function_table.load(sorted(keys))


_report: Any = types.ExternalFunction(
    "pamsim_report",
    types.void(*(types.int64, types.int64, types.float64), types.int64, *2 * (types.float64,)),
)


@compiled_as(report)
def _reported(model, data, code, actuator, value, bound):
    _report(np.int64(model), np.int64(data), code, np.int64(actuator), value, bound)


@dataclass(frozen=True)
class Natives:
    """Function pointers for the muscles' plugin: rates, forces, the end of a step."""

    act_dot: Any
    compute: Any
    advance: Any


def hand_over(*functions: Any) -> str:
    """Hand functions to numba, with what they call; the key of the code compiled from them."""
    function_table.declare()
    reporter = ctypes.cast(checks.reporter, ctypes.c_void_p).value or 0
    llvm.add_symbol("pamsim_report", reporter)
    reached = reached_functions(*functions, leave=_HOOKS)
    hand_to_numba(reached)
    texts = map(inspect.getsource, (muscle_step, memory, function_table, by_address))
    return f"{fingerprint(reached)}{STATES}{record_dtype()}{''.join(texts)}"


@functools.cache
def compiled_kernel() -> Natives:
    """Compile what the engine calls, or load it from numba's cache.

    Returns:
        Its functions. They must stay referenced while the engine may call them, which this
        function's cache does.
    """
    with compile_notice("the step of a model", "about two seconds"):
        key = hand_over(step_rates, step_forces, step_end)
        compiled = _compile(key, structs.model_dtype(), structs.data_dtype())
    return Natives(*(native.ctypes for native in compiled))


def _compile(key: str, kind: np.dtype[Any], state: np.dtype[Any]) -> tuple[Any, Any, Any]:
    """Compile the plugin's functions.

    They close over nothing but a string and records: numba makes its cache key from them, and
    functions among them would give a new key in every process.
    """
    address = types.voidptr

    @numba.cfunc(types.void(address, address, types.intc), cache=True, error_model="numpy")
    def rates(model, data, instance):
        keyed_by(key)
        step_rates(numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), state)[0], instance)

    @numba.cfunc(
        types.void(address, address, types.intc, types.intc), cache=True, error_model="numpy"
    )
    def forces(model, data, instance, _):
        keyed_by(key)
        step_forces(
            numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), state)[0], instance
        )

    @numba.cfunc(types.void(address, address, types.intc), cache=True, error_model="numpy")
    def end(model, data, instance):
        keyed_by(key)
        step_end(numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), state)[0], instance)

    return rates, forces, end


@functools.cache
def checked_end() -> Any:
    """The function that checks the muscles after each step, see `pamsim.engine.checks`.

    Returns:
        ctypes function pointer, which stays referenced by a cache.
    """
    with compile_notice("the checks of a step", "about three seconds"):
        key = hand_over(step_end, check_step)
        return _compile_checked(key, structs.model_dtype(), structs.data_dtype()).ctypes


def _compile_checked(key: str, kind: np.dtype[Any], state: np.dtype[Any]) -> Any:
    """Compile the end of a step with checks; see `_compile`."""

    @numba.cfunc(
        types.void(types.voidptr, types.voidptr, types.intc), cache=True, error_model="numpy"
    )
    def after_step(model_pointer, data_pointer, instance):
        keyed_by(key)
        model = numba.carray(model_pointer, (1,), kind)[0]
        data = numba.carray(data_pointer, (1,), state)[0]
        step_end(model, data, instance)
        check_step(model, data, instance, (address_of(model), address_of(data)))

    return after_step
