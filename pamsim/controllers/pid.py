"""PID of a joint, without derivative kick and without integrator windup.

u = K (e + 1/Ti integral of e + Td (c wanted rate - rate)), with the rates behind a lag. With c = 0
the derivative is that of the measured angle alone; with a feed-forward, which moves the
arm itself, c = 1 avoids braking that motion.
Where u is limited, the integral is reduced with the time constant Tt (back
calculation: Astrom and Hagglund, Advanced PID Control, 2006, section 3.5).
"""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.controllers.controller import Command, JointObservation, Observation, present_reference
from pamsim.controllers.operating_point import PressureSplit
from pamsim.core.errors import InputError, nearest
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.imc_tuning import PidGains, imc_gains_of_fit
from pamsim.linear.local_models import LocalModelMap


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


SCHEDULES = ("difference", "angle")
"""What gains may depend on: measured p1 - p2 [Pa], or measured angle [rad]."""


@dataclass(frozen=True, kw_only=True)
class GainSchedule:
    """A PID over the operating point.

    Attributes:
        pid: whose gain, integral and derivative time are replaced at every sample.
        by: one of `SCHEDULES`.
        points: increasing values of it at which gains are known [Pa or rad].
        gains: at each of them.
        command: always ``pressure``.
    """

    pid: Pid
    by: str
    points: tuple[float, ...]
    gains: tuple[PidGains, ...]
    command: str = "pressure_set"

    def __post_init__(self) -> None:
        """Check the schedule.

        Raises:
            InputError: if it is unknown, empty or not increasing.
        """
        if self.by not in SCHEDULES:
            raise InputError(f"no schedule by {self.by!r}; {nearest(self.by, SCHEDULES)}")
        rising = all(a < b for a, b in zip(self.points, self.points[1:], strict=False))
        if not self.points or len(self.points) != len(self.gains) or not rising:
            raise InputError("a schedule needs increasing points with gains at each")

    @classmethod
    def from_models(
        cls,
        models: LocalModelMap,
        *,
        pid: Pid,
        closed_loop_time: float,
        by: str = "difference",
        at: Sequence[float] | None = None,
    ) -> GainSchedule:
        """Tune every local model by internal model control.

        Models at one point, such as of rising and falling steps, are averaged.

        Args:
            models: from p1 - p2 to the angle; those whose fit cannot be trusted are left out.
            pid: split, period, filter and tracking time.
            closed_loop_time: time constant that the closed loop is to have everywhere [s].
            by: one of `SCHEDULES`.
            at: where each model holds [Pa or rad]; its point's pressure if left out.

        Raises:
            InputError: for no trusted model, or one that is not of G1's or G2's structure.
        """
        places = [item.point.pressure for item in models.models] if at is None else list(at)
        if len(places) != len(models.models):
            raise InputError(f"{len(places)} places for {len(models.models)} local models")
        tuned_at: dict[float, list[PidGains]] = {}
        for place, item in zip(places, models.models, strict=True):
            if item.fit.status is FitStatus.CONVERGED:
                gains_here = imc_gains_of_fit(item.fit, closed_loop_time=closed_loop_time)
                tuned_at.setdefault(place, []).append(gains_here)
        points = tuple(sorted(tuned_at))
        gains = tuple(_mean(tuned_at[place]) for place in points)
        return cls(pid=pid, by=by, points=points, gains=gains)

    def at(self, place: float) -> PidGains:
        """Gains at an operating point [Pa or rad]."""
        right = bisect.bisect_right(self.points, place)
        if right == 0:
            return self.gains[0]
        if right == len(self.points):
            return self.gains[-1]
        low, high = self.points[right - 1], self.points[right]
        return _between(self.gains[right - 1], self.gains[right], (place - low) / (high - low))

    def start(self, first: Observation) -> PidMemory:
        """Memory that keeps the pressures at rest."""
        return self.pid.start(first)

    def step(self, observation: Observation, memory: PidMemory) -> tuple[Command, PidMemory]:
        """Pressures from now on, and the memory for the next sample."""
        place = (
            observation.joint.position
            if self.by == "angle"
            else observation.pressure[0] - observation.pressure[1]
        )
        here = self.at(place)
        return dataclasses.replace(self.pid, **dataclasses.asdict(here)).step(observation, memory)


def _between(low: PidGains, high: PidGains, share: float) -> PidGains:
    return PidGains(
        gain=low.gain + share * (high.gain - low.gain),
        integral_time=low.integral_time + share * (high.integral_time - low.integral_time),
        derivative_time=low.derivative_time + share * (high.derivative_time - low.derivative_time),
    )


def _mean(items: Sequence[PidGains]) -> PidGains:
    count = len(items)
    return PidGains(
        gain=sum(item.gain for item in items) / count,
        integral_time=sum(item.integral_time for item in items) / count,
        derivative_time=sum(item.derivative_time for item in items) / count,
    )
