"""The range of each muscle's control, as the engine's models state it."""

from __future__ import annotations

import mujoco

from pamsim.engine.stepping import muscle_ids
from pamsim.physics.commands import MEASURED, PRESSURE_SET
from pamsim.physics.record import Row, slot

_COMMAND, _SUPPLY = slot("command"), slot("valve.supply_pressure")


def control_range(par: Row) -> tuple[float, float] | None:
    """Ends of the range of a muscle's control; None for a measured pressure, which has none.

    Args:
        par: parameter row.

    Returns:
        Gauge pressures [Pa] of a set point, up to the supply's; -1 and 1 of a valve or duty.
    """
    if par[_COMMAND] == MEASURED:
        return None
    return (0.0, float(par[_SUPPLY])) if par[_COMMAND] == PRESSURE_SET else (-1.0, 1.0)


def state_control_ranges(model: mujoco.MjModel) -> None:
    """Write ``actuator_ctrlrange`` of all muscles of a model, which sliders and users go by.

    It changes no step: the valves' laws hold beyond it, too.
    """
    for index in muscle_ids(model):
        ends, at = control_range(model.actuator_user[index]), model.actuator_ctrladr[index]
        model.actuator_ctrllimited[at] = ends is not None
        model.actuator_ctrlrange[at] = ends or 0.0
