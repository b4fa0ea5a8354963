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
from pamsim.engine.memory import compiled_as, in_another_form
from pamsim.engine.muscle_step import (
    checked_step_end,
    report,
    step_end,
    step_forces,
    step_rates,
    supply_fall,
)
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

# The functions themselves: compiled code that calls them by their names is sent to the table.
_own = [own_copy(function) for function in _PARTS]

for _part, _function in enumerate(_PARTS):
    compiled_as(_function, OPTIONS)(by_address.called(_function, f"{PARTS} * KIND + {_part}"))


def _natives(what: str, about: str, *functions: FunctionType) -> tuple[Any, ...]:
    records = {
        "Parameters": record_dtype(),
        "ModelStruct": structs.model_dtype(),
        "DataStruct": structs.data_dtype(),
    }
    with compile_notice(what, about):
        key = hand_over(*functions)
        return tuple(by_address.compiled(one, key, records) for one in functions)


function_table.made_by(
    PARTS, lambda part: _natives("the muscles", "about five seconds", _own[part])[0]
)


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


def hand_over(*functions: Any) -> str:
    """Hand functions to numba, with what they call; the key of the code compiled from them."""
    function_table.declare()
    reporter = ctypes.cast(checks.reporter, ctypes.c_void_p).value or 0
    llvm.add_symbol("pamsim_report", reporter)
    reached = reached_functions(*functions, leave=in_another_form)
    hand_to_numba(reached)
    texts = map(inspect.getsource, (muscle_step, memory, function_table, by_address))
    return f"{fingerprint(reached)}{STATES}{record_dtype()}{''.join(texts)}"


@functools.cache
def step_functions() -> tuple[Any, ...]:
    """What the engine calls, compiled or loaded from numba's cache: rates, forces, end of a step.

    They must stay referenced while the engine may call them, which this function's cache does.
    """
    return _natives("the step of a model", "about two seconds", step_rates, step_forces, step_end)


@functools.cache
def checked_end() -> Any:
    """The end of a step that checks the muscles, see `pamsim.engine.checks`; as above."""
    return _natives("the checks of a step", "about three seconds", checked_step_end)[0]
