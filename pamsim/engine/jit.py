"""The Python functions that a compiled one is made of: found, given a key, handed to numba."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Collection, Iterable
from types import FunctionType
from typing import Any

from pamsim.core.reached_code import constants_of, functions_reached, source_of
from pamsim.physics.chosen_law import CHOICES

OPTIONS: dict[str, Any] = {
    # No law makes an array, and counting references to the records costs more than most laws.
    # Nobody calls one from C, and a wrapper for that takes a fifth of the time to compile.
    "_nrt": False,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
}
"""Of functions that compiled code calls, for numba."""

ARRAYS = {**OPTIONS, "_nrt": True}
"""Of those that make arrays or views."""


def reached_functions(
    *roots: Callable[..., Any], leave: Collection[Callable[..., Any]] = CHOICES
) -> list[FunctionType]:
    """The Python functions that some functions call by name, callees before callers.

    Args:
        roots: functions, included.
        leave: functions that compiled code has in another form.
    """
    return functions_reached(roots, leave=leave)


def fingerprint(functions: Iterable[FunctionType]) -> str:
    """Digest of the functions' source and of the constants they take from outside."""
    digest = hashlib.sha256()
    for function in functions:
        digest.update(f"{source_of(function)}{constants_of(function)}".encode())
    return digest.hexdigest()


_handed: set[FunctionType] = set()


def hand_to_numba(functions: Iterable[FunctionType]) -> None:
    """Let compiled functions call some Python functions, callees first; each is handed once."""
    from numba.extending import overload

    for function in functions:
        if function not in _handed:
            own = function.__module__.startswith("pamsim.engine.")
            options: Any = ARRAYS if own else OPTIONS
            overload(function, jit_options=options)(_giving(_at_home(function)))
            _handed.add(function)


def _giving(function: FunctionType) -> FunctionType:
    def give(*_: Any, **__: Any) -> FunctionType:
        return function

    give.__signature__ = inspect.signature(function)  # pyright: ignore[reportFunctionMemberAccess]
    return give  # pyright: ignore[reportReturnType]


def _at_home(function: FunctionType) -> FunctionType:
    """A function as numba's cache can load it: that of a rig's file has no module to import."""
    if function.__module__.startswith("pamsim."):
        return function
    copy = own_copy(function)
    copy.__module__ = __name__
    return copy


def own_copy(function: FunctionType) -> FunctionType:
    """A copy of a function: the code behind what compiled code calls by its name."""
    code, space = function.__code__, function.__globals__
    copy = FunctionType(code, space, function.__name__, function.__defaults__, function.__closure__)
    copy.__annotations__, copy.__kwdefaults__ = function.__annotations__, function.__kwdefaults__
    copy.__module__ = function.__module__
    return copy
