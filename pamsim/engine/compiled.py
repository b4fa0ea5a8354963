"""The muscles' part of an engine step as machine code, without Python in it.

`pamsim.engine.muscle_step` and the physics are ordinary Python, handed to numba as they stand. What
depends on the laws is compiled once for each pair of force law and hysteresis operator, with their
parameters at known places: a kernel for all laws at once takes three times as long to compile and
is slower. A table in memory holds the functions of every pair; the step looks up that of each
muscle by the codes in its row, and asks Python for a pair that is not there yet.

The machine code is cached on disk under a key that covers the source, its constants and the layout
of the engine's structs: numba alone would notice an edit only in this file.
"""

# Numba supplies the first argument of an intrinsic, and its options are a dictionary.
# pyright: reportCallIssue=false, reportArgumentType=false

from __future__ import annotations

import ctypes
import functools
import inspect
import math
import sys
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import NumbaError
from numba.extending import intrinsic, overload, register_jitable

from pamsim.core.compilation import compile_notice
from pamsim.core.errors import EngineError, InputError
from pamsim.engine import muscle_step, plugin, structs
from pamsim.engine.jit import ARRAYS, OPTIONS, fingerprint, hand_to_numba, reached_functions
from pamsim.engine.muscle_step import (
    COUNT,
    broken_in,
    check_step,
    doubles,
    fall_of,
    integer,
    muscle_at,
    pressure_of,
    rates_of,
    report,
    states_at,
    step_end,
    step_forces,
    step_rates,
    supply_fall,
    tension_of,
)
from pamsim.physics.chamber_pressure import chamber_pressure
from pamsim.physics.chosen_law import CHOICES, chosen
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.invariants import broken_invariant
from pamsim.physics.kernel import state_rates, tension
from pamsim.physics.record import SIZE, STATES, laws_of, record_dtype

_D, _N = types.float64, types.int64

_MOST_PAIRS = 256
_WORDS = 6
"""Of a pair in the table: the codes of law and operator, and the addresses of four functions."""

_READY, _NOT_NOW = 1, 2
"""Answers to a step that asks for a pair."""

_RATES, _TENSION, _PRESSURE, _BROKEN = range(2, _WORDS)
_SUPPLY = _MOST_PAIRS - 1
"""The last entry holds the function of supplies that sag."""

_table = np.zeros((_MOST_PAIRS, _WORDS), dtype=np.int64)
_loaded: dict[tuple[float, float], Any] = {}
_refused: set[tuple[float, float]] = set()
_once = threading.RLock()


# --- memory ---


@intrinsic  # numba supplies the typing context: the function is called with the address alone
def as_pointer(typingctx: Any, address: Any) -> Any:
    """Turn an address into something `numba.carray` accepts."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@intrinsic
def call_at(typingctx: Any, address: Any, args: Any) -> Any:
    """Call the function at an address with a tuple of numbers; it returns a float."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in args]
        function = ir.FunctionType(context.get_value_type(types.float64), kinds)
        pointer = builder.inttoptr(values[0], function.as_pointer())
        return builder.call(pointer, cgutils.unpack_tuple(builder, values[1]))

    return types.float64(types.int64, args), generate


@intrinsic
def address_of(typingctx: Any, record: Any) -> Any:
    """Address of a record that is viewed."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], context.get_value_type(types.int64))

    return types.int64(record), generate


@register_jitable
def keyed_by(key: Any) -> None:
    """Make a function close over its key and so enter it in numba's cache key; does nothing."""


_GENERIC = record_dtype()


def _compiled_as(place: Callable[..., Any]) -> Callable[[Any], Any]:
    """Have compiled code run another function in the place of one."""

    def take(function: Any) -> Any:
        def choose(*_: Any) -> Any:
            return function

        choose.__signature__ = inspect.signature(function)  # pyright: ignore
        overload(place, jit_options=ARRAYS)(choose)
        return function

    return take


