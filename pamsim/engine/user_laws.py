"""Laws from outside the package in the compiled kernel, which need not be compiled again for them.

The kernel calls such a law by the name of a function in `TARGETS`, through a pointer that this
module keeps. Behind it is a chain: each law answers to its own code and passes others on to those
that came before, at last to a function that answers NaN.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable, Iterable
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaError
from numba.cpython.unsafe.tuple import tuple_setitem
from numpy.typing import NDArray

from pamsim.core.catalog import USER_DEFINED
from pamsim.core.errors import InputError
from pamsim.core.parameters import specs
from pamsim.engine.jit import hand_to_numba, reached_functions
from pamsim.engine.law_writer import full_name
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.dispatch import user_force, user_volume
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS, Operator
from pamsim.physics.hysteresis.dispatch import user_energy, user_output, user_rates
from pamsim.physics.hysteresis.group import COMMON_FIELDS

_D, _P, _N = types.float64, types.voidptr, types.intp

_FORCE = _D(_D, _P, _P, _D, _D)  # code, coefficients, geometry, pressure, contraction
_OUTPUT = _D(_D, _P, _P, _N, _D)  # code, fields, states, their number, input
_RATES = _D(_D, _P, _P, _P, _N, _D, _D, _D)  # as before with rates, rate of the input, time step

TARGETS = {
    "pamsim_user_force": _FORCE,
    "pamsim_user_volume": _FORCE,
    "pamsim_user_output": _OUTPUT,
    "pamsim_user_energy": _OUTPUT,
    "pamsim_user_rates": _RATES,
}
"""Functions that the kernel calls, with their signatures."""

_C = {_D: ctypes.c_double, _P: ctypes.c_void_p, _N: ctypes.c_ssize_t}
_IR = {_D: "double", _P: "ptr", _N: "i64"}

_pointers = (ctypes.c_void_p * len(TARGETS))()
_kept: list[Any] = []  # what the engine may call until the process ends
_ready: set[float] = set()
_once = threading.RLock()


@functools.cache
def declare() -> None:
    """Make the functions of `TARGETS` known to compiled code; they answer NaN to begin with."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    text: list[str] = []
    for number, (name, signature) in enumerate(TARGETS.items()):
        inside = [_IR[one] for one in signature.args]
        given = ", ".join(f"{one} %a{i}" for i, one in enumerate(inside))
        at = ctypes.addressof(_pointers) + number * ctypes.sizeof(ctypes.c_void_p)
        text.append(f"""
            define double @{name}({given}) {{
                %place = inttoptr i64 {at} to ptr
                %function = load ptr, ptr %place
                %result = tail call double %function({given})
                ret double %result
            }}
            define double @{name}_unknown({given}) {{
                ret double 0x7FF8000000000000
            }}""")
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly("\n".join(text)), machine)
    engine.finalize_object()
    _kept.append(engine)
    for number, name in enumerate(TARGETS):
        _pointers[number] = engine.get_function_address(f"{name}_unknown")
        llvm.add_symbol(name, engine.get_function_address(name))


def make_ready(codes: Iterable[float]) -> None:
    """Compile the laws with some codes, as far as they are from outside and not compiled yet.

    Raises:
        InputError: if one of them cannot be compiled.
    """
    with _once:
        for code in sorted({code for code in codes if code >= USER_DEFINED} - _ready):
            declare()
            law, operator = FORCE_LAWS.with_code(code), OPERATORS.with_code(code)
            try:
                if law is not None:
                    _add_law(code, law)
                if operator is not None:
                    _add_operator(code, operator)
            except NumbaError as error:
                name = (law or operator).name  # pyright: ignore[reportOptionalMemberAccess]
                raise InputError(
                    f"the law {name!r} cannot be compiled: {_reason(error)}; its functions may use"
                    " numbers, arrays of them, math, and functions of that kind"
                ) from error
            _ready.add(code)


