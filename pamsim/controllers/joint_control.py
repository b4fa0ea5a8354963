"""Control of any number of joints: pressures that hold the wanted position, and a PID per joint.

The PID of a joint commands a torque. The pressures of all muscles are those nearest to the common
one at which the rig, at rest at its wanted position, gives these torques beside what holds it
there: its force laws and moment arms decide which muscles take part.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.pid import PidLaw, PidMemory
from pamsim.controllers.pressure_rate import regulated_lag
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import still_torques
from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids
from pamsim.linear.imc_tuning import imc_gains
from pamsim.linear.second_order_model import SecondOrderModel
from pamsim.physics.record import view

FloatArray = NDArray[np.float64]
# scipy carries no types: what it returns is Any at this file's boundary.
_nearest: Any = scipy.optimize.lsq_linear

_STEP = 100.0  # Pa, for derivatives
_TURN = 1e-5  # rad or m, for derivatives
_ROUNDS = 3  # the laws are linear in pressure, but for kinks
_LOOSE = 1e-3
"""Weight of staying near the common pressure against giving the torques, relative."""

_LEAST_STIFFNESS = 1e-3  # of what full pressure gives a joint per rad or m


class InverseStatics:
    """Pressures at which a rig at rest gives wanted torques.

    Args:
        rig: the rig, whose joints all turn about one axis or slide along one.
        load: mass on it [kg].
        common: pressure that the muscles keep near to, gauge [Pa].

    Raises:
        InputError: if a joint is free or a ball; if the supply does not reach the common pressure.
    """

    def __init__(self, rig: Rig, load: float, common: float) -> None:
        if rig.model.nq != rig.model.nv:
            raise InputError(f"rig {rig.name!r} has a free or ball joint: nothing holds it at rest")
        self.supply = rig.supply_pressure
        if not 0.0 <= common <= self.supply:
            raise InputError(
                f"common pressure {common / 1e3:g} kPa is not between 0 and the supply's"
                f" {self.supply / 1e3:g} kPa; choose one that is"
            )
        self.common = np.full(len(rig.muscles), common)
        self._still = still_torques(rig, load, mujoco.MjData(rig.model))
        self._start, self._places = rig.model.qpos0.copy(), rig.position_addresses

    def torques(self, position: Sequence[float], pressure: FloatArray) -> FloatArray:
        """(j,) torques on the recorded joints [N m or N] at rest at positions and pressures."""
        where = self._start.copy()
        where[self._places] = position
        return np.array(self._still(where, pressure.tolist()))[self._places]

    def per_pressure(self, position: Sequence[float], pressure: FloatArray) -> FloatArray:
        """(j, m) derivatives of the torques by the pressures [N m/Pa or N/Pa]."""
        return np.column_stack(
            [
                (self.torques(position, pressure + step) - self.torques(position, pressure - step))
                / (2.0 * _STEP)
                for step in _STEP * np.eye(len(pressure))
            ]
        )

    def stiffness(self, position: Sequence[float]) -> FloatArray:
        """(j,) fall of each joint's torque with its position at the common pressure."""
        each = _TURN * np.eye(len(position))
        at = np.array(position)
        return np.array(
            [
                (self.torques(at - turn, self.common) - self.torques(at + turn, self.common))[joint]
                / (2.0 * _TURN)
                for joint, turn in enumerate(each)
            ]
        )

    def pressures(self, position: Sequence[float], torque: FloatArray) -> FloatArray:
        """(m,) pressures [Pa] at which the rig at a position has torques (j,) left over."""
        pressure = self.common.copy()
        for _ in range(_ROUNDS):
            gain = self.per_pressure(position, pressure) * self.supply
            size = max(float(np.abs(gain).max()), 1e-12)
            missing = torque - self.torques(position, pressure) + gain @ (pressure / self.supply)
            tie = _LOOSE * np.eye(len(pressure))
            found = _nearest(
                np.vstack([gain / size, tie]),
                np.concatenate([missing / size, _LOOSE * self.common / self.supply]),
                bounds=(0.0, 1.0),
            )
            pressure = self.supply * found.x
        return pressure


