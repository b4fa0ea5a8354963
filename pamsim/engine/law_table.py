"""Compiled force laws and hysteresis operators, which the kernel finds by their codes.

The kernel is compiled once for all laws. Where it asks a law, compiled code looks up the code of
the muscle's row in the table of `pamsim.engine.function_table`. A law is compiled by itself, for
about a second.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any

import numpy as np
from numba.core.errors import NumbaError, UnsupportedBytecodeError

from pamsim.core.compilation import compile_notice
from pamsim.core.errors import InputError
from pamsim.core.parameters import ParameterGroup
from pamsim.engine import by_address, function_table
from pamsim.engine.function_table import KIND
from pamsim.engine.jit import OPTIONS, fingerprint, hand_to_numba, reached_functions
from pamsim.engine.memory import compiled_as
from pamsim.engine.refused_law import refusal
from pamsim.physics.chosen_law import (
    OF_LAW,
    OF_OPERATOR,
    law_derivatives,
    law_force,
    law_functions,
    law_volume,
    law_work,
    operator_energy,
    operator_functions,
    operator_output,
    operator_rates,
)
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import Parameters, record_dtype
from pamsim.physics.static_muscle import volume_varies

_LAW = {place: kind for kind, place in enumerate(OF_LAW)}
_OPERATOR = {place: kind for kind, place in enumerate(OF_OPERATOR, start=len(OF_LAW))}
PARTS = len(OF_LAW) + len(OF_OPERATOR)
"""Kind of functions in the table that belong to no law; each function of a law is a kind."""

for _place, _kind in _LAW.items():
    _key = f"{_kind} * KIND + int(m.force.law)"
    compiled_as(_place, OPTIONS)(by_address.called(_place, _key))
for _place, _kind in _OPERATOR.items():
    _key = f"{_kind} * KIND + int(m.hysteresis.law)"
    compiled_as(_place, OPTIONS)(by_address.called(_place, _key))


def keys_of(m: Parameters) -> list[int]:
    """Keys of the functions that the laws of a muscle need."""
    at_force = [law_force, law_volume]
    if volume_varies(m):
        at_force += [law_work, law_derivatives]
    keys = [_LAW[place] * KIND + int(m.force.law) for place in at_force]
    if m.hysteresis.law != 0.0:
        at_loop = [operator_output, operator_rates]
        if m.hysteresis.force_per_pressure != 0.0:
            at_loop.append(operator_energy)
        keys += [_OPERATOR[place] * KIND + int(m.hysteresis.law) for place in at_loop]
    return keys


def _compiled_law(place: Callable[..., Any], code: int) -> Any:
    group = FORCE_LAWS.group(code)
    return _compiled(group, code, law_functions(float(code))[place], record_dtype(group))


def _compiled_operator(place: Callable[..., Any], code: int) -> Any:
    group = OPERATORS.group(code)
    function = operator_functions(float(code))[place]
    return _compiled(group, code, function, record_dtype(None, group))


for _place, _kind in _LAW.items():
    function_table.made_by(_kind, partial(_compiled_law, _place))
for _place, _kind in _OPERATOR.items():
    function_table.made_by(_kind, partial(_compiled_operator, _place))


def _compiled(
    group: type[ParameterGroup], code: int, function: FunctionType, record: np.dtype[Any]
) -> Any:
    reached = reached_functions(function)
    key = f"{code} {fingerprint(reached)}"  # a code stands for values closed over as well
    hand_to_numba(reached)
    try:
        with compile_notice(f"the law {group.law!r}", "about a second"):
            return by_address.compiled(function, key, {"Parameters": record})
    except (NumbaError, UnsupportedBytecodeError) as error:
        raise InputError(
            f"the law {group.law!r} cannot be compiled: {refusal(error, reached)}; its functions"
            " may use numbers, arrays of them, math, and functions of that kind, or run with"
            " backend='python'"
        ) from error
