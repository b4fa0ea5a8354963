"""Check supplies: muscles on one state the same, and commands ask for no more than it has."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.muscle import Muscle
from pamsim.physics.muscle_valves import SENSOR_ERROR
from pamsim.physics.record import slot
from pamsim.recordings.experiment import Experiment

_LINE = slot("valve.supply_line")
_FALL = [slot("valve.supply_resistance"), slot("valve.supply_square")]
_SHARED = (
    "valve.supply_pressure",
    "valve.supply_resistance",
    "valve.supply_square",
    "valve.supply_volume",
    "chamber.temperature",
    "chamber.atmosphere",
)


def above_supply(
    muscles: Mapping[str, Muscle], experiments: Iterable[Experiment]
) -> tuple[str, ...]:
    """What experiments ask of the supply that it does not have, a sentence for each muscle.

    Args:
        muscles: of the rig that runs them, in actuator order.
        experiments: commands in that order; measured pressures ask nothing of the supply.
    """
    highest: dict[tuple[str, str], float] = {}
    for experiment in experiments:
        for i, (name, kind) in enumerate(zip(muscles, experiment.drives.muscles, strict=True)):
            asked = {"start pressure": float(experiment.start_pressure[i])}
            if kind == "pressure_set":
                asked["set point"] = float(experiment.command_value[:, i].max())
            for what, pressure in asked.items() if kind != "measured" else ():
                highest[name, what] = max(pressure, highest.get((name, what), 0.0))
    return tuple(
        f"{name}: a {what} of {pressure / 1e3:.4g} kPa is above its supply; the simulation has the"
        f" supply's {supply / 1e3:.4g} kPa instead"
        for (name, what), pressure in highest.items()
        if pressure > (1.0 + SENSOR_ERROR) * (supply := muscles[name].valve.supply_pressure)
    )


def refuse_above_supply(muscles: Mapping[str, Muscle], experiment: Experiment) -> None:
    """Refuse an experiment that asks more of the supply than it has.

    Args:
        muscles: of the rig that runs it, in actuator order.
        experiment: commands in that order.

    Raises:
        InputError: naming the first muscle, and what the simulation would have instead.
    """
    for above in above_supply(muscles, [experiment]):
        raise InputError(f"{above}; lower it, or raise valve.supply_pressure")


def check_supply(model: mujoco.MjModel) -> None:
    """Check that muscles on one supply with resistance state the same supply.

    Raises:
        InputError: naming the first two that differ, and in what.
    """
    first: dict[float, int] = {}
    rows = model.actuator_user
    for index in muscle_ids(model):
        other = first.setdefault(float(rows[index, _LINE]), index)
        if not np.any(rows[[[index], [other]], _FALL]):
            continue
        for name in _SHARED:
            if rows[index, slot(name)] != rows[other, slot(name)]:
                raise InputError(
                    f"{model.actuator(other).name} and {model.actuator(index).name} share a supply:"
                    f" give both one {name}, or each its own valve.supply_line"
                )
