"""Functions of the kernel that are others on a GPU: the choice of a law, and what needs doubles."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

from pamsim.core.compilation import function_of_text
from pamsim.physics.chosen_law import CHOICES, chosen
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.supply import Valves, supply_sag


def no_sag(
    valves: Valves, resistance: float, square: float, storage: float, before: float
) -> float:
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
    for place in CHOICES:
        of_law = place.__name__.startswith("law_")
        codes = [(law, 0.0) for law in laws]
        asked = "m.force.law"
        if not of_law:
            codes, asked = [(laws[0], code) for code in (*operators, 0.0)], "m.hysteresis.law"
        made[place] = _ladder(place, asked, codes)
    return made


def _ladder(
    place: Callable[..., Any], asked: str, codes: list[tuple[float, float]]
) -> FunctionType:
    names = ", ".join(inspect.signature(place).parameters)
    head = f"def {place.__name__}{inspect.signature(place)}:".replace("'", "")
    word = "" if head.endswith("-> None:") else "return "
    lines, space = [head], dict[str, Any](__name__=__name__)
    for number, (law, operator) in enumerate(codes):
        space[f"_{number}"] = chosen(law, operator)[place]
        code = law if asked == "m.force.law" else operator
        test = f"{'elif' if number else 'if'} {asked} == {code!r}"
        # The last one answers for codes that no law has.
        lines.append(f"    {test if number < len(codes) - 1 else 'else'}:")
        lines.append(f"        {word}_{number}({names})")
    text = "\n".join(lines) + "\n"
    where = f"<ladder of {place.__name__}>"
    function = function_of_text(place.__name__, text, where, space)
    function.__qualname__ = f"ladder_{place.__name__}"
    return function
