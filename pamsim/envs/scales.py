"""What tasks and observations are scaled by: where joints go, how stiff they can be."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_positions, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.antagonist import joint_stiffness, muscle_stiffness
from pamsim.physics.record import view
from pamsim.physics.static_muscle import static_force

FloatArray = NDArray[np.float64]

LIMIT = 10.0
"""Observations are clipped to +-LIMIT; those of a rig that works stay far inside."""

_PACE = math.pi
"""Of a reference of 0.5 Hz: scales rates and accelerations [rad/s]."""

_SHARE = 0.5
"""Of the largest travel that tasks ask for: the muscles keep pressure to steer with."""

_COMMON = np.linspace(0.25, 0.75, 11)
"""Common pressures, as shares of the top pressure, between which stiffness is asked for; from the
first on at which no joint is slack."""

_PUSH = 0.1
"""Difference of pressures, as a share of the top pressure, whose torque disturbs a joint."""

_LEAST_ARM = 1e-6  # m/rad or 1: a muscle with less does not move the joint
_LEAST_TRAVEL = 1e-6  # rad or m


@dataclass(frozen=True, kw_only=True)
class Reach:
    """What tasks and observations of one joint are scaled by; without load.

    Attributes:
        centre: midway between where the joint goes with the muscles that pull it one way at the
            top pressure, and where it goes with those that pull it the other way [rad or m];
            muscles that do not move it have half the top pressure, or none where the joint would
            stay at its stop.
        travel: largest distance from the centre asked for, half of the possible one [rad or m].
        stiffness: least and largest stiffness of the joint asked for [N m/rad or N/m].
        torque: largest of a disturbance [N m or N].
    """

    centre: float
    travel: float
    stiffness: tuple[float, float]
    torque: float


class JointStiffness:
    """Stiffness of each joint with its valves and the other joints shut.

    Sum of r^2 k over the muscles (Matiskova 2021, equation (5)).

    Args:
        arms: (m, j) moment arms, see `pamsim.engine.equilibrium`.
    """

    def __init__(self, arms: FloatArray) -> None:
        self._arms = arms.T.tolist()

    def __call__(
        self, rows: Sequence[Sequence[float]], length: Sequence[float], pressure: Sequence[float]
    ) -> list[float]:
        """(j,) stiffness [N m/rad or N/m] at tendon lengths [m] and gauge pressures [Pa]."""
        muscles = [
            muscle_stiffness(view(row), at, max(held, 0.0))
            for row, at, held in zip(rows, length, pressure, strict=True)
        ]
        return [joint_stiffness(muscles, arms).total for arms in self._arms]


def reaches_of(rig: Rig, top: float, rest: FloatArray, arms: FloatArray) -> tuple[Reach, ...]:
    """What each recorded joint can do.

    Args:
        rig: the rig.
        top: largest set point of its muscles, gauge [Pa].
        rest: (nq,) its position at rest at equal pressures [rad or m].
        arms: (m, j) moment arms there.

    Raises:
        InputError: if a joint finds no rest or does not move; if a joint is free or a ball.
    """
    rows = rig.model.actuator_user.tolist()
    length = tendon_lengths(rig, rest).tolist()
    stiffness = JointStiffness(arms)
    each = np.array([stiffness(rows, length, [share * top] * len(rows)) for share in _COMMON])
    low, high = each[np.argmax((each > 0.0).all(axis=1))].tolist(), each[-1].tolist()
    change = [
        static_force(view(row), at, (0.5 + 0.5 * _PUSH) * top)
        - static_force(view(row), at, (0.5 - 0.5 * _PUSH) * top)
        for row, at in zip(rows, length, strict=True)
    ]
    found = []
    for joint, (name, at) in enumerate(zip(rig.joints, rig.position_addresses, strict=True)):
        moves = np.abs(arms[:, joint]) > _LEAST_ARM
        # Pressure shortens a muscle, and lengthens an actuator that pushes.
        way = np.where(moves, -np.sign(arms[:, joint]) * np.sign(change), 0.0)
        for others in (0.5, 0.0):
            least, most = (
                rest_positions(rig, top * np.where(moves, 0.5 + side * 0.5 * way, others), rest)[at]
                for side in (-1.0, 1.0)
            )
            if most - least > _LEAST_TRAVEL:
                break
        if not most - least > _LEAST_TRAVEL:
            raise InputError(
                f"rig {rig.name!r}: joint {name!r} goes from {least:.3g} to {most:.3g} with its"
                " muscles at the top pressure, so that no task can be set for it; leave it out"
                " of [rig] joints, or check its tendons"
            )
        found.append(
            Reach(
                centre=float(0.5 * (most + least)),
                travel=float(_SHARE * 0.5 * (most - least)),
                stiffness=(low[joint], high[joint]),
                torque=0.5 * float(np.abs(arms[:, joint]) @ np.abs(change)),
            )
        )
    return tuple(found)


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservedSignals:
    """Names and scales of the numbers of an observation: each is (signal - centre) / scale.

    Attributes:
        names: such as ``elbow.angle``, ``biceps.pressure`` or ``elbow.angle_set``.
        units: of the signals, SI.
        centre: (n,) signal that is observed as 0.
        scale: (n,) change of the signal that is observed as 1.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    centre: FloatArray
    scale: FloatArray

    def si(self, observation: ArrayLike) -> FloatArray:
        """Signals (..., n) [SI] of observations."""
        return np.asarray(observation) * self.scale + self.centre

    def named(self, observation: ArrayLike) -> dict[str, float]:
        """Signals [SI] of one observation by name."""
        return dict(zip(self.names, self.si(observation).tolist(), strict=True))


def observed_signals(
    joints: Mapping[str, str], muscles: Iterable[str], reaches: Sequence[Reach], supply: float
) -> ObservedSignals:
    """Signals of a rig, in the order of observations.

    Args:
        joints: name -> ``angle`` or ``position``.
        muscles: names.
        reaches: of the joints.
        supply: pressure [Pa].
    """

    def of_joints(power: int, suffix: str) -> list[tuple[str, str, float, float]]:
        rows = []
        for (name, kind), reach in zip(joints.items(), reaches, strict=True):
            what = (kind, "velocity", "acceleration")[power] + suffix
            unit = ("rad" if kind == "angle" else "m") + ("", "/s", "/s^2")[power]
            centre = reach.centre if power == 0 else 0.0
            rows.append((f"{name}.{what}", unit, centre, reach.travel * _PACE**power))
        return rows

    rows = [
        *of_joints(0, ""),
        *of_joints(1, ""),
        *((f"{name}.pressure", "Pa", 0.5 * supply, 0.5 * supply) for name in muscles),
        *(row for power in range(3) for row in of_joints(power, "_set")),
        *(
            (f"{name}.stiffness_set", "N m/rad" if kind == "angle" else "N/m", 0.0, most)
            for (name, kind), (_, most) in zip(
                joints.items(), (reach.stiffness for reach in reaches), strict=True
            )
        ),
    ]
    names, units, centre, scale = zip(*rows, strict=True)
    return ObservedSignals(names=names, units=units, centre=np.array(centre), scale=np.array(scale))