@_compiled_as(doubles)
def _doubles(address, first, count):
    return numba.carray(as_pointer(address + 8 * first), (count,), np.float64)


@_compiled_as(integer)
def _integer(address, index):
    return numba.carray(as_pointer(address + 4 * index), (1,), np.int32)[0]


@_compiled_as(muscle_at)
def _muscle_at(address):
    return numba.carray(as_pointer(address), (1,), _GENERIC)[0]


@_compiled_as(states_at)
def _states_at(address):
    return numba.carray(as_pointer(address), (1,), STATES)[0]


# --- the pair of laws of a muscle ---

_where: Any = types.ExternalFunction("pamsim_table", types.int64())
_load: Any = types.ExternalFunction("pamsim_load", types.int64(_D, _D))
_report: Any = types.ExternalFunction("pamsim_report", types.void(_N, _N, _D, _N, _D, _D))


@register_jitable(**ARRAYS)
def find(row: Any) -> Any:
    """Address of the functions of the muscle whose row is at an address; else what `_ask` says."""
    m = muscle_at(row)
    law, operator = int(m.force.law), int(m.hysteresis.law)
    for _ in range(2):
        table = numba.carray(as_pointer(_where()), (_MOST_PAIRS * _WORDS,), np.int64)
        for pair in range(_SUPPLY):
            at = _WORDS * pair
            if table[at + _RATES] == 0:
                break
            if table[at] == law and table[at + 1] == operator:
                return _where() + 8 * at
        answer = _load(m.force.law, m.hysteresis.law)
        if answer != _READY:
            return answer
    return 0


@register_jitable(**ARRAYS)
def called(row: Any, which: Any, arguments: Any) -> Any:
    """Result of one of the functions of a muscle's pair; no number where it has none."""
    pair = find(row)
    if pair == _NOT_NOW:
        return 0.0
    if pair == 0 or integers(pair)[which] == 0:
        return math.nan
    return call_at(integers(pair)[which], arguments)


@register_jitable(**ARRAYS)
def integers(address: Any) -> Any:
    """View of a pair in the table."""
    return numba.carray(as_pointer(address), (_WORDS,), np.int64)


@_compiled_as(rates_of)
def _rates_of(row, act, act_dot, count, length, velocity, command, time, timestep, opposing, sag):
    given = (row, act, act_dot, np.int64(count), length, velocity, command)
    return called(row, _RATES, (*given, time, timestep, opposing, sag))


@_compiled_as(tension_of)
def _tension_of(row, act, count, length, velocity):
    return called(row, _TENSION, (row, act, np.int64(count), length, velocity))


@_compiled_as(pressure_of)
def _pressure_of(row, act, count, length):
    return called(row, _PRESSURE, (row, act, np.int64(count), length))


@_compiled_as(broken_in)
def _broken_in(
    row, before, act, act_dot, count, length, velocity, force, command, time, timestep, found
):
    given = (row, np.int64(before), act, act_dot, np.int64(count), length, velocity, force)
    return called(row, _BROKEN, (*given, command, time, timestep, np.int64(found.ctypes.data)))


@_compiled_as(fall_of)
def _fall_of(model, data, index):
    fall = integers(_where() + 8 * _WORDS * _SUPPLY)
    if fall[_RATES] == 0:
        answer = _load(-1.0, -1.0)
        if answer != _READY:
            return 0.0 if answer == _NOT_NOW else math.nan
    return call_at(fall[_RATES], (address_of(model), address_of(data), np.int64(index)))


@_compiled_as(report)
def _reported(model, data, code, actuator, value, bound):
    _report(np.int64(model), np.int64(data), code, np.int64(actuator), value, bound)


def _teach(place: Callable[..., Any]) -> None:
    """Let compiled code call one of `CHOICES`: the function for the laws of the record's type."""

    def choose(m: Any, *_: Any) -> Any:
        law, operator = (
            next(float(name.removeprefix("law_")) for name in record if name.startswith("law_"))
            for record in (m.fields["force"].type.fields, m.fields["hysteresis"].type.fields)
        )
        return chosen(law, operator)[place]

    choose.__signature__ = inspect.signature(place)  # pyright: ignore[reportFunctionMemberAccess]
    overload(place, jit_options=OPTIONS)(choose)


