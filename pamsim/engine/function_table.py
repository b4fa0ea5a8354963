"""Compiled functions that machine code finds by a key, and has compiled when it first needs them.

A function of a law, or a part of the kernel, is compiled by itself. The code that calls it looks
its address up in a table at every call, and what is not there yet is asked for in Python. So a
process compiles, or loads, what its muscles need and nothing else, and no code is compiled again
because what it calls is another.
"""

# Numba's options are a dictionary.
# pyright: reportCallIssue=false, reportArgumentType=false

from __future__ import annotations

import ctypes
import functools
import math
import sys
import threading
from collections.abc import Callable, Iterable
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import types
from numba.extending import register_jitable

from pamsim.core.errors import EngineError
from pamsim.engine.jit import OPTIONS
from pamsim.engine.memory import five_at, value_at, word_at, write_at
from pamsim.engine.plugin import making_a_model

KIND = 1 << 56
"""Keys of one kind begin at a multiple of it; what follows is a number of at most 2^53."""

_PLACES = 1024  # a power of two
_NONE, _NOT_NOW, _READY = range(3)
"""Answers to code that asks for a function; no function has such an address."""

_table = np.zeros((_PLACES, 2), dtype=np.int64)  # key, address
_makers: dict[int, Callable[[int], Any]] = {}
_loaded: dict[int, Any] = {}
_refused: set[int] = set()
_once = threading.RLock()

_where: Any = types.ExternalFunction("pamsim_table", types.int64())
_load: Any = types.ExternalFunction("pamsim_load", types.int64(types.int64))


# --- for compiled code ---


@register_jitable(**OPTIONS)
def _first_place(key: Any) -> Any:
    """Where a key is looked for first: kinds, whose codes all begin at 1, lie 64 places apart."""
    return (key ^ (key >> 50)) & (_PLACES - 1)


@register_jitable(**OPTIONS)
def address(key: Any) -> Any:
    """Address of a function in the table; else the answer of `_ask`."""
    place = _first_place(key)
    while True:
        entry = _where() + 16 * place
        found = word_at(entry + 8)
        if found == 0:
            answer = _load(key)
            if answer != _READY:
                return answer
        elif word_at(entry) == key:
            return found
        else:
            place = (place + 1) & (_PLACES - 1)


@register_jitable(**OPTIONS)
def _without(answer: Any) -> Any:
    """What stands for a result where there is no such function: no number, or 0 while not asked."""
    return 0.0 if answer == _NOT_NOW else math.nan


@register_jitable(**OPTIONS)
def value(key: Any, arguments: Any) -> Any:
    """Result of a function that only reads; no number where there is no such function."""
    at = address(key)
    return _without(at) if at <= _NOT_NOW else value_at(at, arguments)


@register_jitable(**OPTIONS)
def result(key: Any, arguments: Any) -> Any:
    """`value` of a function that writes."""
    at = address(key)
    return _without(at) if at <= _NOT_NOW else write_at(at, arguments)


@register_jitable(**OPTIONS)
def five_values(key: Any, arguments: Any) -> Any:
    """`value` of a function with five results."""
    at = address(key)
    if at <= _NOT_NOW:
        nothing = _without(at)
        return nothing, nothing, nothing, nothing, nothing
    return five_at(at, arguments)


# --- in Python ---


def made_by(kind: int, make: Callable[[int], Any]) -> None:
    """Have functions of a kind compiled by one of what follows the kind in their key."""
    _makers[kind] = make


def load(keys: Iterable[int]) -> None:
    """Put some functions into the table, compiled or loaded from numba's cache.

    Raises:
        EngineError: if there is no such function.
        InputError: if one cannot be compiled.
    """
    with _once:
        for key in keys:
            if key not in _loaded:
                _add(key)


def _add(key: int) -> None:
    if len(_loaded) >= _PLACES // 2:
        raise EngineError(f"more than {_PLACES // 2} compiled functions in one process")
    made = _makers[key // KIND](key % KIND)
    place = _first_place(key)
    while _table[place, 1] != 0:
        place = (place + 1) & (_PLACES - 1)
    # The address last: it marks the entry as complete for other threads.
    _table[place, 0] = key
    _table[place, 1] = made.address
    _loaded[key] = made


def _ask(key: int) -> int:
    """Load a function that compiled code asks for; 0 if that fails, which is printed once.

    The engine cannot pass an exception on; `pamsim.live` compiles before, and raises it. While a
    model is made nothing is compiled: the engine then tries a step, whose numbers are not used.
    """
    if making_a_model():
        return _NOT_NOW
    if key in _refused:
        return _NONE
    try:
        load([key])
    except Exception as error:
        _refused.add(key)
        print(f"pamsim: the muscles cannot be evaluated: {error}", file=sys.stderr)
        return _NONE
    return _READY


_asked = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(_ask)
_kept: list[Any] = []


@functools.cache
def declare() -> None:
    """Make the table, and the function that asks for a function, known to compiled code by name."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text = f"define i64 @pamsim_table() {{ ret i64 {_table.ctypes.data} }}"
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    _kept.append(engine)
    llvm.add_symbol("pamsim_table", engine.get_function_address("pamsim_table"))
    llvm.add_symbol("pamsim_load", ctypes.cast(_asked, ctypes.c_void_p).value or 0)
