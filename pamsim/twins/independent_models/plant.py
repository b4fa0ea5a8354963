"""What a hidden law reads of an arm between two time steps, and what it may change.

Laws read angle, speed, pressures and tensions as plain floats and add torques and forces; the plant
passes the sums to the engine. A torque acts on the output joint. A force is added to the constant
of the muscle's six-parameter law: it is then part of the recorded tension and cannot push.
Tendon lengths and tensions are those of the last step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.actuator.kernel import active_force, chamber_pressure, contraction, static_volume
from pamsim.actuator.layout import AIR, EXTENSION, SHIFT, slot
from pamsim.core.errors import InputError
from pamsim.core.experiment import Experiment
from pamsim.engine.rig import Rig
from pamsim.muscles.exponential import SixParameter
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.pneumatics.valves import clamped_opening, regulated_opening

_COMMAND = slot("command")
_SCALE, _CONSTANT = slot("force.0"), slot("force.6")
_COMPLIANCE, _BACKLASH = slot("chain.compliance"), slot("chain.backlash")
_TEMPERATURE = slot("chamber.temperature")
_ATMOSPHERE = slot("chamber.atmosphere")
_BAND, _DEAD_BAND = slot("valve.regulator_band"), slot("valve.regulator_dead_band")
_LINE_LAG = slot("valve.line_lag")


@dataclass(frozen=True, kw_only=True)
class RunContext:
    """One run of a synthetic recording.

    Attributes:
        rig: with the hidden parameters.
        experiment: of this run.
        seed: random seed of the recording; what is drawn from it alone is equal in all runs.
        number: of the run in the recording.
    """

    rig: Rig
    experiment: Experiment
    seed: int
    number: int


class Plant:
    """The arm of one run.

    Attributes:
        muscles: their numbers.
        rows: parameter row of each muscle, as the rig has it.
        user: (m, SIZE) the rows that the engine reads; what is written here acts.
        settling: True while the rig comes to rest before time 0.
        by_pressure: True where ``command`` holds set points, False where it holds openings.
        time: [s].
        timestep: [s].
        angle: of the output joint [rad].
        speed: of it [rad/s].
        command: of each muscle.
        torque: on the joint; laws add to it [N m].
        pull: force of each muscle in addition to its own; laws add to it [N].
    """

    def __init__(self, context: RunContext, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        rig = context.rig
        self.muscles = range(len(rig.muscles))
        self.rows: list[list[float]] = [model.actuator_user[i].tolist() for i in self.muscles]
        self.user = model.actuator_user
        self._model, self._data, self._context = model, data, context
        # Views of the engine's arrays: each look-up of one costs as much as reading it.
        self._position, self._velocity, self._ctrl = data.qpos, data.qvel, data.ctrl
        self._act, self._length, self._force = data.act, data.actuator_length, data.actuator_force
        self._applied = data.qfrc_applied
        self._angle_at, self._speed_at = rig.angle_address, rig.velocity_address
        ends = [int(model.actuator_actadr[i] + model.actuator_actnum[i]) for i in self.muscles]
        self._states = [
            slice(int(model.actuator_actadr[i]), end)
            for i, end in zip(self.muscles, ends, strict=True)
        ]
        self._air = [end - AIR for end in ends]
        self._extension = [end - EXTENSION for end in ends]
        self._shift = [end - SHIFT for end in ends]
        self._out = [int(model.actuator_outadr[i]) for i in self.muscles]
        self._pulls = False
        self._upright: NDArray[np.float64] | None = None
        mujoco.mj_forward(model, data)  # before the first step there are no lengths and forces yet
        self.read_state()

    def read_state(self) -> None:
        """Read the present state and set the sums to zero."""
        self.time: float = self._data.time
        self.settling = self.time < 0.0
        self.by_pressure = self.settling or self._context.experiment.command == "pressure"
        self.timestep: float = self._model.opt.timestep
        self.angle: float = self._position.item(self._angle_at)
        self.speed: float = self._velocity.item(self._speed_at)
        self.command: list[float] = self._ctrl.tolist()
        self.torque = 0.0
        self.pull = [0.0 for _ in self.muscles]
        # Computed when first needed: several laws may need them, many never do.
        self._openings: list[float | None] = [None for _ in self.muscles]
        self._volumes: list[float | None] = [None for _ in self.muscles]
        self._pressures: list[float | None] = [None for _ in self.muscles]

    def apply(self) -> None:
        """Pass the sums to the engine."""
        self._applied[self._speed_at] = self.torque
        if not self._pulls:
            if not any(self.pull):
                return
            self._refuse_other_laws()
            self._pulls = True
        for i in self.muscles:
            scale = self.user.item(i, _SCALE)
            self.user[i, _CONSTANT] = self.rows[i][_CONSTANT] + self.pull[i] / scale

    def tilt(self, angle: float, axis: float) -> None:
        """Tilt the ground by an angle [rad] about a horizontal axis, turned from x by another."""
        if self._upright is None:
            self._upright = self._model.opt.gravity.copy()
            turn = [math.cos(axis) * math.sin(angle / 2), math.sin(axis) * math.sin(angle / 2), 0.0]
            # Tilting the ground one way is tilting gravity the other.
            mujoco.mju_rotVecQuat(
                self._model.opt.gravity,
                self._upright,
                np.array([math.cos(angle / 2), *(-part for part in turn)]),
            )

    def set_command(self, muscle: int, command: float) -> None:
        """Replace a muscle's command by another of the same kind."""
        self.command[muscle] = command
        self._ctrl[muscle] = command

    def opening(self, muscle: int) -> float:
        """Signed opening of a muscle's valves: by command or regulator, changed by earlier laws."""
        known = self._openings[muscle]
        if known is not None:
            return known
        command = self.command[muscle]
        if not self.by_pressure:
            return clamped_opening(command)
        row = self.rows[muscle]
        return regulated_opening(command, self.pressure(muscle), row[_BAND], row[_DEAD_BAND])

    def set_opening(self, muscle: int, opening: float) -> None:
        """Set the opening of a muscle's valves, bypassing its regulator.

        Raises:
            InputError: if the rig has a line lag of its own.
        """
        if self.rows[muscle][_LINE_LAG] > 0.0:
            raise InputError(
                "valve.line_lag cannot be combined with a hidden law that sets valve openings"
            )
        self._openings[muscle] = opening
        self.user[muscle, _COMMAND] = 0.0
        self._ctrl[muscle] = opening

    def length(self, muscle: int) -> float:
        """Length of a muscle's tendon plus its chain's shift, minus its extension [m]."""
        length: float = self._length.item(self._out[muscle])
        if self.rows[muscle][_BACKLASH] > 0.0:
            length += self._act.item(self._shift[muscle])
        if self.rows[muscle][_COMPLIANCE] > 0.0:
            return length - self._act.item(self._extension[muscle])
        return length

    def contraction(self, muscle: int) -> float:
        """Contraction of a muscle [-]."""
        return contraction(self.rows[muscle], self.length(muscle))

    def tension(self, muscle: int) -> float:
        """Tension of a muscle [N]."""
        return -self._force.item(muscle)

    def volume(self, muscle: int) -> float:
        """Volume of a muscle's air [m^3]."""
        volume = self._volumes[muscle]
        if volume is None:
            volume = static_volume(self.rows[muscle], self.length(muscle), self.pressure(muscle))
            self._volumes[muscle] = volume
        return volume

    def air(self, muscle: int) -> float:
        """Air state y of a muscle."""
        return self._act.item(self._air[muscle])

    def set_air(self, muscle: int, air: float) -> None:
        """Set the air state of a muscle."""
        self._act[self._air[muscle]] = air
        self._pressures[muscle] = None
        self._volumes[muscle] = None

    def pressure_abs(self, muscle: int) -> float:
        """Absolute pressure in a muscle [Pa]."""
        pressure = self._pressures[muscle]
        if pressure is None:
            states = self._act[self._states[muscle]].tolist()
            tendon = self._length.item(self._out[muscle])
            pressure = chamber_pressure(self.rows[muscle], states, tendon)
            self._pressures[muscle] = pressure
        return pressure

    def pressure(self, muscle: int) -> float:
        """Gauge pressure in a muscle [Pa]."""
        return self.pressure_abs(muscle) - self.rows[muscle][_ATMOSPHERE]

    def add_air(self, muscle: int, mass_flow: float) -> None:
        """Let air into a muscle [kg/s] during the coming step, in addition to its valves' flow."""
        power = GAS_CONSTANT * self.rows[muscle][_TEMPERATURE] * mass_flow
        work = self.pressure_abs(muscle) * self.volume(muscle)
        self.set_air(muscle, self.air(muscle) * (1.0 + power / work * self.timestep))

    def active_force(self, muscle: int, pressure: float) -> float:
        """Active force of a muscle's law [N] at its contraction and a gauge pressure [Pa]."""
        return active_force(self.rows[muscle], max(pressure, 0.0), self.contraction(muscle))

    def _refuse_other_laws(self) -> None:
        for name, muscle in self._context.rig.muscles.items():
            if not isinstance(muscle.force, SixParameter):
                raise InputError(
                    f"{name}: an effect that adds to a muscle's force needs the six-parameter law;"
                    f" this rig has {type(muscle.force).__name__}"
                )
