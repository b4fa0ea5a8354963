"""Refuse a chain whose two ends state different backlash."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import slot

_PARTNER = slot("partner")


def check_backlash(model: mujoco.MjModel, muscles: Mapping[str, Muscle]) -> None:
    """Check that both muscles of a chain state the same backlash: the chain shifts as a whole.

    Args:
        model: set up for an experiment.
        muscles: its muscles, in actuator order.

    Raises:
        InputError: if they differ in backlash, or in the damping of the chain within it.
    """
    named = dict(zip(muscle_ids(model), muscles, strict=True))
    for index, name in named.items():
        partner = named.get(int(model.actuator_user[index, _PARTNER]) - 1)
        if partner is None:
            continue
        first, second = muscles[name].chain, muscles[partner].chain
        if first.backlash != second.backlash:
            raise InputError(f"{name} and {partner} share a chain: give both one chain.backlash")
        if first.backlash > 0.0 and first.seating_damping != second.seating_damping:
            raise InputError(
                f"{name} and {partner} share a chain: give both one chain.seating_damping"
            )
