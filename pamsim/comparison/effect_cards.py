"""``pamsim list effects``: what a diagnosis can name, its look-alikes and what separates them."""

from __future__ import annotations

import os
from typing import Any

from pamsim.comparison.effects_on_rig import candidate, forms, places
from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.effects.catalog import look_up
from pamsim.effects.effect import Effect
from pamsim.engine.rig import Rig, load_rig

SCHEMA = "pamsim-effects/1"


def effect_cards(
    name: str | None = None, rig: str | os.PathLike[str] | None = None
) -> dict[str, Any]:
    """Describe all effects, or one.

    Args:
        name: of one; None for all.
        rig: name of a shipped rig or a rig folder: its own effects are listed as well, and what it
            cannot have is said.

    Returns:
        JSON-safe mapping ``effects``: name, form, link, family, what a model without it is missing,
        equation, parameters, look-alikes and the experiment that separates them; with a rig also
        the joints or muscles that it is tried at, and why it cannot be tried.

    Raises:
        InputError: for an unknown name, with the nearest, or an unknown rig.
    """
    loaded = None if rig is None else load_rig(rig)
    known = forms(loaded)
    chosen = known.values() if name is None else [known[look_up(name, known).name]]
    cards = [_card(one, loaded) for each in chosen for one in each]
    return to_dict({"schema": SCHEMA, "effects": cards})


def _card(one: Effect, rig: Rig | None) -> dict[str, Any]:
    card: dict[str, Any] = {
        "name": one.name,
        "form": one.form,
        "link": one.link,
        "family": one.family,
        "missing": one.missing,
        "equation": one.equation,
        "parameters": [parameter.name for parameter in one.parameters],
        "look_alikes": one.look_alikes,
        "separating": one.separating,
    }
    if rig is None:
        return card
    try:
        candidate(rig, one)
    except InputError as error:
        return {**card, "places": [], "not_tried": str(error)}
    return {**card, "places": [p for p in places(rig, one) if p], "not_tried": None}
