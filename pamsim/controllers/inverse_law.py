"""Inverse of the muscles' force law: pressures at which the pair gives a torque, and a stiffness.

At a common pressure p0 the torque of the pair rises with the pressure difference; among the pairs
of pressures that give one torque, the stiffness rises with p0. So each is the root of a function of
one unknown, sought inside the limits of the supply. Hysteresis is left out, as in
`pamsim.physics.antagonist`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import scipy.optimize

from pamsim.controllers.arm import Arm
from pamsim.controllers.controller import Command
from pamsim.controllers.operating_point import PressureSplit
from pamsim.physics.antagonist import antagonist_torque, joint_stiffness, muscle_stiffness

# scipy carries no types: what it returns is Any at this file's boundary.
_root: Any = scipy.optimize.brentq

_NEAR = 1e-4  # Pa, far below what turns the arm by 1e-6 rad


def balanced_pressures(arm: Arm, angle: float, torque: float, common: float) -> Command:
    """Pressures at which the pair gives a torque, the common pressure given.

    Args:
        arm: the arm.
        angle: of it [rad].
        torque: wanted of both muscles, towards positive angles [N m].
        common: mean of both pressures where neither is limited, gauge [Pa].

    Returns:
        Gauge pressures of muscles 1 and 2 [Pa]; for a torque out of reach, those that come nearest.

    Raises:
        InputError: if the common pressure is not between 0 and the supply.
    """
    split = PressureSplit(common=common, supply=arm.supply)

    def miss(difference: float) -> float:
        pressures = split.pressures(difference)
        return antagonist_torque(arm.pair, arm.radius, angle, pressures) - torque

    widest = 2.0 * max(common, arm.supply - common)
    return split.pressures(_nearest_root(miss, -widest, widest))


def stiff_pressures(arm: Arm, angle: float, torque: float, stiffness: float) -> Command:
    """Pressures at which the pair gives a torque and the joint a stiffness.

    Args:
        arm: the arm.
        angle: of it [rad].
        torque: wanted of both muscles [N m].
        stiffness: wanted of the joint, see `shut_stiffness` [N m/rad].

    Returns:
        Gauge pressures of muscles 1 and 2 [Pa]; for a stiffness out of reach, those that come
        nearest among the pairs that give the torque.
    """

    def miss(common: float) -> float:
        pressures = balanced_pressures(arm, angle, torque, common)
        return shut_stiffness(arm, angle, pressures) - stiffness

    low, high = _able(arm, angle, torque)
    return balanced_pressures(arm, angle, torque, _nearest_root(miss, low, high))


def shut_stiffness(arm: Arm, angle: float, pressures: Command) -> float:
    """Stiffness of the joint with all valves shut [N m/rad].

    Args:
        arm: the arm.
        angle: of it [rad].
        pressures: of muscles 1 and 2, gauge [Pa].
    """
    lengths = -arm.radius * angle, arm.radius * angle
    muscles = [
        muscle_stiffness(row, length, pressure)
        for row, length, pressure in zip(arm.pair, lengths, pressures, strict=True)
    ]
    return joint_stiffness(muscles, (arm.radius, arm.radius)).total


def _able(arm: Arm, angle: float, torque: float) -> tuple[float, float]:
    """Least and greatest common pressure at which no muscle need go below 0 or above the supply."""
    # Along pairs of one torque both pressures rise together, to where one meets a limit.
    least = balanced_pressures(arm, angle, torque, 0.0)
    most = balanced_pressures(arm, angle, torque, arm.supply)
    return sum(least) / 2.0, sum(most) / 2.0


def _nearest_root(miss: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function vanishes, or the end of the interval that comes nearest."""
    if miss(low) >= 0.0:
        return low
    if miss(high) <= 0.0:
        return high
    return float(_root(miss, low, high, xtol=_NEAR))
