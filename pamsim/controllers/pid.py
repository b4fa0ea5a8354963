"""PID of a joint, without derivative kick and without integrator windup.

u = K (e + 1/Ti integral of e + Td (c wanted rate - rate)), with the rates behind a lag. With c = 0
the derivative is that of the measured angle alone; with a feed-forward, which moves the
arm itself, c = 1 avoids braking that motion.
Where u is limited, the integral is reduced with the time constant Tt (back
calculation: Astrom and Hagglund, Advanced PID Control, 2006, section 3.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pamsim.controllers.controller import Command, JointObservation, Observation
from pamsim.controllers.present_reference import present_reference
from pamsim.controllers.pressure_split import PressureSplit
from pamsim.core.errors import InputError


@dataclass(frozen=True, kw_only=True, slots=True)
class PidMemory:
    """What a PID keeps.

    Attributes:
        integral: its integral part, of what it commands.
        rate: lagged rate of the position, less c of the wanted one [per s].
    """

    integral: float
    rate: float


@dataclass(frozen=True, kw_only=True)
class PidLaw:
    """PID from the position of a joint to what moves it: a pressure difference, or a torque.

    Attributes:
        period: between two samples [s].
        gain: K [Pa/rad, or N m/rad].
        integral_time: Ti; infinite for none [s].
        derivative_time: Td [s].
        filter_time: time constant of the lag on the rate; 0 for none [s].
        rate_weight: c, from 0 to 1.
        tracking_time: Tt; infinite to let the integral wind up [s].
    """

    period: float
    gain: float
    integral_time: float = math.inf
    derivative_time: float = 0.0
    filter_time: float = 0.0
    rate_weight: float = 0.0
    tracking_time: float = math.inf

    def __post_init__(self) -> None:
        """Check the times.

        Raises:
            InputError: for a time that the difference equations cannot take.
        """
        for name in ("period", "integral_time", "tracking_time"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"PID: {name} = {getattr(self, name)!r} s must be above 0")
        for name in ("derivative_time", "filter_time"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"PID: {name} = {getattr(self, name)!r} s must not be below 0")
        if self.tracking_time < self.period:
            raise InputError(
                f"PID: tracking_time = {self.tracking_time:g} s is shorter than the sampling"
                f" period {self.period:g} s, so that the integral would oscillate; lengthen it"
            )

    def wanted(self, joint: JointObservation, memory: PidMemory) -> tuple[float, float]:
        """What is commanded before the limits, and the lagged rate used for it [per s]."""
        goal, goal_rate = present_reference(joint, self.period)
        share = self.period / (self.filter_time + self.period)
        rate = joint.velocity - self.rate_weight * goal_rate
        rate = memory.rate + share * (rate - memory.rate)
        error = goal - joint.position
        return self.gain * (error - self.derivative_time * rate) + memory.integral, rate

    def remembered(
        self, joint: JointObservation, memory: PidMemory, rate: float, missed: float
    ) -> PidMemory:
        """Memory for the next sample.

        Args:
            joint: at this sample.
            memory: before it.
            rate: lagged, of this sample [per s].
            missed: what was given less what was wanted.
        """
        error = present_reference(joint, self.period)[0] - joint.position
        grown = self.gain * error / self.integral_time + missed / self.tracking_time
        return PidMemory(integral=memory.integral + self.period * grown, rate=rate)


@dataclass(frozen=True, kw_only=True)
class Pid(PidLaw):
    """PID from the angle of a rig's only joint to the pressures of its two muscles.

    Attributes:
        split: makes pressures of the difference.
        command: always ``pressure_set``.
    """

    split: PressureSplit
    command: str = "pressure_set"

    def start(self, first: Observation) -> PidMemory:
        """Memory that keeps the pressures at rest."""
        return PidMemory(integral=first.pressure[0] - first.pressure[1], rate=0.0)

    def step(self, observation: Observation, memory: PidMemory) -> tuple[Command, PidMemory]:
        """Pressures from now on, and the memory for the next sample."""
        joint = observation.joint
        wanted, rate = self.wanted(joint, memory)
        missed = self.split.given(wanted) - wanted
        return self.split.pressures(wanted), self.remembered(joint, memory, rate, missed)
