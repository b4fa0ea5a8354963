"""The unit in which a number is written: that of the rig's file, or one that people use."""

from __future__ import annotations

from pamsim.core.units import COMMON, to_si
from pamsim.engine.parameters import RigParameter


def readable_unit(parameter: RigParameter) -> str:
    """Unit that the rig's file has a parameter in; a common one if the file does not state it."""
    if parameter.stated is not None:
        return parameter.stated.unit
    return COMMON.get(parameter.spec.unit, parameter.spec.unit)


def readable(parameter: RigParameter, value: float) -> float:
    """A value [SI] in the unit of `readable_unit`."""
    return to_si(value, parameter.spec.unit, readable_unit(parameter), where=parameter.name)


def readable_interval(
    parameter: RigParameter, interval: tuple[float, float] | None
) -> tuple[float, float] | None:
    """Both ends of an interval [SI] in the unit of `readable_unit`; None if it is not known."""
    if interval is None:
        return None
    low, high = interval
    return readable(parameter, low), readable(parameter, high)
