"""Feed-forward of the arm by its inverse dynamics and force law, alone or with a PID.

Gravity gives a hinge the torque a cos(beta) + b sin(beta), a linear spring adds c - k beta. These
four numbers hold at every angle. They are fitted to the engine at several angles, so that the
controller needs no engine and no table.

At a common pressure p0 the torque of the pair rises with the pressure difference; among the pairs
of pressures that give one torque, the stiffness rises with p0. So each is the root of a function of
one unknown, sought inside the limits of the supply. The force law is without hysteresis, as in
`pamsim.physics.antagonist`; the muscles' is undone, if asked, on the wanted angle before it enters
the law (`pamsim.controllers.hysteresis`).

A regulated pressure lags its set point, and valves may open late; ``lead`` looks that much further
along the wanted motion, which for a lag of that time constant is its inverse to first order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np
import scipy.optimize

from pamsim.controllers.cascade import regulated_lag
from pamsim.controllers.controller import Command, Observation, PressureSplit, present_reference
from pamsim.controllers.pid import PidLaw, PidMemory
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.antagonist import antagonist_torque, joint_stiffness, muscle_stiffness
from pamsim.physics.chosen_law import law_pushes
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from pamsim.physics.record import Parameters, view

# scipy carries no types: what it returns is Any at this file's boundary.
_root: Any = scipy.optimize.brentq

_ANGLES = np.linspace(-1.0, 1.0, 9)  # rad
_SHAPES = np.column_stack([np.ones(_ANGLES.size), np.cos(_ANGLES), np.sin(_ANGLES), _ANGLES])
_EXACT = 1e-9  # of the largest torque or length: rounding lies far below
_NEAR = 1e-4  # Pa, far below what turns the arm by 1e-6 rad
_SLOW = 0.02  # rate at which dry friction has reached three quarters of its size [rad/s]


@dataclass(frozen=True, kw_only=True)
class Arm:
    """An arm of one hinge between two equal-armed muscles.

    Attributes:
        pair: parameters of muscles 1 and 2, see `pamsim.physics.record`.
        radius: moment arm of both [m].
        rest_torque: (c, a, b, -k), the torque on the arm at rest but for the muscles' [N m].
        inertia: load and rotor included [kg m^2].
        damping: [N m s/rad].
        friction: dry, in the joint [N m].
        supply: lowest supply pressure of both, gauge [Pa].
    """

    pair: tuple[Parameters, Parameters]
    radius: float
    rest_torque: tuple[float, float, float, float]
    inertia: float
    damping: float
    friction: float
    supply: float

    def muscle_torque(self, angle: float, rate: float = 0.0, acceleration: float = 0.0) -> float:
        """Torque [N m] that the muscles must give at an angle [rad] and its two derivatives."""
        constant, cosine, sine, slope = self.rest_torque
        rest = constant + cosine * math.cos(angle) + sine * math.sin(angle) + slope * angle
        dry = self.friction * math.tanh(rate / _SLOW)
        return self.inertia * acceleration + self.damping * rate + dry - rest

    @classmethod
    def for_rig(cls, rig: Rig, *, load: float = 0.0) -> Arm:
        """Read an arm from a rig with a load [kg].

        Elastic chains, backlash and friction along the tendons are neglected.

        Raises:
            InputError: if the rig is not one hinge and two muscles that pull it on equal arms, the
                first to positive angles, the second back.
        """
        model = rig.model_for(load=load)
        muscles = muscle_ids(model)
        if model.nv != 1 or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_HINGE or len(muscles) != 2:
            raise InputError(
                f"rig {rig.name!r} is not one hinge between two muscles; controllers of the"
                " pressure difference need one that is"
            )
        data, inertia = mujoco.MjData(model), np.empty((1, 1))
        torques, lengths = np.empty(_ANGLES.size), np.empty((_ANGLES.size, 2))
        for k, angle in enumerate(_ANGLES):
            data.qpos[0] = angle
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            torques[k] = data.qfrc_passive[0] - data.qfrc_bias[0]
            lengths[k] = data.ten_length[[model.actuator_trnid[i, 0] for i in muscles]]
        mujoco.mj_fullM(model, data, inertia)
        radius = float((lengths[-1, 1] - lengths[0, 1]) / (_ANGLES[-1] - _ANGLES[0]))
        sprocket = radius * np.outer(_ANGLES, (-1.0, 1.0))
        rest = np.linalg.lstsq(_SHAPES, torques, rcond=None)[0]
        for what, found, law in (
            ("its tendons are not -/+ r beta long, as over a sprocket", lengths, sprocket),
            ("what loads its hinge is not gravity and a linear spring", torques, _SHAPES @ rest),
        ):
            if not np.max(np.abs(found - law)) <= _EXACT * max(np.max(np.abs(found)), _EXACT):
                raise InputError(f"rig {rig.name!r}: {what}")
        first, second = (view(model.actuator_user[i]) for i in muscles)
        if not radius > 0.0 or law_pushes(first) or law_pushes(second):
            raise InputError(
                f"rig {rig.name!r}: its first muscle must pull the arm to positive angles, the"
                " second back; pamsim.controllers.joint_control drives any joint"
            )
        return cls(
            pair=(first, second),
            radius=radius,
            rest_torque=tuple(rest.tolist()),
            inertia=float(inertia[0, 0]),
            damping=float(model.dof_damping[0]),
            friction=float(model.dof_frictionloss[0]),
            supply=min(first.valve.supply_pressure, second.valve.supply_pressure),
        )


def balanced_pressures(arm: Arm, angle: float, torque: float, common: float) -> Command:
    """Pressures at which the pair gives a torque [N m] at an angle [rad], or comes nearest to it.

    Their mean is the common one, gauge [Pa], where neither is limited.

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
    """Pressures at which the pair gives a torque [N m] and the joint a stiffness [N m/rad].

    For a stiffness out of reach, see `shut_stiffness`, those that come nearest among the pairs of
    pressures that give the torque at this angle [rad].
    """

    def miss(common: float) -> float:
        pressures = balanced_pressures(arm, angle, torque, common)
        return shut_stiffness(arm, angle, pressures) - stiffness

    # Along pairs of one torque both pressures rise together, to where one meets a limit.
    low, high = (sum(balanced_pressures(arm, angle, torque, p)) / 2.0 for p in (0.0, arm.supply))
    return balanced_pressures(arm, angle, torque, _nearest_root(miss, low, high))


