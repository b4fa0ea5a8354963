"""Compiled force laws and hysteresis operators, which the kernel finds by their codes.

The kernel is compiled once for all laws. Where it asks a law, compiled code looks up the code of
the muscle's row in a table and calls the law's function there. A law is compiled by itself, for
about a second, and one that is not in the table yet is asked for in Python.
"""

# Numba's options are a dictionary.
# pyright: reportCallIssue=false, reportArgumentType=false

from __future__ import annotations

import ctypes
import functools
import inspect
import math
import sys
import threading
from collections.abc import Callable, Iterable
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaError
from numba.extending import overload, register_jitable

from pamsim.core.compilation import compile_notice
from pamsim.core.errors import EngineError, InputError
from pamsim.engine.jit import OPTIONS, fingerprint, hand_to_numba, reached_functions
from pamsim.engine.making_models import making_a_model
from pamsim.engine.memory import (
    address_of,
    as_pointer,
    five_at,
    keyed_by,
    value_at,
    word_at,
    write_at,
)
from pamsim.engine.muscle_step import doubles
from pamsim.physics.chosen_law import (
    OF_LAW,
    OF_OPERATOR,
    law_derivatives,
    law_force,
    law_functions,
    law_pushes,
    law_volume,
    law_volume_varies,
    law_work,
    operator_energy,
    operator_functions,
    operator_output,
    operator_rates,
)
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import laws_of, record_dtype

_D, _N = types.float64, types.int64

_PLACES = 512  # a power of two
_WORDS = 1 + len(OF_LAW)
"""Of a law in the table: its key, then the addresses of its functions, or 1 and 0 for a yes or no.

The key of an operator is its code as a negative number; a law's is its code."""

_FORCE, _VOLUME, _WORK, _DERIVATIVES, _PUSHES, _VARIES = range(1, _WORDS)
_OUTPUT, _ENERGY, _RATES = range(1, 1 + len(OF_OPERATOR))

_NONE, _NOT_NOW, _READY = range(3)
"""Answers to a step that asks for a law."""

_table = np.zeros((_PLACES, _WORDS), dtype=np.int64)
_loaded: dict[int, tuple[Any, ...]] = {}
_refused: set[int] = set()
_once = threading.RLock()

_where: Any = types.ExternalFunction("pamsim_table", types.int64())
_load: Any = types.ExternalFunction("pamsim_load", types.int64(types.int64))


# --- what the kernel calls ---


@register_jitable(**OPTIONS)
def law_at(key: Any) -> Any:
    """Address of a law in the table; else the answer of `_ask`."""
    place = key & (_PLACES - 1)
    while True:
        law = _where() + 8 * _WORDS * place
        if word_at(law + 8) == 0:
            answer = _load(key)
            if answer != _READY:
                return answer
        elif word_at(law) == key:
            return law
        else:
            place = (place + 1) & (_PLACES - 1)


@register_jitable(**OPTIONS)
def value(key: Any, which: Any, arguments: Any) -> Any:
    """Result of a law's function; no number where there is no such law."""
    law = law_at(key)
    if law <= _NOT_NOW:
        return 0.0 if law == _NOT_NOW else math.nan
    return value_at(word_at(law + 8 * which), arguments)


def _force(m, pressure, contraction):
    return value(int(m.force.law), _FORCE, (address_of(m), pressure, contraction))


def _volume(m, pressure, contraction):
    return value(int(m.force.law), _VOLUME, (address_of(m), pressure, contraction))


def _work(m, pressure, contraction, gained):
    return value(int(m.force.law), _WORK, (address_of(m), pressure, contraction, gained))


def _derivatives(m, pressure, contraction):
    law = law_at(int(m.force.law))
    if law <= _NOT_NOW:
        nothing = 0.0 if law == _NOT_NOW else math.nan
        return nothing, nothing, nothing, nothing, nothing
    address = word_at(law + 8 * _DERIVATIVES)
    return five_at(address, (address_of(m), pressure, contraction))


def _pushes(m):
    law = law_at(int(m.force.law))
    return law > _NOT_NOW and word_at(law + 8 * _PUSHES) != 0


