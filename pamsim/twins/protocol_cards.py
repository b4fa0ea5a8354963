"""``pamsim list protocols``: the inputs that synthetic recordings may have."""

from __future__ import annotations

from typing import Any

from pamsim.comparison.protocols import (
    DURATION,
    IMPOSED_MOTIONS,
    PROTOCOLS,
    RATE,
    ImposedMotion,
    Protocol,
)
from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, nearest
from pamsim.recordings.signals import MUSCLE_DRIVES

KINDS = {
    "menu": "pressures or valves; a diagnosis proposes its next experiment from these",
    "machine": "a machine moves the joints",
}
"""Kind of a protocol -> what the kind has in common."""


def protocol_cards(name: str | None = None) -> dict[str, Any]:
    """Describe all protocols, or one; InputError with the nearest if there is none of its name.

    JSON-safe mapping ``protocols``: name, kind of `KINDS`, what it shows, what it commands,
    load [kg], length [s] and sampling rate [Hz] of a trial.
    """
    cards = [
        *(_card("menu", one) for one in PROTOCOLS.values()),
        *(_card("machine", one) for one in IMPOSED_MOTIONS.values()),
    ]
    known = [card["name"] for card in cards]
    if name is not None and name not in known:
        raise InputError(f"no protocol {name!r}; {nearest(name, known)}")
    chosen = [card for card in cards if name in (None, card["name"])]
    return to_dict({"schema": "pamsim-protocols/1", "protocols": chosen})


def _card(kind: str, one: Protocol | ImposedMotion) -> dict[str, Any]:
    return {
        "name": one.name,
        "kind": kind,
        "shows": one.shows,
        "commands": MUSCLE_DRIVES[one.command].meaning,
        "load": one.load,
        "duration": DURATION,
        "rate": RATE,
    }
