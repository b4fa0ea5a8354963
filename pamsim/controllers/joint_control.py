"""Control of any number of joints: pressures that hold the wanted position, and a PID per joint.

The PID of a joint commands a torque. The pressures of all muscles are those nearest to the common
one at which the rig, at rest at its wanted position, gives these torques beside what holds it
there: its force laws and moment arms decide which muscles take part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike

from pamsim.controllers.cascade import regulated_lag
from pamsim.controllers.controller import Command, Observation, PressureSplit
from pamsim.controllers.imc_tuning import imc_gains
from pamsim.controllers.pid import PidLaw, PidMemory
from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import still_torques, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.record import view

# scipy carries no types: what it returns is Any at this file's boundary.
_nearest: Any = scipy.optimize.lsq_linear

_STEP = 100.0  # Pa, for derivatives
_TURN = 1e-5  # rad or m, for derivatives
_ROUNDS = 3  # the laws are linear in pressure, but for kinks
_LOOSE = 1e-3  # weight of staying near the common pressure against giving the torques
_LEAST_STIFFNESS = 1e-3  # of what full pressure gives a joint per rad or m


class InverseStatics:
    """Pressures near a common gauge one [Pa] at which a rig with a load [kg] at rest gives torques.

    Raises:
        InputError: if a joint is free or a ball; if the supply does not reach the common pressure.
    """

    def __init__(self, rig: Rig, load: float, common: float) -> None:
        if rig.model.nq != rig.model.nv:
            raise InputError(f"rig {rig.name!r} has a free or ball joint: nothing holds it at rest")
        split = PressureSplit(common=common, supply=rig.supply_pressure)
        self.supply = split.supply
        self.common = np.full(len(rig.muscles), common)
        self._still = still_torques(rig, load, mujoco.MjData(rig.model))
        self._start, self._places = rig.model.qpos0.copy(), rig.position_addresses

    def torques(self, position: ArrayLike, pressure: FloatArray) -> FloatArray:
        """(j,) torques on the recorded joints [N m or N] at rest at positions and pressures."""
        where = self._start.copy()
        where[self._places] = position
        return np.array(self._still(where, pressure.tolist()))[self._places]

    def per_pressure(self, position: ArrayLike, pressure: FloatArray) -> FloatArray:
        """(j, m) derivatives of the torques by the pressures [N m/Pa or N/Pa]."""
        return _jacobian(lambda pressure: self.torques(position, pressure), pressure, _STEP)

    def stiffness(self, position: ArrayLike) -> FloatArray:
        """(j,) fall of each joint's torque with its position at the common pressure."""
        turned = _jacobian(lambda at: self.torques(at, self.common), np.array(position), _TURN)
        return -np.diag(turned)

    def pressures(self, position: ArrayLike, torque: FloatArray) -> FloatArray:
        """(m,) pressures [Pa] at which the rig at a position has torques (j,) left over."""
        pressure = self.common.copy()
        tie = _LOOSE * np.eye(len(pressure))
        for _ in range(_ROUNDS):
            gain = self.per_pressure(position, pressure) * self.supply
            size = max(float(np.abs(gain).max()), 1e-12)
            missing = torque - self.torques(position, pressure) + gain @ (pressure / self.supply)
            found = _nearest(
                np.vstack([gain / size, tie]),
                np.concatenate([missing / size, tie @ self.common / self.supply]),
                bounds=(0.0, 1.0),
            )
            pressure = self.supply * found.x
        return pressure


def _jacobian(
    function: Callable[[FloatArray], FloatArray], at: FloatArray, step: float
) -> FloatArray:
    """(j, m) derivatives of a function with j values by its m arguments."""
    rises = [function(at + each) - function(at - each) for each in step * np.eye(len(at))]
    return np.column_stack(rises) / (2.0 * step)


@dataclass(frozen=True, kw_only=True, eq=False)
class JointControl:
    """Feed-forward by the statics of the rig, and a PID per joint.

    Attributes:
        statics: of the rig.
        laws: of the joints, in the rig's order.
    """

    command = "pressure_set"
    statics: InverseStatics
    laws: tuple[PidLaw, ...]

    @classmethod
    def for_rig(
        cls,
        rig: Rig,
        *,
        closed_loop_time: float,
        period: float = 0.02,
        load: float = 0.0,
        common_pressure: float | None = None,
    ) -> JointControl:
        """Design PIDs by internal model control for a rig with a load [kg].

        Each joint is taken for its inertia, damping and stiffness at the initial position, behind
        the lag of the regulated pressures and the delay of the valves. It is to have the closed
        loop's time constant [s] at a sampling period [s]; the common pressure [Pa] is half the
        supply's if left out.

        Raises:
            InputError: as `InverseStatics` and `regulated_lag`; if the muscles leave a joint
                without stiffness.
        """
        common = 0.5 * rig.supply_pressure if common_pressure is None else common_pressure
        statics = InverseStatics(rig, load, common)
        model = rig.model_for(load=load)
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        at = model.qpos0[rig.position_addresses].tolist()
        muscles = [view(model.actuator_user[i]) for i in muscle_ids(model)]
        lengths = tendon_lengths(rig, model.qpos0).tolist()
        lag = max(
            regulated_lag(m, length, max(common, 1.0))
            for m, length in zip(muscles, lengths, strict=True)
        )
        late = max(m.valve.delay for m in muscles)
        most = np.abs(statics.per_pressure(at, statics.common)).sum(axis=1) * rig.supply_pressure
        own, laws = rig.velocity_addresses, []
        columns = statics.stiffness(at), most, model.dof_damping[own], np.diag(inertia)[own]
        for joint, *numbers in zip(rig.joints, *columns, strict=True):
            stiff, able, damping, mass = map(float, numbers)
            if not stiff > _LEAST_STIFFNESS * able:
                raise InputError(
                    f"joint {joint!r} has no stiffness at {common / 1e3:g} kPa in all muscles:"
                    " choose another `common_pressure`"
                )
            a1, a2 = damping / stiff + lag, (mass + lag * damping) / stiff
            g2 = SecondOrderModel(gain=1.0 / stiff, a1=a1, a2=a2)
            gains = imc_gains(g2, closed_loop_time=closed_loop_time, dead_time=late)
            laws.append(PidLaw.tuned(gains, period=period))
        return cls(statics=statics, laws=tuple(laws))

    def start(self, first: Observation) -> tuple[PidMemory, ...]:
        """Memory of PIDs that have not acted.

        Raises:
            InputError: if the rig observed has another number of joints.
        """
        if len(first.joints) != len(self.laws):
            raise InputError(
                f"this control is for {len(self.laws)} joints, the rig has {len(first.joints)};"
                " make one with JointControl.for_rig(rig)"
            )
        return (PidMemory(),) * len(self.laws)

    def step(
        self, observation: Observation, memory: tuple[PidMemory, ...]
    ) -> tuple[Command, tuple[PidMemory, ...]]:
        """Pressures from now on, and the memory for the next sample."""
        torques, after = zip(
            *map(PidLaw.wanted, self.laws, observation.joints, memory), strict=True
        )
        goal = [joint.reference for joint in observation.joints]
        pressure = self.statics.pressures(goal, np.array(torques))
        missed = (self.statics.torques(goal, pressure) - torques).tolist()
        return tuple(pressure.tolist()), tuple(map(PidLaw.limited, self.laws, after, missed))
