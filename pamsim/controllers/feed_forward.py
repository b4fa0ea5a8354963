"""Feed-forward by the inverse force law, alone or with a PID that corrects the remaining error.

The pressures at which the muscles' torque balances gravity, load, damping and inertia of the wanted
motion. A regulated pressure lags its set point; ``lead`` looks that much further along the wanted
motion, which for a lag of that time constant is its inverse to first order. The hysteresis of the
muscles is undone, if asked, on the wanted angle before it enters the law
(`pamsim.controllers.hysteresis`).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.arm import Arm
from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.hysteresis import HysteresisInverse
from pamsim.controllers.inverse_law import balanced_pressures, stiff_pressures
from pamsim.controllers.operating_point import PressureSplit
from pamsim.controllers.pid import Pid, PidMemory
from pamsim.controllers.pressure_rate import regulated_lag
from pamsim.engine.rig import Rig


@dataclass(frozen=True, kw_only=True, slots=True)
class FeedForwardMemory:
    """What a feed-forward keeps.

    Attributes:
        plays: memory of the hysteresis' inverse; empty without one.
        feedback: memory of the PID; None without one.
    """

    plays: tuple[float, ...] = ()
    feedback: PidMemory | None = None


@dataclass(frozen=True, kw_only=True)
class FeedForward:
    """Pressures from the wanted motion.

    Attributes:
        arm: what moves.
        common_pressure: mean pressure where no stiffness is asked for, gauge [Pa].
        lead: how far it looks ahead along the wanted motion [s].
        hysteresis: undoes the muscles' hysteresis, or None.
        feedback: adds to the difference, or None. Of its ``split`` the supply counts.
        command: always ``pressure``.
    """

    arm: Arm
    common_pressure: float
    lead: float = 0.0
    hysteresis: HysteresisInverse | None = None
    feedback: Pid | None = None
    command: str = "pressure_set"

    @classmethod
    def for_rig(
        cls,
        rig: Rig,
        *,
        load: float = 0.0,
        common_pressure: float,
        lead: float | None = None,
        hysteresis: HysteresisInverse | None = None,
        feedback: Pid | None = None,
    ) -> FeedForward:
        """Feed-forward for a rig with a load.

        Args:
            rig: the rig.
            load: mass on the arm [kg].
            common_pressure: see the attributes, as for the others [Pa].
            lead: if left out, the lag of muscle 1's regulated pressure there [s].
            hysteresis: undoes the muscles' hysteresis, or None.
            feedback: adds to the difference, or None.

        Raises:
            InputError: as `Arm.for_rig`, or if the common pressure cannot be had.
        """
        arm = Arm.for_rig(rig, load=load)
        split = PressureSplit(common=common_pressure, supply=arm.supply)
        if lead is None:
            lead = regulated_lag(arm.pair[0], 0.0, split.common)
        return cls(
            arm=arm,
            common_pressure=common_pressure,
            lead=lead,
            hysteresis=hysteresis,
            feedback=feedback,
        )

    def start(self, first: Observation) -> FeedForwardMemory:
        """Memory of an arm that moved to its angle from angle 0 without turning back."""
        plays = () if self.hysteresis is None else self.hysteresis.start(first.joint.position)
        feedback = None
        if self.feedback is not None:
            feedback = PidMemory(integral=0.0, rate=0.0)
        return FeedForwardMemory(plays=plays, feedback=feedback)

    def step(
        self, observation: Observation, memory: FeedForwardMemory
    ) -> tuple[Command, FeedForwardMemory]:
        """Pressures from now on, and the memory for the next sample."""
        (first, second), plays = self.ahead(observation, memory.plays)
        if self.feedback is None or memory.feedback is None:
            return (first, second), FeedForwardMemory(plays=plays)
        split = PressureSplit(common=0.5 * (first + second), supply=self.arm.supply)
        extra, rate = self.feedback.wanted(observation.joint, memory.feedback)
        wanted = first - second + extra
        missed = split.given(wanted) - wanted
        feedback = self.feedback.remembered(observation.joint, memory.feedback, rate, missed)
        return split.pressures(wanted), FeedForwardMemory(plays=plays, feedback=feedback)

    def ahead(
        self, observation: Observation, plays: tuple[float, ...]
    ) -> tuple[Command, tuple[float, ...]]:
        """Pressures of the wanted motion alone, and the new memory of the hysteresis' inverse."""
        acceleration = observation.joint.reference_acceleration
        rate = observation.joint.reference_rate + self.lead * acceleration
        angle = observation.joint.reference + self.lead * (
            observation.joint.reference_rate + 0.5 * self.lead * acceleration
        )
        if self.hysteresis is not None:
            angle, plays = self.hysteresis.undone(angle, plays)
        torque = self.arm.muscle_torque(angle, rate, acceleration)
        if observation.joint.stiffness is None:
            pressures = balanced_pressures(self.arm, angle, torque, self.common_pressure)
        else:
            pressures = stiff_pressures(self.arm, angle, torque, observation.joint.stiffness)
        return pressures, plays
