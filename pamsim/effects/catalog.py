"""All effects, in the order in which searches try them: from joint to sensor, then at rest.

Their cards are in the files of ``pamsim/data/effects/``, one for each part of the chain. Fields are
those of `Effect` and `EffectParameter`; what all forms of an effect share stands above them. A
parameter has its name under its kind, such as ``shape``, and is one of the file's ``shared``
parameters where a name alone is given. A family states its link, and what is missing.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.effects.effect import (
    AT,
    Effect,
    EffectParameter,
    change,
    factor,
    own_shape,
    shape,
    size,
)

_FILES = ("joint", "muscle", "air", "command", "transmission", "sensor", "muscle_at_rest")

_KINDS = {
    "size": size,
    "change": change,
    "factor": factor,
    "shape": shape,
    "own_shape": own_shape,
}


def _read(file: str) -> dict[str, Any]:
    path = resources.files("pamsim") / "data" / "effects" / f"{file}.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _fields(card: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in card.items()}


def _parameter(card: Mapping[str, Any]) -> EffectParameter:
    fields = _fields(card)
    (kind,) = _KINDS.keys() & fields.keys()
    name, (low, high) = fields.pop(kind), fields.pop("range")
    return _KINDS[kind](name, fields.pop("typical"), low, high, **fields)


def _forms(document: Mapping[str, Any]) -> Iterator[Effect]:
    """The effects of a file, each in all of its forms."""
    shared = document.get("shared", {})
    for card in document["effect"]:
        for form in card.pop("forms", [{}]):
            fields = _fields({**card, **form})
            stated = [shared[p] if isinstance(p, str) else p for p in fields["parameters"]]
            fields["parameters"] = tuple(map(_parameter, stated))
            yield Effect(link=_FAMILY_CARDS[card["family"]]["link"], **fields)


_DOCUMENTS = {file: _read(file) for file in _FILES}
_FAMILY_CARDS = {name: card for one in _DOCUMENTS.values() for name, card in one["family"].items()}

FAMILIES: dict[str, str] = {name: card["words"] for name, card in _FAMILY_CARDS.items()}
"""Family -> what is missing, as the end of a sentence."""

PARTS: dict[str, tuple[Effect, ...]] = {
    name: tuple(_forms(document)) for name, document in _DOCUMENTS.items()
}
"""File of the cards -> their effects, in all of their forms."""

_ALL = [effect for part in PARTS.values() for effect in part]

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
