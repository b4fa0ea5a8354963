"""What tasks and observations are scaled by: where joints go, how stiff they can be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import moment_arms, rest_positions, tendon_lengths
from pamsim.engine.joint_stiffness import stiffness_of_joints
from pamsim.engine.rig import Rig
from pamsim.physics.record import view
from pamsim.physics.static_muscle import static_force

LIMIT = 10.0
"""Observations are clipped to +-LIMIT; those of a rig that works stay far inside."""

_PACE = math.pi  # rad/s, of a reference of 0.5 Hz: scales rates and accelerations
_SHARE = 0.5  # of the largest travel is asked for: the muscles keep pressure to steer with
_PUSH = 0.1  # difference of pressures, per top pressure, whose torque disturbs a joint
_LEAST_ARM = 1e-6  # m/rad or 1: a muscle with less does not move the joint
_LEAST_TRAVEL = 1e-6  # rad or m

_COMMON = np.linspace(0.25, 0.75, 11)
"""Common pressures, as shares of the top pressure, between which stiffness is asked for; from the
first on at which no joint is slack."""


@dataclass(frozen=True, kw_only=True)
class Reach:
    """What tasks and observations of one joint are scaled by; without load.

    Attributes:
        centre: midway between where the joint goes with the muscles that pull it one way at the
            top pressure, and with those that pull it the other way [rad or m]; the others have half
            the top pressure, or none where the joint would stay at its stop.
        travel: largest distance from the centre asked for, half of the possible one [rad or m].
        stiffness: least and largest stiffness of the joint asked for [N m/rad or N/m].
        torque: largest of a disturbance [N m or N].
    """

    centre: float
    travel: float
    stiffness: tuple[float, float]
    torque: float


def reaches_of(rig: Rig, top: float) -> tuple[tuple[Reach, ...], FloatArray]:
    """What each recorded joint can do, with set points up to ``top``, gauge [Pa].

    Returns the joints' reaches, and the moment arms (m, j) of the muscles at rest at equal
    pressures.

    Raises:
        InputError: if a joint finds no rest or does not move; if a joint is free or a ball.
    """
    muscles = [*map(view, rig.model.actuator_user)]
    rest = rest_positions(rig, np.full(len(muscles), 0.5 * top), rig.model.qpos0.copy())
    arms, length = moment_arms(rig, rest), tendon_lengths(rig, rest).tolist()
    each = np.array(
        [stiffness_of_joints(arms, muscles, length, [p * top] * len(muscles)) for p in _COMMON]
    )
    stiffness = np.array([each[np.argmax((each > 0.0).all(axis=1))], each[-1]]).T.tolist()
    change = [
        static_force(muscle, at, (0.5 + 0.5 * _PUSH) * top)
        - static_force(muscle, at, (0.5 - 0.5 * _PUSH) * top)
        for muscle, at in zip(muscles, length, strict=True)
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
        else:
            raise InputError(
                f"rig {rig.name!r}: joint {name!r} goes from {least:.3g} to {most:.3g} with its"
                f" muscles at the top pressure of {top:g} Pa, so that no task can be set for it;"
                " leave it out of [rig] joints, or check its tendons"
            )
        found.append(
            Reach(
                centre=float(0.5 * (most + least)),
                travel=float(_SHARE * 0.5 * (most - least)),
                stiffness=tuple(stiffness[joint]),
                torque=0.5 * float(np.abs(arms[:, joint]) @ np.abs(change)),
            )
        )
    return tuple(found), arms


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


def observed_signals(rig: Rig, reaches: Sequence[Reach], top: float) -> ObservedSignals:
    """Signals of a rig in the order of observations; a pressure ``top`` [Pa] is observed as 1."""

    def motion(order: int, suffix: str = "") -> Iterator[tuple[str, str, float, float]]:
        for (name, kind), reach in zip(rig.joints.items(), reaches, strict=True):
            unit, stiffness = ("rad", "N m/rad") if kind == "angle" else ("m", "N/m")
            signal, unit, centre, scale = (
                (kind, unit, reach.centre, reach.travel),
                ("velocity", f"{unit}/s", 0.0, reach.travel * _PACE),
                ("acceleration", f"{unit}/s^2", 0.0, reach.travel * _PACE**2),
                # No stiffness is asked of a joint that is slack at every pressure.
                ("stiffness", stiffness, 0.0, reach.stiffness[1] or 1.0),
            )[order]
            yield f"{name}.{signal}{suffix}", unit, centre, scale

    pressures = [(f"{muscle}.pressure", "Pa", 0.5 * top, 0.5 * top) for muscle in rig.muscles]
    wanted = (row for order in range(4) for row in motion(order, "_set"))
    names, units, centre, scale = zip(*motion(0), *motion(1), *pressures, *wanted, strict=True)
    return ObservedSignals(names=names, units=units, centre=np.array(centre), scale=np.array(scale))
