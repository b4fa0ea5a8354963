"""Feed-forward by the inverse force law, alone or with a PID that corrects the remaining error.

The pressures at which the muscles' torque balances gravity, load, damping and inertia of the wanted
motion. A regulated pressure lags its set point; ``lead`` looks that much further along the wanted
motion, which for a lag of that time constant is its inverse to first order. The hysteresis of the
muscles is undone, if asked, on the wanted angle before it enters the law
(`pamsim.controllers.hysteresis`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from pamsim.controllers.arm import Arm, balanced_pressures, stiff_pressures
from pamsim.controllers.cascade import regulated_lag
from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.operating_point import PressureSplit
from pamsim.controllers.pid import PidLaw, PidMemory
from pamsim.engine.rig import Rig
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum


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
        hysteresis: P^-1 from the wanted angle to that at which the force law is evaluated [rad],
            which undoes the muscles' hysteresis; or None.
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

        The lead is the lag of muscle 1's regulated pressure, if left out.

        Raises:
            InputError: as `Arm.for_rig`, or if the common pressure cannot be had.
        """
        arm = Arm.for_rig(rig, load=load)
        common = PressureSplit(common=common_pressure, supply=arm.supply).common
        if lead is None:
            lead = regulated_lag(arm.pair[0], 0.0, common)
        return cls(arm=arm, common_pressure=common, lead=lead, **parts)

    def start(self, first: Observation) -> FeedForwardMemory:
        """Memory of an arm that moved to its angle from angle 0 without turning back."""
        if self.hysteresis is None:
            return FeedForwardMemory()
        return FeedForwardMemory(
            self.hysteresis.step(self.hysteresis.virgin(), first.joint.position)[0]
        )

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
        joint, lead = observation.joint, self.lead
        acceleration = joint.reference_acceleration
        rate = joint.reference_rate + lead * acceleration
        angle = joint.reference + lead * (joint.reference_rate + 0.5 * lead * acceleration)
        if self.hysteresis is not None:
            plays, angle = self.hysteresis.step(plays, angle)
        torque = self.arm.muscle_torque(angle, rate, acceleration)
        if joint.stiffness is None:
            return balanced_pressures(self.arm, angle, torque, self.common_pressure), plays
        return stiff_pressures(self.arm, angle, torque, joint.stiffness), plays