for _place in CHOICES:
    _teach(_place)

_ROOTS = (state_rates, tension, chamber_pressure, broken_invariant)
_STEPS = (step_rates, step_forces, step_end, check_step)


def _compile_pair(key: str, record: np.dtype[Any]) -> tuple[Any, ...]:
    """Compile the functions of a pair.

    They close over nothing but a string and a record: numba makes its cache key from them, and
    functions among them would give a new key in every process.
    """
    options: dict[str, Any] = {"cache": True, "error_model": "numpy"}

    @numba.cfunc(_D(_N, _N, _N, _N, _D, _D, _D, _D, _D, _D, _D), **options)
    def rates(row, act, act_dot, count, length, velocity, command, time, timestep, opposing, sag):
        keyed_by(key)
        m, named = numba.carray(as_pointer(row), (1,), record)[0], 8 * (count - COUNT)
        z, dz = doubles(act, 0, count - COUNT), doubles(act_dot, 0, count - COUNT)
        s, ds = states_at(act + named), states_at(act_dot + named)
        return state_rates(
            m, s, z, ds, dz, length, velocity, command, time, timestep, opposing, sag
        )

    @numba.cfunc(_D(_N, _N, _N, _D, _D), **options)
    def pull(row, act, count, length, velocity):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        z, s = doubles(act, 0, count - COUNT), states_at(act + 8 * (count - COUNT))
        return tension(m, s, z, length, velocity)

    @numba.cfunc(_D(_N, _N, _N, _D), **options)
    def pressure(row, act, count, length):
        keyed_by(key)
        m = numba.carray(as_pointer(row), (1,), record)[0]
        z, s = doubles(act, 0, count - COUNT), states_at(act + 8 * (count - COUNT))
        return chamber_pressure(m, s, z, length)

    return rates, pull, pressure


def _compile_check(key: str, record: np.dtype[Any]) -> Any:
    """Compile the check of a pair; see `_compile_pair`."""

    @numba.cfunc(
        _D(_N, _N, _N, _N, _N, _D, _D, _D, _D, _D, _D, _N), cache=True, error_model="numpy"
    )
    def broken(
        row, before, act, act_dot, count, length, velocity, force, command, time, timestep, found
    ):
        keyed_by(key)
        m, named = numba.carray(as_pointer(row), (1,), record)[0], 8 * (count - COUNT)
        return broken_invariant(
            m,
            states_at(before + named),
            doubles(before, 0, count - COUNT),
            states_at(act + named),
            doubles(act, 0, count - COUNT),
            states_at(act_dot + named),
            length,
            velocity,
            force,
            command,
            time,
            timestep,
            doubles(found, 0, 2),
        )

    return broken


def _key_of(law: float, operator: float) -> str:
    laws = chosen(law, operator).values()
    return fingerprint(reached_functions(*_ROOTS, *laws)) + repr((law, operator, SIZE))


def prepare(pairs: Iterable[tuple[float, float]], *, checked: bool = False) -> None:
    """Compile the functions of some pairs, or load them from numba's cache.

    Args:
        pairs: codes of force law and operator, 0 for none.
        checked: also what checks a step.

    Raises:
        EngineError: if a code stands for no law that is known here.
        InputError: if a law cannot be compiled.
    """
    checked = checked or checking
    with _once:
        for pair in sorted(set(pairs)):
            if pair not in _loaded or (checked and len(_loaded[pair]) < 4):
                with compile_notice("the muscles", "about eight seconds"):
                    _prepare(pair, checked)


