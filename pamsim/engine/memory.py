"""Memory by address in compiled code, for which numba has no words of its own."""

# Numba supplies the first argument of an intrinsic, and its options are a dictionary.
# pyright: reportCallIssue=false, reportArgumentType=false

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload, register_jitable

from pamsim.engine.jit import ARRAYS, OPTIONS
from pamsim.engine.muscle_step import (
    address_of,
    doubles,
    integer,
    memory_at,
    muscle_at,
    states_at,
)
from pamsim.physics.record import STATES, record_dtype

in_another_form: set[Callable[..., Any]] = set()
"""Functions in whose place compiled code runs others, see `compiled_as`."""

_INT, _DOUBLE = ir.IntType(32), ir.DoubleType()


def _instruction(build: Callable[..., Any], result: Any, given: Any = types.int64) -> Any:
    """A function of one argument for compiled code.

    Args:
        build: makes what it does, of the builder, the argument and the result's type in LLVM.
        result: type of the result.
        given: type of the argument; any if None.
    """

    def typed(typingctx: Any, argument: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return build(builder, args[0], context.get_value_type(result))

        return result(given or argument), generate

    return intrinsic(typed)


def _pointer(builder: Any, address: Any, kind: Any) -> Any:
    return builder.inttoptr(address, kind)


def _loaded(builder: Any, address: Any, kind: Any) -> Any:
    return builder.load(builder.inttoptr(address, kind.as_pointer()))


as_pointer = _instruction(_pointer, types.voidptr)
"""Turn an address into something `numba.carray` accepts."""
word_at = _instruction(_loaded, types.int64)
"""The integer of 64 bits at an address."""
_int_at = _instruction(_loaded, types.int32)
_pointed_at = _instruction(lambda b, record, kind: b.ptrtoint(record, kind), types.int64, None)


def _calling(
    builder: Any, context: Any, signature: Any, values: Any, *, reads: bool, out: Any = ()
) -> Any:
    """Call the function at an address with a tuple of numbers, ``out`` behind them; a float."""
    address, arguments = values
    kinds = (*signature.args[1], *(types.int64 for _ in out))
    function = ir.FunctionType(_DOUBLE, [context.get_value_type(kind) for kind in kinds])
    given = [*cgutils.unpack_tuple(builder, arguments), *out]
    # What only reads may be called once for the same arguments.
    attributes = ("nounwind", "readonly") if reads else ()
    return builder.call(builder.inttoptr(address, function.as_pointer()), given, attrs=attributes)


def _call(*, reads: bool) -> Any:
    def typed(typingctx: Any, address: Any, args: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return _calling(builder, context, signature, values, reads=reads)

        return types.float64(types.int64, args), generate

    return intrinsic(typed)


value_at, write_at = _call(reads=True), _call(reads=False)
"""Call a function that only reads, or one that writes, at an address; tuple of numbers; a float."""


@intrinsic
def five_at(typingctx: Any, address: Any, args: Any) -> Any:
    """As `write_at`, of a function whose last argument is where it leaves five numbers; these."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        out = cgutils.alloca_once(builder, _DOUBLE, size=5)
        place = builder.ptrtoint(out, context.get_value_type(types.int64))
        _calling(builder, context, signature, values, reads=False, out=(place,))
        numbers = [builder.load(builder.gep(out, [_INT(i)])) for i in range(5)]
        return context.make_tuple(builder, signature.return_type, numbers)

    return types.UniTuple(types.float64, 5)(types.int64, args), generate


@register_jitable
def keyed_by(key: Any) -> None:
    """Make a function close over its key and so enter it in numba's cache key; does nothing."""


def compiled_as(
    place: Callable[..., Any], options: Mapping[str, Any] = ARRAYS
) -> Callable[[FunctionType], FunctionType]:
    """Have compiled code run another function in the place of one, with numba's options."""

    def take(function: FunctionType) -> FunctionType:
        def choose(*_: Any) -> Any:
            return function

        choose.__signature__ = inspect.signature(function)  # pyright: ignore
        overload(place, jit_options=options)(choose)
        in_another_form.add(place)
        return function

    return take


@compiled_as(address_of, OPTIONS)
def _address_of(record):
    return _pointed_at(record)


@compiled_as(doubles)
def _doubles(address, first, count):
    return numba.carray(as_pointer(address + 8 * first), (count,), np.float64)


@compiled_as(memory_at)
def _memory_at(address, count):
    return doubles(address, 0, count)


@compiled_as(integer, OPTIONS)
def _integer(address, index):
    return np.int64(_int_at(address + 4 * index))


# Numba holds a record as its address.
_muscle_viewed = _instruction(_pointer, numba.from_dtype(record_dtype()))
_states_viewed = _instruction(_pointer, numba.from_dtype(STATES))


@compiled_as(muscle_at, OPTIONS)
def _muscle_at(address):
    return _muscle_viewed(address)


@compiled_as(states_at, OPTIONS)
def _states_at(address):
    return _states_viewed(address)