def _volume_varies(m):
    law = law_at(int(m.force.law))
    return law > _NOT_NOW and word_at(law + 8 * _VARIES) != 0


def _output(m, z, x):
    return value(-int(m.hysteresis.law), _OUTPUT, (address_of(m), z.ctypes.data, len(z), x))


def _energy(m, z, x):
    return value(-int(m.hysteresis.law), _ENERGY, (address_of(m), z.ctypes.data, len(z), x))


def _rates(m, z, dz, x, x_rate, timestep):
    law = law_at(-int(m.hysteresis.law))
    if law > _NOT_NOW:
        given = (address_of(m), z.ctypes.data, dz.ctypes.data, len(z), x, x_rate, timestep)
        write_at(word_at(law + 8 * _RATES), given)


_BY_TABLE: dict[Callable[..., Any], Callable[..., Any]] = {
    law_force: _force,
    law_volume: _volume,
    law_work: _work,
    law_derivatives: _derivatives,
    law_pushes: _pushes,
    law_volume_varies: _volume_varies,
    operator_output: _output,
    operator_energy: _energy,
    operator_rates: _rates,
}


def _code_in(record: Any) -> float | None:
    """Code of the law whose fields a record names; None for a record of any law."""
    names = (name for name in record.type.fields if name.startswith("law_"))
    code = next(names).removeprefix("law_")
    return None if code == "any" else float(code)


def _teach(place: Callable[..., Any], group: str, functions: Callable[..., Any]) -> None:
    """Let compiled code call one of `CHOICES`: by the table, in a law itself its own functions."""

    def choose(m: Any, *_: Any) -> Any:
        code = _code_in(m.fields[group])
        return _BY_TABLE[place] if code is None else functions(code)[place]

    _BY_TABLE[place].__annotations__ = place.__annotations__  # numba compares signatures
    choose.__signature__ = inspect.signature(place)  # pyright: ignore[reportFunctionMemberAccess]
    overload(place, jit_options=OPTIONS)(choose)


for _place in OF_LAW:
    _teach(_place, "force", law_functions)
for _place in OF_OPERATOR:
    _teach(_place, "hysteresis", operator_functions)


# --- one law ---


def _compile_law(key: str, record: np.dtype[Any]) -> tuple[Any, ...]:
    """Compile the functions of a force law.

    They close over nothing but a string and a record: numba makes its cache key from them, and
    functions among them would give a new key in every process.
    """
    options: dict[str, Any] = {"cache": True, "error_model": "numpy"}

    @numba.cfunc(_D(_N, _D, _D), **options)
    def force(row, pressure, contraction):
        keyed_by(key)
        return law_force(numba.carray(as_pointer(row), (1,), record)[0], pressure, contraction)

    @numba.cfunc(_D(_N, _D, _D), **options)
    def volume(row, pressure, contraction):
        keyed_by(key)
        return law_volume(numba.carray(as_pointer(row), (1,), record)[0], pressure, contraction)

    @numba.cfunc(_D(_N, _D, _D, _D), **options)
    def work(row, pressure, contraction, gained):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        return law_work(m, pressure, contraction, gained)

    @numba.cfunc(_D(_N, _D, _D, _N), **options)
    def derivatives(row, pressure, contraction, out):
        keyed_by(key)
        m, five = numba.carray(as_pointer(row), (1,), record)[0], doubles(out, 0, 5)
        five[0], five[1], five[2], five[3], five[4] = law_derivatives(m, pressure, contraction)
        return 0.0

    return force, volume, work, derivatives