def _prepare(pair: tuple[float, float], checked: bool) -> None:
    law, operator = pair
    group = FORCE_LAWS.group(law)
    record = record_dtype(group, OPERATORS.group(operator) if operator else None)
    hand_to_numba(reached_functions(*_ROOTS, *chosen(law, operator).values()))
    key = _key_of(law, operator)
    try:
        functions = _loaded.get(pair) or _compile_pair(key, record)
        if checked:
            functions = (*functions, _compile_check(key, record))
    except NumbaError as error:
        own = [group.law] + ([OPERATORS.group(operator).law] if operator else [])
        raise InputError(
            f"the law {' or '.join(map(repr, own))} cannot be compiled: {_reason(error)}; its"
            " functions may use numbers, arrays of them, math, and functions of that kind, or run"
            " with backend='python'"
        ) from error
    place = list(_loaded).index(pair) if pair in _loaded else len(_loaded)
    if place >= _SUPPLY - 1:
        raise EngineError(f"more than {_SUPPLY - 1} pairs of laws in one process")
    addresses = [function.address for function in functions]
    _table[place, :2] = int(law), int(operator)
    _table[place, _BROKEN] = addresses[3] if checked else 0
    # The first function last: it marks the entry as complete for other threads.
    _table[place, _TENSION : _PRESSURE + 1] = addresses[1:3]
    _table[place, _RATES] = addresses[0]
    _loaded[pair] = functions


def _prepare_supply() -> None:
    with _once:
        functions = reached_functions(supply_fall, leave=_HOOKS)
        hand_to_numba(functions, arrays=True)
        key = fingerprint(functions)
        fall = _compile_supply(key, structs.model_dtype(), structs.data_dtype())
        _kept.append(fall)
        _table[_SUPPLY, _RATES] = fall.address


def _compile_supply(key: str, kind: np.dtype[Any], memory: np.dtype[Any]) -> Any:
    """Compile the fall of a supply; see `_compile_pair`."""

    @numba.cfunc(_D(_N, _N, _N), cache=True, error_model="numpy")
    def fall(model, data, index):
        keyed_by(key)
        return supply_fall(
            numba.carray(as_pointer(model), (1,), kind)[0],
            numba.carray(as_pointer(data), (1,), memory)[0],
            index,
        )

    return fall


def _reason(error: NumbaError) -> str:
    """The innermost line of a compiler's message that states what it met."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [line for line in lines if not line.startswith("Failed in")]
    return next(iter(telling or lines), type(error).__name__).rstrip(".:")


def laws_in(rows: Any) -> list[tuple[float, float]]:
    """Codes of force law and operator of each row.

    Args:
        rows: (m, SIZE) of muscles.

    Raises:
        EngineError: if a code stands for no law that is known here.
    """
    found: list[tuple[float, float]] = []
    for row in rows:
        force, hysteresis = laws_of(row)
        operator = 0.0 if hysteresis is None else OPERATORS.code(hysteresis)
        found.append((FORCE_LAWS.code(force), operator))
    return found


# --- what the engine calls ---


@dataclass(frozen=True)
class Natives:
    """Function pointers for the muscles' plugin: rates, forces, the end of a step."""

    act_dot: Any
    compute: Any
    advance: Any


checking = False
"""Whether pairs are compiled with their checks."""


def _ask(law: float, operator: float) -> int:
    """Compile a pair that a step asks for; 0 if that fails, which is printed once.

    The engine cannot pass an exception on; `pamsim.live` compiles before, and raises it. While a
    model is made nothing is compiled: the engine then tries a step, whose numbers are not used.
    """
    if plugin.making_a_model():
        return _NOT_NOW
    if (law, operator) in _refused:
        return 0
    try:
        if law < 0.0:
            _prepare_supply()
        else:
            prepare([(law, operator)], checked=checking)
    except Exception as error:
        _refused.add((law, operator))
        print(f"pamsim: the muscles cannot be evaluated: {error}", file=sys.stderr)
        return 0
    return _READY


_asked = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_double)(_ask)


