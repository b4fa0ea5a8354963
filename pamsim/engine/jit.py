"""The Python functions that a compiled one is made of: found, given a key, handed to numba."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterable
from types import FunctionType
from typing import Any


def reached_functions(*roots: Callable[..., Any]) -> list[FunctionType]:
    """The Python functions that some functions call by name, callees before callers."""
    functions: dict[tuple[str, str], FunctionType] = {}

    def visit(function: Any) -> None:
        enclosed = (cell.cell_contents for cell in function.__closure__ or ())
        named = map(function.__globals__.get, function.__code__.co_names)
        for callee in (*named, *enclosed):
            if isinstance(callee, FunctionType) and _name(callee) not in functions:
                visit(callee)
        functions.setdefault(_name(function), function)

    for root in roots:
        visit(root)
    return list(functions.values())


def _name(function: FunctionType) -> tuple[str, str]:
    return function.__module__, function.__qualname__


def fingerprint(functions: list[FunctionType]) -> str:
    """Digest of the functions' source and of the numbers they take from their modules."""
    digest = hashlib.sha256()
    for function in functions:
        digest.update(inspect.getsource(function).encode())
        for name in function.__code__.co_names:
            value = function.__globals__.get(name)
            if isinstance(value, int | float):
                digest.update(f"{name}={value!r}".encode())
    return digest.hexdigest()


_handed: set[FunctionType] = set()


def hand_to_numba(functions: Iterable[FunctionType]) -> None:
    """Let compiled functions call some Python functions; each is handed over once."""
    from numba.extending import register_jitable

    for function in functions:
        if function not in _handed:
            # No law makes an array, and counting references to the rows costs more than most laws.
            # Nobody calls one from C, and a wrapper for that takes a fifth of the compilation.
            register_jitable(_nrt=False, no_cfunc_wrapper=True)(function)
            _handed.add(function)
