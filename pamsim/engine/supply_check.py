"""Refuse a supply that its muscles state differently."""

from __future__ import annotations

import mujoco

from pamsim.actuator.layout import slot
from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids

_LINE, _RESISTANCE = slot("valve.supply_line"), slot("valve.supply_resistance")
_SHARED = (
    "valve.supply_pressure",
    "valve.supply_resistance",
    "valve.supply_volume",
    "chamber.temperature",
    "chamber.atmosphere",
)


def check_supply(model: mujoco.MjModel) -> None:
    """Check that muscles on one supply with resistance state the same supply.

    Raises:
        InputError: naming the first two that differ, and in what.
    """
    first: dict[float, int] = {}
    rows = model.actuator_user
    for index in muscle_ids(model):
        other = first.setdefault(float(rows[index, _LINE]), index)
        if max(rows[index, _RESISTANCE], rows[other, _RESISTANCE]) == 0.0:
            continue
        for name in _SHARED:
            if rows[index, slot(name)] != rows[other, slot(name)]:
                raise InputError(
                    f"{model.actuator(other).name} and {model.actuator(index).name} share a supply:"
                    f" give both one {name}, or each its own valve.supply_line"
                )
