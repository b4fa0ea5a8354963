"""Functions of the kernel that are others on a GPU: the choice of a law, and what needs doubles."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

from pamsim.core.compilation import function_of_text
from pamsim.physics.chosen_law import OF_LAW, OF_OPERATOR, law_functions, operator_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import Parameters, States
from pamsim.physics.supply import Valves, supply_sag


def no_sag(m: Parameters, s: States, valves: Valves, timestep: float) -> float:
    """In the place of `supply_sag` in single precision, which never reaches its tolerance."""
    return math.nan


IN_SINGLE: dict[FunctionType, FunctionType] = {supply_sag: no_sag}
"""Function of the kernel -> the one in its place in single precision."""


@functools.cache
def ladders() -> dict[Callable[..., Any], FunctionType]:
    """Function of `CHOICES` -> one that asks for the code of each law of the package in turn."""
    laws = sorted({FORCE_LAWS.code(law.group) for law in FORCE_LAWS.own()})
    operators = sorted({OPERATORS.code(operator.group) for operator in OPERATORS.own()})
    made: dict[Callable[..., Any], FunctionType] = {}
    for place in OF_LAW:
        made[place] = _ladder(place, "m.force.law", {code: law_functions(code) for code in laws})
    by_code = {code: operator_functions(code) for code in (*operators, 0.0)}
    for place in OF_OPERATOR:
        made[place] = _ladder(place, "m.hysteresis.law", by_code)
    return made


def _ladder(
    place: Callable[..., Any],
    asked: str,
    by_code: Mapping[float, Mapping[Callable[..., Any], FunctionType]],
) -> FunctionType:
    names = ", ".join(inspect.signature(place).parameters)
    head = f"def {place.__name__}{inspect.signature(place)}:".replace("'", "")
    word = "" if head.endswith("-> None:") else "return "
    lines, space = [head], dict[str, Any](__name__=__name__)
    for number, (code, functions) in enumerate(by_code.items()):
        space[f"_{number}"] = functions[place]
        test = f"{'elif' if number else 'if'} {asked} == {code!r}"
        # The last one answers for codes that no law has.
        lines.append(f"    {test if number < len(by_code) - 1 else 'else'}:")
        lines.append(f"        {word}_{number}({names})")
    text = "\n".join(lines) + "\n"
    where = f"<ladder of {place.__name__}>"
    function = function_of_text(place.__name__, text, where, space)
    function.__qualname__ = f"ladder_{place.__name__}"
    return function
