"""Compiled force laws and hysteresis operators, which the kernel finds by their codes.

The kernel is compiled once for all laws. Where it asks a law, compiled code looks up the code of
the muscle's row in the table of `pamsim.engine.function_table`. A law is compiled by itself, for
about a second.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from numba.core.errors import NumbaError, UnsupportedBytecodeError

from pamsim.core.compilation import compile_notice
from pamsim.core.errors import InputError
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

_KIND = {place: kind for kind, place in enumerate((*OF_LAW, *OF_OPERATOR))}
PARTS = len(_KIND)
"""Kind of functions in the table that belong to no law; each function of a law is a kind."""


def keys_of(m: Parameters) -> list[int]:
    """Keys of the functions that the laws of a muscle need."""
    needed: list[tuple[Any, Callable[..., Any]]] = [(m.force, law_force), (m.force, law_volume)]
    if volume_varies(m):
        needed += [(m.force, law_work), (m.force, law_derivatives)]
    if m.hysteresis.law != 0.0:
        needed += [(m.hysteresis, operator_output), (m.hysteresis, operator_rates)]
        if m.hysteresis.force_per_pressure != 0.0:
            needed.append((m.hysteresis, operator_energy))
    return [_KIND[place] * KIND + int(chosen.law) for chosen, place in needed]


def _compiled(place: Callable[..., Any], code: int) -> Any:
    """What a law has in the place of a function of `pamsim.physics.chosen_law`, compiled."""
    if place in OF_LAW:
        group, functions = FORCE_LAWS.group(code), law_functions(float(code))
        record = record_dtype(group)
    else:
        group, functions = OPERATORS.group(code), operator_functions(float(code))
        record = record_dtype(None, group)
    function = functions[place]
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


for _place, _kind in _KIND.items():
    _chosen = "force" if _place in OF_LAW else "hysteresis"
    _key = f"{_kind} * KIND + int(m.{_chosen}.law)"
    compiled_as(_place, OPTIONS)(by_address.called(_place, _key))
    function_table.made_by(_kind, partial(_compiled, _place))
