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
from numba.extending import (
    intrinsic,
    lower_builtin,
    overload,
    register_jitable,
    type_callable,
)

from pamsim.engine.jit import ARRAYS
from pamsim.engine.muscle_step import doubles, integer, memory_at, muscle_at, states_at
from pamsim.physics.record import STATES, record_dtype


@intrinsic
def as_pointer(typingctx: Any, address: Any) -> Any:
    """Turn an address into something `numba.carray` accepts."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@intrinsic
def address_of(typingctx: Any, record: Any) -> Any:
    """Address of a record that is viewed."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], context.get_value_type(types.int64))

    return types.int64(record), generate


@intrinsic
def word_at(typingctx: Any, address: Any) -> Any:
    """The integer of 64 bits at an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = context.get_value_type(types.int64)
        return builder.load(builder.inttoptr(args[0], word.as_pointer()))

    return types.int64(types.int64), generate


def _calling(
    builder: Any, context: Any, signature: Any, values: Any, *, reads: bool, out: Any = ()
) -> Any:
    """Call the function at an address with a tuple of numbers, ``out`` behind them; a float."""
    address, arguments = values
    kinds = (*signature.args[1], *(types.int64 for _ in out))
    function = ir.FunctionType(ir.DoubleType(), [context.get_value_type(kind) for kind in kinds])
    pointer = builder.inttoptr(address, function.as_pointer())
    given = [*cgutils.unpack_tuple(builder, arguments), *out]
    # What only reads may be called once for the same arguments.
    return builder.call(pointer, given, attrs=("nounwind", "readonly") if reads else ())


@intrinsic
def value_at(typingctx: Any, address: Any, args: Any) -> Any:
    """Call a function that only reads, at an address, with a tuple of numbers; a float."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _calling(builder, context, signature, values, reads=True)

    return types.float64(types.int64, args), generate


@intrinsic
def write_at(typingctx: Any, address: Any, args: Any) -> Any:
    """As `value_at`, of a function that writes."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _calling(builder, context, signature, values, reads=False)

    return types.float64(types.int64, args), generate


@intrinsic
def five_at(typingctx: Any, address: Any, args: Any) -> Any:
    """As `write_at`, of a function whose last argument is where it leaves five numbers; these."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        double = ir.DoubleType()
        out = cgutils.alloca_once(builder, double, size=5)
        place = builder.ptrtoint(out, context.get_value_type(types.int64))
        _calling(builder, context, signature, values, reads=False, out=(place,))
        numbers = [builder.load(builder.gep(out, [ir.IntType(32)(i)])) for i in range(5)]
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
        return function

    return take


@compiled_as(doubles)
def _doubles(address, first, count):
    return numba.carray(as_pointer(address + 8 * first), (count,), np.float64)


@compiled_as(memory_at)
def _memory_at(address, count):
    return doubles(address, 0, count)


def _viewed_as(place: Callable[[int], Any], record: np.dtype[Any]) -> None:
    """Have compiled code see the memory at an address as a record where Python calls a function."""
    kind = numba.from_dtype(record)

    @type_callable(place)
    def declared(context: Any) -> Any:
        def typed(address: Any) -> Any:
            return kind

        return typed

    @lower_builtin(place, types.Integer)
    def view(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(kind))


_viewed_as(muscle_at, record_dtype())
_viewed_as(states_at, STATES)


@type_callable(integer)
def _declared(context):
    def typed(address, index):
        return types.int64

    return typed


@lower_builtin(integer, types.Integer, types.Integer)
def _integer(context, builder, signature, args):
    pointer = builder.inttoptr(args[0], ir.IntType(32).as_pointer())
    return builder.sext(builder.load(builder.gep(pointer, [args[1]])), ir.IntType(64))
