"""What an arm can do: how far it turns, how stiff it can be made, how hard it pulls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.antagonist import joint_stiffness, muscle_stiffness
from pamsim.actuator.static_muscle import static_force
from pamsim.engine.callback import muscle_ids
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig

_SHARE = 0.5
"""Of the largest angle that tasks ask for: both muscles keep pressure to steer with."""

_LOW, _HIGH = 0.25, 0.75
"""Common pressures, as shares of the supply's, between which stiffness is asked for."""

_PUSH = 0.1
"""Difference of pressures, as a share of the supply's, whose torque disturbs the arm."""

_TURN = 1e-5  # rad, for moment arms


@dataclass(frozen=True, kw_only=True)
class Reach:
    """What tasks are scaled by.

    Attributes:
        angle: largest angle asked for [rad].
        stiffness: least and largest stiffness of the joint asked for [N m/rad].
        torque: of a disturbance [N m].
    """

    angle: float
    stiffness: tuple[float, float]
    torque: float


class JointStiffness:
    """Stiffness of the joint between two shut muscles (Matiskova 2021, equation (5)).

    Args:
        rig: whose moment arms count; they are taken at angle 0.
    """

    def __init__(self, rig: Rig) -> None:
        self._radii = moment_arms(rig)

    def __call__(
        self, rows: Sequence[Sequence[float]], length: Sequence[float], pressure: Sequence[float]
    ) -> float:
        """Stiffness [N m/rad] at tendon lengths [m] and gauge pressures [Pa] of both muscles."""
        muscles = [
            muscle_stiffness(row, at, max(held, 0.0))
            for row, at, held in zip(rows, length, pressure, strict=True)
        ]
        return joint_stiffness(muscles, self._radii).total


def moment_arms(rig: Rig) -> list[float]:
    """Change of each tendon's length with the angle, at angle 0 [m]."""
    lengths = [tendon_lengths(rig, turn) for turn in (-_TURN, _TURN)]
    return ((lengths[1] - lengths[0]) / (2.0 * _TURN)).tolist()


def tendon_lengths(rig: Rig, angle: float) -> NDArray[np.float64]:
    """(m,) lengths of the muscles' tendons at an angle [m]."""
    model, data = rig.model, mujoco.MjData(rig.model)
    data.qpos[rig.angle_address] = angle
    mujoco.mj_fwdPosition(model, data)
    return data.actuator_length[[model.actuator_outadr[i] for i in muscle_ids(model)]].copy()


def reach_of(rig: Rig) -> Reach:
    """What a rig can do, without load."""
    supply = rig.supply_pressure
    ends = np.array([[supply, 0.0], [0.0, supply]])
    farthest = float(np.nanmin(np.abs(rest_angles(rig, ends, np.zeros(2)))))
    rows = rig.model.actuator_user.tolist()
    length = tendon_lengths(rig, 0.0).tolist()
    stiffness = JointStiffness(rig)
    low, high = (stiffness(rows, length, [share * supply] * 2) for share in (_LOW, _HIGH))
    base = 0.5 * supply
    first, second = (
        static_force(row, at, base + turn * 0.5 * _PUSH * supply)
        for row, at, turn in zip(rows, length, (1.0, -1.0), strict=True)
    )
    return Reach(
        angle=_SHARE * farthest,
        stiffness=(low, high),
        torque=abs(moment_arms(rig)[0]) * abs(first - second),
    )