@functools.cache
def declare() -> None:
    """Make the table, and what compiled code calls in Python, known by their names."""
    from pamsim.engine import checks

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text = f"define i64 @pamsim_table() {{ ret i64 {_table.ctypes.data} }}"
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    _kept.append(engine)
    llvm.add_symbol("pamsim_table", engine.get_function_address("pamsim_table"))
    for name, function in (("pamsim_load", _asked), ("pamsim_report", checks.reporter)):
        llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value or 0)
    hand_to_numba(reached_functions(*_STEPS, leave=_HOOKS), arrays=True)


_kept: list[Any] = []

_HOOKS = (
    *(doubles, integer, muscle_at, states_at, report),
    *(rates_of, tension_of, pressure_of, broken_in, fall_of),
)


def _step_key() -> str:
    return fingerprint(reached_functions(*_STEPS, leave=_HOOKS)) + inspect.getsource(muscle_step)


@functools.cache
def compiled_kernel() -> Natives:
    """Compile what the engine calls, or load it from numba's cache.

    Returns:
        Its functions. They must stay referenced while the engine may call them, which this
        function's cache does.
    """
    declare()
    with compile_notice("the muscles", "about eight seconds"):
        compiled = _compile(_step_key(), structs.model_dtype(), structs.data_dtype())
    return Natives(*(native.ctypes for native in compiled))


def _compile(key: str, kind: np.dtype[Any], memory: np.dtype[Any]) -> tuple[Any, Any, Any]:
    """Compile the plugin's functions; see `_compile_pair` for what they close over."""
    address = types.voidptr

    @numba.cfunc(types.void(address, address, types.intc), cache=True, error_model="numpy")
    def rates(model, data, instance):
        keyed_by(key)
        step_rates(
            numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), memory)[0], instance
        )

    @numba.cfunc(
        types.void(address, address, types.intc, types.intc), cache=True, error_model="numpy"
    )
    def forces(model, data, instance, _):
        keyed_by(key)
        step_forces(
            numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), memory)[0], instance
        )

    @numba.cfunc(types.void(address, address, types.intc), cache=True, error_model="numpy")
    def end(model, data, instance):
        keyed_by(key)
        step_end(numba.carray(model, (1,), kind)[0], numba.carray(data, (1,), memory)[0], instance)

    return rates, forces, end


def checked_end() -> Any:
    """The function that checks the muscles after each step, see `pamsim.engine.checks`.

    Returns:
        ctypes function pointer, which stays referenced by a cache.
    """
    global checking
    checking = True
    declare()
    prepare(list(_loaded), checked=True)
    return _checked_end()


@functools.cache
def _checked_end() -> Any:
    return _compile_checked(_step_key(), structs.model_dtype(), structs.data_dtype()).ctypes


def _compile_checked(key: str, kind: np.dtype[Any], memory: np.dtype[Any]) -> Any:
    @numba.cfunc(
        types.void(types.voidptr, types.voidptr, types.intc), cache=True, error_model="numpy"
    )
    def after_step(model_pointer, data_pointer, instance):
        keyed_by(key)
        model = numba.carray(model_pointer, (1,), kind)[0]
        data = numba.carray(data_pointer, (1,), memory)[0]
        step_end(model, data, instance)
        check_step(model, data, instance, (address_of(model), address_of(data)))

    return after_step


@functools.cache
def compiled_gauges() -> Any:
    """`pamsim.engine.gauges.read` as machine code."""
    from pamsim.engine import gauges

    compiled_kernel()
    functions = reached_functions(gauges.read, leave=_HOOKS)
    hand_to_numba(functions)
    return _compile_gauges(fingerprint(functions))


def _compile_gauges(key: str) -> Any:
    from pamsim.engine.gauges import read

    signal, signals = types.float64[:, ::1], types.float64[:, :, ::1]
    places = types.int64[:, ::1]

    @numba.njit(
        types.void(signals, signal, signal, signal, places, _N, signal),
        cache=True,
        nogil=True,
        error_model="numpy",
    )
    def gauge(rows, act, length, speed, places, what, out):
        keyed_by(key)
        read(rows, act, length, speed, places, what, out)

    return gauge
