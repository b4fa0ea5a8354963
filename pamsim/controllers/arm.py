"""Inverse dynamics of the arm: the torque that a motion needs, read once from the MuJoCo model.

Gravity gives a hinge the torque a cos(beta) + b sin(beta), a linear spring adds c - k beta. These
four numbers hold at every angle. They are fitted to the engine at several angles, so that the
controller needs no engine and no table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.record import view

_ANGLES = np.linspace(-1.0, 1.0, 9)  # rad
_EXACT = 1e-9  # of the largest torque or length: rounding lies far below

_SLOW = 0.02
"""Rate at which dry friction has reached three quarters of its size [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Arm:
    """An arm of one hinge between two equal-armed muscles.

    Attributes:
        pair: parameter rows of muscles 1 and 2, see `pamsim.physics.record`.
        radius: moment arm of both [m].
        rest_torque: (c, a, b, -k) of c + a cos(beta) + b sin(beta) - k beta, the torque on the arm
            at rest but for the muscles' [N m].
        inertia: load and rotor included [kg m^2].
        damping: [N m s/rad].
        friction: dry, in the joint [N m].
        supply: lowest supply pressure of both, gauge [Pa].
    """

    pair: tuple[tuple[float, ...], tuple[float, ...]]
    radius: float
    rest_torque: tuple[float, float, float, float]
    inertia: float
    damping: float
    friction: float
    supply: float

    def muscle_torque(self, angle: float, rate: float = 0.0, acceleration: float = 0.0) -> float:
        """Torque that the muscles must give for a motion [N m].

        Args:
            angle: [rad].
            rate: [rad/s].
            acceleration: [rad/s^2].
        """
        constant, cosine, sine, slope = self.rest_torque
        rest = constant + cosine * math.cos(angle) + sine * math.sin(angle) + slope * angle
        dry = self.friction * math.tanh(rate / _SLOW)
        return self.inertia * acceleration + self.damping * rate + dry - rest

    @classmethod
    def for_rig(cls, rig: Rig, *, load: float = 0.0) -> Arm:
        """Read an arm from a rig.

        Elastic chains, backlash and friction along the tendons are neglected.

        Args:
            rig: of one hinge and two muscles that pull it opposite ways on equal arms.
            load: mass on the arm [kg].

        Raises:
            InputError: if the rig is not of that kind.
        """
        model = rig.model_for(load=load)
        muscles = muscle_ids(model)
        if model.nv != 1 or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_HINGE or len(muscles) != 2:
            raise InputError(
                f"rig {rig.name!r} is not one hinge between two muscles; controllers of the"
                " pressure difference need one that is"
            )
        data = mujoco.MjData(model)
        torques = np.empty(_ANGLES.size)
        lengths = np.empty((_ANGLES.size, 2))
        tendons = [int(model.actuator_trnid[i, 0]) for i in muscles]
        for k, angle in enumerate(_ANGLES):
            data.qpos[0] = angle
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            torques[k] = data.qfrc_passive[0] - data.qfrc_bias[0]
            lengths[k] = data.ten_length[tendons]
        radius = float(lengths[-1, 1] - lengths[0, 1]) / float(_ANGLES[-1] - _ANGLES[0])
        law = radius * np.outer(_ANGLES, (-1.0, 1.0))
        if not np.max(np.abs(lengths - law)) <= _EXACT * abs(radius):
            raise InputError(
                f"rig {rig.name!r}: its tendons are not -/+ r beta long, as over a sprocket"
            )
        inertia = np.empty((1, 1))
        mujoco.mj_fullM(model, data, inertia)
        first, second = (view(model.actuator_user[i]) for i in muscles)
        return cls(
            pair=(first, second),
            radius=radius,
            rest_torque=_rest_torque(rig.name, torques),
            inertia=float(inertia[0, 0]),
            damping=float(model.dof_damping[0]),
            friction=float(model.dof_frictionloss[0]),
            supply=min(first.valve.supply_pressure, second.valve.supply_pressure),
        )


def _rest_torque(name: str, torques: np.ndarray) -> tuple[float, float, float, float]:
    design = np.column_stack([np.ones(_ANGLES.size), np.cos(_ANGLES), np.sin(_ANGLES), _ANGLES])
    coefficients = np.linalg.lstsq(design, torques, rcond=None)[0]
    scale = max(float(np.max(np.abs(torques))), _EXACT)
    if not np.max(np.abs(design @ coefficients - torques)) <= _EXACT * scale:
        raise InputError(
            f"rig {name!r}: what loads its hinge at rest is not gravity and a linear spring"
        )
    constant, cosine, sine, slope = map(float, coefficients)
    return constant, cosine, sine, slope
