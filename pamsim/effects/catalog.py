"""All effects, in the order in which searches try them: from joint to sensor, then at rest."""

from __future__ import annotations

from collections.abc import Mapping

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
from pamsim.effects.effect import AT, Effect

_ALL: tuple[Effect, ...] = tuple(
    effect
    for table in (joint, muscle, pneumatic, command, transmission, measurement, muscle_at_rest)
    for effect in table.EFFECTS
)

FORMS: dict[str, tuple[Effect, ...]] = {
    name: tuple(effect for effect in _ALL if effect.name == name)
    for name in dict.fromkeys(effect.name for effect in _ALL)
}
"""Name -> its forms: formulas of the same physics, the usual one first."""

EFFECTS: dict[str, Effect] = {name: forms[0] for name, forms in FORMS.items()}
"""Name -> effect in its usual form. Searches try them in this order."""

TRIAL_EFFECTS: tuple[str, ...] = tuple(
    effect.name for effect in EFFECTS.values() if effect.in_trials
)
"""Names of the effects that recordings over time are searched for unless others are named."""

ROW_EFFECTS: tuple[str, ...] = tuple(effect.name for effect in EFFECTS.values() if not effect.rare)
"""Names of the effects that tables at rest are searched for unless others are named."""


def effect(name: str) -> Effect:
    """Look an effect up.

    Args:
        name: such as ``coulomb_friction``, or with a form, ``coulomb_friction:dahl``; the place in
            ``coulomb_friction at elbow`` is left to the rig.

    Raises:
        InputError: if there is none of that name or form, with the nearest.
    """
    return look_up(name, FORMS)


def look_up(name: str, known: Mapping[str, tuple[Effect, ...]]) -> Effect:
    """Look an effect up among those of a rig, name -> forms; otherwise as `effect`."""
    plain, colon, form = name.partition(AT)[0].partition(":")
    if plain not in known:
        raise InputError(f"no effect {plain!r}; {nearest(plain, known)}")
    if not colon:
        return known[plain][0]
    forms = {effect.form: effect for effect in known[plain] if effect.form}
    if form not in forms:
        raise InputError(f"{plain} has no form {form!r}; {nearest(form, forms)}")
    return forms[form]