def shut_stiffness(arm: Arm, angle: float, pressures: Command) -> float:
    """Stiffness of the joint [N m/rad] at an angle [rad], shut in at gauge pressures (2,) [Pa]."""
    lengths = -arm.radius * angle, arm.radius * angle
    muscles = map(muscle_stiffness, arm.pair, lengths, pressures)
    return joint_stiffness(list(muscles), (arm.radius, arm.radius)).total


def _nearest_root(miss: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function vanishes, or the end of the interval that comes nearest."""
    if miss(low) >= 0.0:
        return low
    if miss(high) <= 0.0:
        return high
    return float(_root(miss, low, high, xtol=_NEAR))


class FeedForwardMemory(NamedTuple):
    """Memory of the hysteresis' inverse, empty without one, and of the PID."""

    plays: tuple[float, ...] = ()
    feedback: PidMemory = PidMemory()


@dataclass(frozen=True, kw_only=True)
class FeedForward:
    """Pressures from the wanted motion.

    Attributes:
        arm: what moves.
        common_pressure: mean pressure where no stiffness is asked for, gauge [Pa].
        lead: how far it looks ahead along the wanted motion [s].
        hysteresis: P^-1 from the wanted angle to that of the force law [rad], or None.
        feedback: adds to the difference, or None.
    """

    command = "pressure_set"
    arm: Arm
    common_pressure: float
    lead: float = 0.0
    hysteresis: PlaySum | None = None
    feedback: PidLaw | None = None

    @classmethod
    def for_rig(
        cls,
        rig: Rig,
        *,
        load: float = 0.0,
        common_pressure: float,
        lead: float | None = None,
        **parts: Any,
    ) -> FeedForward:
        """Feed-forward for a rig with a load [kg]; other arguments as the attributes.

        The lead is the delay of muscle 1's valves and the lag of its regulated pressure, if left
        out.

        Raises:
            InputError: as `Arm.for_rig`; if the common pressure cannot be had, or without a given
                lead as `regulated_lag`.
        """
        arm = Arm.for_rig(rig, load=load)
        common = PressureSplit(common=common_pressure, supply=arm.supply).common
        if lead is None:
            first = arm.pair[0]
            # Its tendon is 0 long at angle 0.
            lead = regulated_lag(first, 0.0, common) + float(first.valve.delay)
        return cls(arm=arm, common_pressure=common, lead=lead, **parts)

    def start(self, first: Observation) -> FeedForwardMemory:
        """Memory of an arm that moved to its angle from angle 0 without turning back."""
        if (undo := self.hysteresis) is None:
            return FeedForwardMemory()
        return FeedForwardMemory(undo.step(undo.virgin(), first.joint.position)[0])

    def step(
        self, observation: Observation, memory: FeedForwardMemory
    ) -> tuple[Command, FeedForwardMemory]:
        """Pressures from now on, and the memory for the next sample."""
        (first, second), plays = self.ahead(observation, memory.plays)
        if self.feedback is None:
            return (first, second), FeedForwardMemory(plays)
        split = PressureSplit(common=0.5 * (first + second), supply=self.arm.supply)
        extra, after = self.feedback.wanted(observation.joint, memory.feedback)
        wanted = first - second + extra
        feedback = self.feedback.limited(after, split.given(wanted) - wanted)
        return split.pressures(wanted), FeedForwardMemory(plays, feedback)

    def ahead(
        self, observation: Observation, plays: tuple[float, ...]
    ) -> tuple[Command, tuple[float, ...]]:
        """Pressures of the wanted motion alone, and the new memory of the hysteresis' inverse."""
        joint = observation.joint
        angle, rate = present_reference(joint, -self.lead)
        if self.hysteresis is not None:
            plays, angle = self.hysteresis.step(plays, angle)
        torque = self.arm.muscle_torque(angle, rate, joint.reference_acceleration)
        if joint.stiffness is None:
            return balanced_pressures(self.arm, angle, torque, self.common_pressure), plays
        return stiff_pressures(self.arm, angle, torque, joint.stiffness), plays
