"""Functions of the kernel that have no counterpart on a GPU: their result is no number.

Laws from outside the package reach the CPU's kernel by a pointer. The sag of a shared supply is
searched to the rounding of double precision, which single precision never reaches.
"""

from __future__ import annotations

import math
from types import FunctionType

from pamsim.physics.force_laws.dispatch import user_force, user_volume, user_work
from pamsim.physics.hysteresis.dispatch import user_energy, user_output, user_rates
from pamsim.physics.layout import MutableRow, Row
from pamsim.physics.supply import Valves, supply_sag


def no_law(law: float, par: Row, f: int, braid: int, pressure: float, contraction: float) -> float:
    """In the place of `user_force`, `user_volume` and `user_work`."""
    return math.nan


def no_output(law: float, par: Row, first: int, act: Row, x: float) -> float:
    """In the place of `user_output` and `user_energy`."""
    return math.nan


def no_rates(
    law: float,
    par: Row,
    first: int,
    act: Row,
    rates: MutableRow,
    x: float,
    x_rate: float,
    timestep: float,
) -> None:
    """In the place of `user_rates`."""
    rates[0] = math.nan


def no_sag(
    valves: Valves, resistance: float, square: float, storage: float, before: float
) -> float:
    """In the place of `supply_sag` in single precision."""
    return math.nan


OUTSIDE: dict[FunctionType, FunctionType] = {
    user_force: no_law,
    user_volume: no_law,
    user_work: no_law,
    user_output: no_output,
    user_energy: no_output,
    user_rates: no_rates,
}
"""Function of the kernel -> the one in its place, in any precision."""

IN_SINGLE: dict[FunctionType, FunctionType] = {supply_sag: no_sag}
"""The same, in single precision."""
