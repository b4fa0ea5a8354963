"""What a Python function depends on: the functions it calls, their text, numbers from outside."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterable, Iterator
from types import CodeType, FunctionType
from typing import Any, cast

_NUMBERS: tuple[type, ...] = (int, float, complex, str)


def functions_reached(
    roots: Iterable[Callable[..., Any]], *, leave: Collection[Callable[..., Any]] = ()
) -> list[FunctionType]:
    """The Python functions that some functions, the roots, call by name, callees before callers.

    Those to ``leave`` are left out, with what they call.
    """
    functions: dict[FunctionType, None] = {}

    def visit(function: FunctionType) -> None:
        if function in functions or function in leave:
            return
        for callee in _from_outside(function).values():
            if isinstance(callee, FunctionType) and callee is not function:
                visit(callee)
        functions[function] = None

    for root in roots:
        visit(root)  # pyright: ignore[reportArgumentType]
    return list(functions)


def source_of(function: FunctionType) -> str:
    """Text of a function; of one typed at a prompt its code."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return "".join(_in_code(function.__code__))


def constants_of(function: FunctionType) -> str:
    """Names and values of the numbers that a function takes from outside."""
    return "".join(f"{name}={held(value)}" for name, value in _from_outside(function).items())


def held(value: Any) -> str:
    """Numbers in a value, in full; empty for one that holds none, such as a function or module."""
    if hasattr(value, "tobytes") and not isinstance(value, type):
        return f"{getattr(value, 'dtype', '')}{getattr(value, 'shape', '')}{value.tobytes().hex()}"
    if isinstance(value, dict):
        entries = cast("dict[Any, Any]", value).items()
        return f"{{{''.join(f'{key!r}:{held(one)},' for key, one in entries)}}}"
    if isinstance(value, list | tuple):
        return f"({''.join(f'{held(one)},' for one in cast('list[Any]', value))})"
    return repr(value) if isinstance(value, _NUMBERS) else ""


def _from_outside(function: FunctionType) -> dict[str, Any]:
    code, outside = function.__code__, dict[str, Any]()
    for name in code.co_names:
        if name in function.__globals__:
            outside[name] = function.__globals__[name]
    cells = function.__closure__ or ()
    return outside | {
        n: cell.cell_contents for n, cell in zip(code.co_freevars, cells, strict=True)
    }


def _in_code(code: CodeType) -> Iterator[str]:
    # The repr of code holds an address, which is another in every process.
    yield code.co_code.hex()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _in_code(constant)
        else:
            yield repr(constant)
