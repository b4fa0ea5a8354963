"""All effects, in the order of the layers from joint to sensor."""

from __future__ import annotations

from pamsim.core.errors import InputError, nearest
from pamsim.effects import (
    command,
    joint,
    measurement,
    muscle,
    muscle_at_rest,
    pneumatic,
    transmission,
)
from pamsim.effects.effect import Effect

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for layer in (joint, muscle, pneumatic, command, transmission, measurement, muscle_at_rest)
    for effect in layer.EFFECTS
}
"""Name -> effect. Searches try them in this order."""

TRIAL_EFFECTS: tuple[str, ...] = tuple(
    effect.name for effect in EFFECTS.values() if effect.in_trials
)
"""Names of the effects that recordings over time are searched for."""


def effect(name: str) -> Effect:
    """Look an effect up.

    Raises:
        InputError: if there is none of that name, with the nearest.
    """
    if name not in EFFECTS:
        raise InputError(f"no effect {name!r}; {nearest(name, EFFECTS)}")
    return EFFECTS[name]
