"""Functions of a muscle as C calls them: addresses in the place of records and arrays.

`called` is what compiled code runs where it calls such a function by name: it looks the machine
code up in the table of `pamsim.engine.function_table`. `compiled` makes that machine code. Both are
written from the function's own arguments and their annotations.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import types

from pamsim.core.compilation import function_of_text
from pamsim.engine.function_table import KIND, five_values, result, value
from pamsim.engine.memory import as_pointer, keyed_by
from pamsim.engine.muscle_step import address_of, doubles, states_at
from pamsim.numba_cache import numba


class _Passing(NamedTuple):
    """How an argument is passed on: what is given for it, its types, and what it is taken as."""

    given: str
    types: tuple[Any, ...]
    taken: str


_NUMBER, _WORD = types.float64, types.int64
_RECORD = "numba.carray(as_pointer({0}), (1,), {1})[0]"
_ARRAY = _Passing("{0}.ctypes.data, len({0})", (_WORD, _WORD), "doubles({0}, 0, {0}_size)")
_PASSING = {
    "float": _Passing("{0}", (_NUMBER,), "{0}"),
    "int": _Passing("{0}", (_WORD,), "{0}"),
    "Instance": _Passing("{0}", (types.intc,), "{0}"),
    "States": _Passing("address_of({0})", (_WORD,), "states_at({0})"),
    "Row": _ARRAY,
    "MutableRow": _ARRAY,
}
_NAMES = {
    "address_of": address_of,
    "as_pointer": as_pointer,
    "doubles": doubles,
    "five_values": five_values,
    "keyed_by": keyed_by,
    "KIND": KIND,
    "numba": numba,
    "result": result,
    "states_at": states_at,
    "value": value,
}


def _passing(annotation: str) -> _Passing:
    """Other annotations than the usual ones are records, whose layout has the annotation's name."""
    record = _Passing("address_of({0})", (_WORD,), _RECORD.format("{0}", annotation))
    return _PASSING.get(annotation, record)


def _arguments(function: Callable[..., Any]) -> dict[str, _Passing]:
    every = inspect.signature(function).parameters.values()
    return {one.name: _passing(str(one.annotation)) for one in every}


def called(function: Callable[..., Any], key: str) -> FunctionType:
    """What compiled code runs in the place of a function.

    Args:
        function: whose annotations are text: ``float``, ``int``, ``States``, ``Row``,
            ``MutableRow``, ``Instance`` (an int of C), or the name of a record. What has a row to
            write is taken to write.
        key: in the table, an expression of its arguments.
    """
    arguments, signature = _arguments(function), inspect.signature(function)
    writes = "MutableRow" in (one.annotation for one in signature.parameters.values())
    five = str(signature.return_annotation).startswith("tuple")
    call = "five_values" if five else "result" if writes else "value"
    given = ", ".join(one.given.format(name) for name, one in arguments.items())
    back = "" if signature.return_annotation in (None, "None") else "return "
    text = f"def called{signature}:\n    {back}{call}({key}, ({given},))\n"
    return function_of_text("called", text, f"<call of {function.__name__}>", _NAMES)


def compiled(function: FunctionType, key: str, records: Mapping[str, np.dtype[Any]]) -> Any:
    """Compile a function, or load it from numba's cache.

    Args:
        function: see `called`; it and what it calls has been handed to numba.
        key: of its source, and of all that its machine code depends on.
        records: layouts by the names of annotations.

    Returns:
        Numba's function for C; five results are left at an address that comes last.
    """
    arguments, returned = _arguments(function), str(inspect.signature(function).return_annotation)
    names = [n for name, one in arguments.items() for n in (name, f"{name}_size")[: len(one.types)]]
    kinds = [kind for one in arguments.values() for kind in one.types]
    call = f"own({', '.join(one.taken.format(name) for name, one in arguments.items())})"
    if returned == "float":
        body = f"return {call}"
    elif returned == "None":
        body = f"{call}\n    return 0.0"
    else:
        names, kinds = [*names, "out"], [*kinds, _WORD]
        each = ", ".join(f"five[{i}]" for i in range(5))
        body = f"five = doubles(out, 0, 5)\n    {each} = {call}\n    return 0.0"
    native = numba.cfunc(_NUMBER(*kinds), cache=True, error_model="numpy")
    return native(_keyed(function, names, body, key + repr(sorted(records.items())), records))


def loop(function: FunctionType, key: str) -> Callable[..., Any]:
    """Compile a function of arrays when it is called, to run without Python's lock.

    Args:
        function: without results; it and what it calls has been handed to numba.
        key: as of `compiled`.
    """
    names = [*inspect.signature(function).parameters]
    made = _keyed(function, names, f"own({', '.join(names)})", key, {})
    return numba.njit(cache=True, nogil=True, error_model="numpy")(made)


def _keyed(
    function: FunctionType, names: Sequence[str], body: str, key: str, records: Mapping[str, Any]
) -> FunctionType:
    """A function of some arguments that numba keeps in its cache under a key.

    The cache wants a file, a module that can be imported, and a key in the closure: functions there
    would give a new key in every process.
    """
    text = f"""def make(key):
  def {function.__name__}({", ".join(names)}):
    keyed_by(key)
    {body}
  return {function.__name__}
"""
    space: dict[str, Any] = {**_NAMES, **records, "own": function, "__name__": __name__}
    exec(compile(text, __file__, "exec"), space)
    return space["make"](key)
