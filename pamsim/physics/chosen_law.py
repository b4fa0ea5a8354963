"""The force law and the hysteresis operator that a muscle's record names, for the kernel.

The kernel calls the functions of this module, which are the same for all laws. In plain Python they
look up the law by its code at every call, so a law may be anything that can be called. Compiled
code looks it up in a table of compiled laws, and Warp has a kernel for the laws of its rig: there
the functions of `law_functions` and `operator_functions` stand in their place.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

from pamsim.core.compilation import function_of_text
from pamsim.core.parameters import ParameterGroup
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import MutableRow, Parameters, Row

_APART, _ABOVE = 1e-6, 10.0  # steps of difference quotients: contraction [-], pressure [Pa]


def law_pushes(m: Parameters) -> bool:
    """Whether the law's force may push; that of a muscle is limited to tension."""
    return m.force.pushes != 0.0


def law_volume_varies(m: Parameters) -> bool:
    """Whether the law's volume changes with pressure at a held length."""
    return m.force.volume_varies != 0.0


def law_force(m: Parameters, pressure: float, contraction: float) -> float:
    """Force of the law, without its scale [N].

    Args:
        m: parameters of the muscle.
        pressure: gauge pressure that reaches the braid [Pa].
        contraction: kappa [-].
    """
    return law_functions(m.force.law)[law_force](m, pressure, contraction)


def law_volume(m: Parameters, pressure: float, contraction: float) -> float:
    """Volume gained since nominal length, per nominal length, without the scale [m^2]."""
    return law_functions(m.force.law)[law_volume](m, pressure, contraction)


def law_work(m: Parameters, pressure: float, contraction: float, gained: float) -> float:
    """Work at one pressure from nominal length on [N], per nominal length and without the scale.

    Args:
        m: parameters of the muscle.
        pressure: as `law_force` [Pa].
        contraction: kappa [-].
        gained: `law_volume` of the same place [m^2], so that it need not be computed again.
    """
    return law_functions(m.force.law)[law_work](m, pressure, contraction, gained)


def law_derivatives(
    m: Parameters, pressure: float, contraction: float
) -> tuple[float, float, float, float, float]:
    """Force [N], its derivatives by contraction [N] and pressure [m^2], volume [m^2], work [N].

    For a search by Newton's method: where a law has no quicker way the derivatives are difference
    quotients. The arguments are those of `law_force`.
    """
    return law_functions(m.force.law)[law_derivatives](m, pressure, contraction)


def operator_output(m: Parameters, z: Row, x: float) -> float:
    """Output w of the operator, about in [-1, 1].

    Args:
        m: parameters of the muscle.
        z: its memory, of which the operator's states come first.
        x: contraction kappa [-].
    """
    return operator_functions(m.hysteresis.law)[operator_output](m, z, x)


def operator_energy(m: Parameters, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction]; the arguments are those of its output."""
    return operator_functions(m.hysteresis.law)[operator_energy](m, z, x)


def operator_rates(
    m: Parameters, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates of the operator's memory [1/s].

    Args:
        m: parameters of the muscle.
        z: its memory.
        dz: written, as many as the operator has states.
        x: contraction kappa [-].
        x_rate: [1/s].
        timestep: of the explicit Euler step that follows [s].
    """
    operator_functions(m.hysteresis.law)[operator_rates](m, z, dz, x, x_rate, timestep)


OF_LAW = (law_force, law_volume, law_work, law_derivatives)
OF_OPERATOR = (operator_output, operator_energy, operator_rates)
CHOICES: tuple[Callable[..., Any], ...] = (*OF_LAW, *OF_OPERATOR)
"""The functions that stand for another one in each muscle."""

_QUOTIENTS = """force = law_force(m, pressure, contraction)
    rising = (law_force(m, pressure, contraction + apart) - force) / apart
    per_pressure = (law_force(m, pressure + above, contraction) - force) / above
    gained = law_volume(m, pressure, contraction)
    work = law_work(m, pressure, contraction, gained)
    return force, rising, per_pressure, gained, work"""


@functools.cache
def law_functions(code: float) -> dict[Callable[..., Any], FunctionType]:
    """The functions of a force law in the place of `OF_LAW`.

    Each has the arguments and annotations of the function that it stands for, and takes the law's
    own arguments from the muscle's record by their names.

    Args:
        code: of the law, see `pamsim.core.catalog.Catalog.code`.

    Raises:
        EngineError: if it stands for no law that is known here.
    """
    card = FORCE_LAWS.card(FORCE_LAWS.group(code))
    groups = dict.fromkeys(card.numbers, "m.force.") | dict.fromkeys(card.braid_fields, "m.braid.")
    groups |= {"pressure": "", "contraction": ""}
    made: dict[Callable[..., Any], FunctionType] = {}

    def add(place: Callable[..., Any], body: str, own: Any = None, **names: Any) -> None:
        taken = ", ".join(groups[name] + name for name in card.taken_by(own)) if own else ""
        names["own"] = own
        made[place] = _made(place, body.format(f"own({taken})"), code, names, (card.group, None))

    add(law_force, "return {}", card.force_function)
    add(law_volume, "return {}", card.volume_function)
    if card.volume_varies:
        add(law_work, "return {}", card.work_function)
    elif card.work_function is None:
        add(law_work, "return pressure * gained")
    else:
        add(law_work, "return pressure * gained + {}", card.work_function)
    if card.derivatives_function is None:
        parts = {place.__name__: made[place] for place in (law_force, law_volume, law_work)}
        add(law_derivatives, _QUOTIENTS, apart=_APART, above=_ABOVE, **parts)
    else:
        add(law_derivatives, "return {}", card.derivatives_function)
    return made


@functools.cache
def operator_functions(code: float) -> dict[Callable[..., Any], FunctionType]:
    """The functions of a hysteresis operator in the place of `OF_OPERATOR`; see `law_functions`.

    Args:
        code: of the operator; 0 for none, whose output is no number.

    Raises:
        EngineError: if it stands for no operator that is known here.
    """
    bodies, group, own = ("return math.nan", "return math.nan", "pass"), None, (None,) * 3
    if code != 0.0:
        group = OPERATORS.group(code)
        output = "return own(m.hysteresis, z, x)"
        bodies = output, output, "own(m.hysteresis, z, dz, x, x_rate, timestep)"
        own = OPERATORS.card(group).functions
    return {
        place: _made(place, body, code, {"own": function}, (None, group))
        for place, body, function in zip(OF_OPERATOR, bodies, own, strict=True)
    }


def _made(
    place: Callable[..., Any],
    body: str,
    code: float,
    names: dict[str, Any],
    laws: tuple[type[ParameterGroup] | None, type[ParameterGroup] | None],
) -> FunctionType:
    """A function of a body, see `function_of_text`.

    Args:
        place: that it stands for, whose arguments it has.
        body: its text.
        code: of the law.
        names: what it refers to.
        laws: groups whose fields it takes from the record.
    """
    name, where = place.__name__, f"<{place.__name__} of law {code:.0f}>"
    head = f"def {name}{inspect.signature(place)}:".replace("'", "")
    space = {"__name__": __name__, "math": math, **names}
    function = function_of_text(name, f"{head}\n    {body}\n", where, space)
    function.__qualname__ = f"{name}_{code:.0f}"  # where laws meet, each has a name
    vars(function)["laws"] = laws  # where Warp reads them
    return function
