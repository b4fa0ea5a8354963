"""All hidden effects of the independent plant by name."""

from __future__ import annotations

from pamsim.core.errors import InputError, nearest
from pamsim.effects.catalog import EFFECTS
from tests.plant.hidden import air_effects, joint_effects, muscle_effects, sensor_effects
from tests.plant.hidden.hidden_effect import PlantEffect

PLANT_EFFECTS: dict[str, PlantEffect] = {
    effect.name: effect
    for layer in (joint_effects, muscle_effects, air_effects, sensor_effects)
    for effect in layer.EFFECTS
}
"""Name -> hidden effect. Sensors act in this order on what the plant does."""


def other_formula(name: str) -> PlantEffect:
    """A hidden effect by its name, or the first that has a library effect by another formula."""
    if name in PLANT_EFFECTS:
        return PLANT_EFFECTS[name]
    name = name.partition(":")[0]
    if name not in EFFECTS:
        raise InputError(f"no effect {name!r}; {nearest(name, [*EFFECTS, *PLANT_EFFECTS])}")
    for effect in PLANT_EFFECTS.values():
        if name in effect.stands_for:
            return effect
    known = sorted({n for effect in PLANT_EFFECTS.values() for n in effect.stands_for})
    raise InputError(f"{name} has no other formula; these have one: {', '.join(known)}")