def _reason(error: NumbaError) -> str:
    """The line of a compiler's message that states what it met."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [line for line in lines if not line.startswith("Failed in")]
    return next(iter(telling or lines), type(error).__name__).rstrip(".:")


def _jitted(function: Callable[..., Any]) -> Any:
    # The function itself has a C wrapper of its own, unlike those that it calls.
    hand_to_numba(reached_functions(function)[:-1])
    return numba.njit(error_model="numpy")(function)


def _put_first(name: str, native: Any) -> None:
    _kept.append(native)
    _pointers[list(TARGETS).index(name)] = native.address


def _next(name: str) -> Any:
    """What answers to the codes that the next law does not."""
    signature = TARGETS[name]
    prototype = ctypes.CFUNCTYPE(ctypes.c_double, *(_C[one] for one in signature.args))
    function = prototype(_pointers[list(TARGETS).index(name)])
    _kept.append(function)
    return function


def _add_law(code: float, law: ForceLaw) -> None:
    coefficients, geometry = law.argument_places
    places = np.array(geometry, dtype=np.int64)
    for name, function in zip(
        ("pamsim_user_force", "pamsim_user_volume"), law.functions, strict=True
    ):
        _put_first(
            name,
            _native_law(code, _jitted(function), _next(name), len(coefficients), places),
        )


def _native_law(code: float, own: Any, others: Any, count: int, places: NDArray[np.int64]) -> Any:
    total = count + len(places)
    blank = (0.0,) * total

    @numba.cfunc(_FORCE, error_model="numpy")
    def native(asked, first, braid, pressure, contraction):
        if asked != code:
            return others(asked, first, braid, pressure, contraction)
        row, geometry = (
            numba.carray(first, (count,), np.float64),
            numba.carray(braid, (3,), np.float64),
        )
        rest = blank
        for i in range(count):
            rest = _set(rest, i, row[i])
        for i in range(count, total):
            rest = _set(rest, i, geometry[places[i - count]])
        return own(pressure, contraction, *rest)

    return native


def _add_operator(code: float, operator: Operator) -> None:
    size = len(specs(operator.group)) - COMMON_FIELDS
    for name, function in (
        ("pamsim_user_output", operator.output),
        ("pamsim_user_energy", operator.energy),
    ):
        _put_first(name, _native_output(code, _jitted(function), _next(name), size))
    name = "pamsim_user_rates"
    _put_first(name, _native_rates(code, _jitted(operator.rates), _next(name), size))


def _native_output(code: float, own: Any, others: Any, size: int) -> Any:
    @numba.cfunc(_OUTPUT, error_model="numpy")
    def native(asked, fields, states, count, x):
        if asked != code:
            return others(asked, fields, states, count, x)
        par = numba.carray(fields, (size,), np.float64)
        return own(par, 0, numba.carray(states, (count,), np.float64), x)

    return native


def _native_rates(code: float, own: Any, others: Any, size: int) -> Any:
    @numba.cfunc(_RATES, error_model="numpy")
    def native(asked, fields, states, rates, count, x, x_rate, timestep):
        if asked != code:
            return others(asked, fields, states, rates, count, x, x_rate, timestep)
        par = numba.carray(fields, (size,), np.float64)
        act = numba.carray(states, (count,), np.float64)
        own(par, 0, act, numba.carray(rates, (count,), np.float64), x, x_rate, timestep)
        return 0.0

    return native


_set: Any = tuple_setitem

_CALLED = {
    user_force: """
        define internal double @{name}(double %law, ptr %par, i64 %size, i64 %f, i64 %braid,
                                            double %pressure, double %contraction) {{
            %first = getelementptr double, ptr %par, i64 %f
            %geometry = getelementptr double, ptr %par, i64 %braid
            %r = call double @{target}(double %law, ptr %first, ptr %geometry, double %pressure,
                                       double %contraction)
            ret double %r
        }}""",
    user_output: """
        define internal double @{name}(double %law, ptr %par, i64 %size, i64 %first,
                                            ptr %act, i64 %count, double %x) {{
            %fields = getelementptr double, ptr %par, i64 %first
            %r = call double @{target}(double %law, ptr %fields, ptr %act, i64 %count, double %x)
            ret double %r
        }}""",
    user_rates: """
        define internal void @{name}(double %law, ptr %par, i64 %size, i64 %first,
                                          ptr %act, i64 %count, ptr %rates, i64 %same, double %x,
                                          double %x_rate, double %timestep) {{
            %fields = getelementptr double, ptr %par, i64 %first
            %r = call double @{target}(double %law, ptr %fields, ptr %act, ptr %rates, i64 %count,
                                       double %x, double %x_rate, double %timestep)
            ret void
        }}""",
}
_SAME = {user_force: user_force, user_volume: user_force, user_output: user_output,
         user_energy: user_output, user_rates: user_rates}  # fmt: skip


def _declared(name: str) -> str:
    return f"declare double @{name}({', '.join(_IR[one] for one in TARGETS[name].args)})\n"


OUTSIDE = {
    function: _declared(target) + _CALLED[like].format(name=full_name(function), target=target)
    for (function, like), target in zip(_SAME.items(), TARGETS, strict=True)
}
"""How machine code calls the functions of `TARGETS`, in the place of Python's."""