def _compile_operator(key: str, record: np.dtype[Any]) -> tuple[Any, ...]:
    """Compile the functions of a hysteresis operator; see `_compile_law`."""
    options: dict[str, Any] = {"cache": True, "error_model": "numpy"}

    @numba.cfunc(_D(_N, _N, _N, _D), **options)
    def output(row, z, count, x):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        return operator_output(m, doubles(z, 0, count), x)

    @numba.cfunc(_D(_N, _N, _N, _D), **options)
    def energy(row, z, count, x):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        return operator_energy(m, doubles(z, 0, count), x)

    @numba.cfunc(_D(_N, _N, _N, _N, _D, _D, _D), **options)
    def rates(row, z, dz, count, x, x_rate, timestep):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        before, written = doubles(z, 0, count), doubles(dz, 0, count)
        operator_rates(m, before, written, x, x_rate, timestep)
        return 0.0

    return output, energy, rates


def prepare(rows: Iterable[Any]) -> None:
    """Compile the laws of some muscles, or load them from numba's cache.

    Args:
        rows: (SIZE,) each, of a muscle.

    Raises:
        EngineError: if a code stands for no law that is known here.
        InputError: if a law cannot be compiled.
    """
    keys: set[int] = set()
    for row in rows:
        force, hysteresis = laws_of(row)
        keys.add(int(FORCE_LAWS.code(force)))
        if hysteresis is not None:
            keys.add(-int(OPERATORS.code(hysteresis)))
    for key in sorted(keys):
        _prepare(key)


def _prepare(key: int) -> None:
    with _once:
        if key in _loaded:
            return
        if len(_loaded) >= _PLACES // 2:
            raise EngineError(f"more than {_PLACES // 2} laws in one process")
        compiled, flags = _functions(key)
        place = key & (_PLACES - 1)
        while _table[place, 1] != 0:
            place = (place + 1) & (_PLACES - 1)
        words = [key, *(function.address for function in compiled), *flags]
        # The first function last: it marks the law as complete for other threads.
        _table[place, 2 : len(words)] = words[2:]
        _table[place, 0], _table[place, 1] = words[:2]
        _loaded[key] = compiled


def _functions(key: int) -> tuple[tuple[Any, ...], tuple[int, ...]]:
    """Compiled functions of a law, and its answers of yes or no."""
    if key < 0:
        code, functions, make = float(-key), operator_functions, _compile_operator
        group = OPERATORS.group(code)
        record, flags = record_dtype(None, group), ()
    else:
        code, functions, make = float(key), law_functions, _compile_law
        group = FORCE_LAWS.group(code)
        card, record = FORCE_LAWS.card(group), record_dtype(group)
        flags = (int(card.pushes), int(card.volume_varies))
    reached = reached_functions(*functions(code).values())
    hand_to_numba(reached)
    try:
        with compile_notice(f"the law {group.law!r}", "about a second"):
            return make(fingerprint(reached) + repr((key, record)), record), flags
    except NumbaError as error:
        raise InputError(
            f"the law {group.law!r} cannot be compiled: {_reason(error)}; its functions may use"
            " numbers, arrays of them, math, and functions of that kind, or run with"
            " backend='python'"
        ) from error


def _reason(error: NumbaError) -> str:
    """The innermost line of a compiler's message that states what it met."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [line for line in lines if not line.startswith("Failed in")]
    return next(iter(telling or lines), type(error).__name__).rstrip(".:")


def _ask(key: int) -> int:
    """Compile a law that a step asks for; 0 if that fails, which is printed once.

    The engine cannot pass an exception on; `pamsim.live` compiles before, and raises it. While a
    model is made nothing is compiled: the engine then tries a step, whose numbers are not used.
    """
    if making_a_model():
        return _NOT_NOW
    if key in _refused:
        return _NONE
    try:
        _prepare(key)
    except Exception as error:
        _refused.add(key)
        print(f"pamsim: the muscles cannot be evaluated: {error}", file=sys.stderr)
        return _NONE
    return _READY


_asked = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(_ask)
_kept: list[Any] = []


@functools.cache
def declare() -> None:
    """Make the table, and the function that asks for a law, known to compiled code by name."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text = f"define i64 @pamsim_table() {{ ret i64 {_table.ctypes.data} }}"
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    _kept.append(engine)
    llvm.add_symbol("pamsim_table", engine.get_function_address("pamsim_table"))
    llvm.add_symbol("pamsim_load", ctypes.cast(_asked, ctypes.c_void_p).value or 0)
