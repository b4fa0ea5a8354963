"""Why the compiler refuses a function: the line at which it stopped, and its innermost reason."""

from __future__ import annotations

import linecache
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import FunctionType

from numba.core.compiler import run_frontend
from numba.core.errors import NumbaError, UnsupportedBytecodeError

_LONGEST = 80  # characters of a call in a message: the types of a record fill a screen


def refusal(error: Exception, functions: Iterable[FunctionType]) -> str:
    """File, line and text of the line that the compiler cannot take, and why, in one line.

    Args:
        error: of the compiler.
        functions: that it was handed, callees before callers.
    """
    handed = list(functions)
    # What was made from a text has a name in brackets in the place of a file.
    own = [one for one in handed if not one.__code__.co_filename.startswith("<")] or handed
    file, line = _place(error, own)
    return f"{file}, line {line}, `{linecache.getline(file, line).strip()}`: {_reason(error)}"


def _innermost(error: Exception) -> str:
    """The compiler's message from the innermost function on that it was handed.

    The message goes from callers to callees; below what we handed over lies its own library, and
    then come the places of the calls, from the innermost outwards.
    """
    return str(error).split("_giving.<locals>.give")[-1]


def _reason(error: Exception) -> str:
    """What the compiler met in the innermost function that it was handed."""
    lines = [re.sub(r"^\w+Error: ", "", line.strip()) for line in _innermost(error).splitlines()]
    around = ("Failed in", "' ", "':", "With argument", "Rejected as")
    reasons = [line for line in lines if line and not line.startswith(around)]
    first = next(iter(reasons), type(error).__name__)
    if first.startswith("No implementation of function"):
        called = next((line[4:] for line in reasons if line.startswith(">>> ")), first)
        name = called.partition("(")[0]
        return f"no compiled form of {called if len(called) <= _LONGEST else name}"
    # Without a name of the compiler's own, and without the place, which is given before.
    return re.sub(r"( for '\$.*)?(, defined at .*)?(\. Raised from .*)?$", "", first).rstrip(".:")


def _place(error: Exception, functions: Sequence[FunctionType]) -> tuple[str, int]:
    """File and line at which the compiler stopped in one of some functions, callees first."""
    by_name = {one.__name__: one for one in functions}
    names = "|".join(map(re.escape, by_name))
    # Behind the name of the function at fault come the places of the calls.
    call = rf"callee type: Function\(<function ({names}) at"
    inside, *rest = re.split(call, _innermost(error), maxsplit=1)
    stops = [
        (place.start(), file, int(place[1]))
        for file in {one.__code__.co_filename for one in functions}
        for place in re.finditer(rf'{re.escape(Path(file).name)}(?:", line | \()(\d+)', inside)
    ]
    if stops:
        return min(stops)[1:]
    at_fault = by_name[rest[0]] if rest else next(filter(_refused, functions), functions[-1])
    return at_fault.__code__.co_filename, at_fault.__code__.co_firstlineno


def _refused(function: FunctionType) -> bool:
    """Whether a function's own text is more than the compiler can read."""
    try:
        run_frontend(function)
    except (NumbaError, UnsupportedBytecodeError):
        return True
    return False
