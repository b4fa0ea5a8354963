"""All independent models by name, in the order in which they act in a time step."""

from __future__ import annotations

from pamsim.core.errors import InputError, nearest
from pamsim.effects.catalog import EFFECTS
from pamsim.twins.independent_models import (
    command,
    joint,
    measurement,
    muscle,
    outside_effects,
    pneumatic,
    transmission,
)
from pamsim.twins.independent_models.independent_model import IndependentModel

MODELS: dict[str, IndependentModel] = {
    model.name: model
    for layer in (command, pneumatic, muscle, transmission, joint, measurement)
    for model in layer.MODELS
}
"""Name of a library effect -> its independent model."""

OUTSIDE: dict[str, IndependentModel] = {model.name: model for model in outside_effects.MODELS}
"""Name -> effect that the library does not hold."""

ORDER: tuple[str, ...] = (*MODELS, *OUTSIDE)
"""Names in the order in which their laws act in a time step."""


def independent_model(name: str, *, formulation: str) -> IndependentModel | None:
    """The independent model of an effect.

    Args:
        name: of an effect of the library or from outside it.
        formulation: ``library`` or ``independent``: how effects of the library are wanted.

    Returns:
        The model; None for an effect as the library formulates it.

    Raises:
        InputError: if no effect has that name, or the effect has no independent model.
    """
    if name in OUTSIDE:
        return OUTSIDE[name]
    plain = name.partition(":")[0]
    if plain not in EFFECTS:
        raise InputError(f"no effect {plain!r}; {nearest(plain, [*EFFECTS, *OUTSIDE])}")
    if formulation == "library":
        return None
    if name not in MODELS:
        raise InputError(
            f"{name} has no independent model; these have one: {', '.join(sorted(MODELS))}"
        )
    return MODELS[name]