@dataclass(frozen=True, kw_only=True, eq=False)
class JointControl:
    """Feed-forward by the statics of the rig, and a PID per joint.

    Attributes:
        statics: of the rig.
        laws: of the joints, in the rig's order.
        command: always ``pressure_set``.
    """

    statics: InverseStatics
    laws: tuple[PidLaw, ...]
    command: str = "pressure_set"

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
        """Design the PIDs by internal model control.

        Each joint is taken for its inertia, damping and stiffness at the initial position, behind
        the lag of the regulated pressures.

        Args:
            rig: the rig.
            closed_loop_time: time constant that each joint is to have [s].
            period: between two samples [s].
            load: mass on the rig [kg].
            common_pressure: half the supply pressure if left out [Pa].

        Raises:
            InputError: as `InverseStatics`; if the muscles leave a joint without stiffness.
        """
        common = 0.5 * rig.supply_pressure if common_pressure is None else common_pressure
        statics = InverseStatics(rig, load, common)
        model = rig.model_for(load=load)
        data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        at = model.qpos0[rig.position_addresses].tolist()
        lag = max(
            regulated_lag(view(model.actuator_user[i]), 0.0, max(common, 1.0))
            for i in muscle_ids(model)
        )
        most = np.abs(statics.per_pressure(at, statics.common)).sum(axis=1) * rig.supply_pressure
        laws: list[PidLaw] = []
        for joint, dof, stiff, able in zip(
            rig.joints, rig.velocity_addresses, statics.stiffness(at), most, strict=True
        ):
            if not stiff > _LEAST_STIFFNESS * able:
                raise InputError(
                    f"joint {joint!r} has no stiffness at {common / 1e3:g} kPa in all muscles:"
                    " choose another `common_pressure`"
                )
            damping = float(model.dof_damping[dof])
            gains = imc_gains(
                SecondOrderModel(
                    gain=1.0 / float(stiff),
                    a1=damping / float(stiff) + lag,
                    a2=(float(inertia[dof, dof]) + lag * damping) / float(stiff),
                ),
                closed_loop_time=closed_loop_time,
            )
            laws.append(
                PidLaw(
                    period=period,
                    filter_time=period,
                    tracking_time=max(gains.derivative_time, 2.0 * period),
                    rate_weight=1.0,
                    **dataclasses.asdict(gains),
                )
            )
        return cls(statics=statics, laws=tuple(laws))

    def start(self, first: Observation) -> tuple[PidMemory, ...]:
        """Memory of PIDs that have not acted.

        Raises:
            InputError: if the rig observed has another number of joints.
        """
        if len(first.joints) != len(self.laws):
            raise InputError(
                f"this control is for {len(self.laws)} joints, the rig has {len(first.joints)}"
            )
        return tuple(PidMemory(integral=0.0, rate=0.0) for _ in self.laws)

    def step(
        self, observation: Observation, memory: tuple[PidMemory, ...]
    ) -> tuple[Command, tuple[PidMemory, ...]]:
        """Pressures from now on, and the memory for the next sample."""
        wanted = [
            law.wanted(joint, own)
            for law, joint, own in zip(self.laws, observation.joints, memory, strict=True)
        ]
        goal = [joint.reference for joint in observation.joints]
        torque = np.array([torque for torque, _ in wanted])
        pressure = self.statics.pressures(goal, torque)
        missed = (self.statics.torques(goal, pressure) - torque).tolist()
        remembered = tuple(
            law.remembered(joint, own, rate, less)
            for law, joint, own, (_, rate), less in zip(
                self.laws, observation.joints, memory, wanted, missed, strict=True
            )
        )
        return tuple(pressure.tolist()), remembered
