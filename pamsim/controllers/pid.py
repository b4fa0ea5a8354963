"""PID of a joint, without derivative kick and without integrator windup.

u = K (e + 1/Ti integral of e + Td (c wanted rate - rate)), with the rates behind a lag. With c = 0
the derivative is that of the measured angle alone; with a feed-forward, which moves the
arm itself, c = 1 avoids braking that motion.
Where u is limited, the integral is reduced with the time constant Tt (back
calculation: Astrom and Hagglund, Advanced PID Control, 2006, section 3.5).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean
from typing import Any, NamedTuple, Self

import numpy as np

from pamsim.controllers.controller import (
    Command,
    JointObservation,
    Observation,
    PressureSplit,
    present_reference,
)
from pamsim.controllers.imc_tuning import PidGains, imc_gains_of_fit
from pamsim.core.errors import InputError, nearest
from pamsim.identification.local_models import LocalModelMap
from pamsim.identification.model import FitStatus

SCHEDULES = ("difference", "angle")
"""What gains may depend on: measured p1 - p2 [Pa], or measured angle [rad]."""


class PidMemory(NamedTuple):
    """Integral part of the command, and lagged rate of position less c wanted position [per s]."""

    integral: float = 0.0
    rate: float = 0.0


@dataclass(frozen=True, kw_only=True)
class PidLaw:
    """PID from a position to what moves it: a pressure difference, or a torque.

    Attributes:
        period: between two samples [s].
        gain: K [Pa/rad, or N m/rad].
        integral_time: Ti; infinite for none [s].
        derivative_time: Td [s].
        filter_time: time constant of the lag on the rate; 0 for none [s].
        rate_weight: c, from 0 to 1.
        tracking_time: Tt; infinite to let the integral wind up [s].

    Raises:
        InputError: for a time that the difference equations cannot take.
    """

    period: float
    gain: float
    integral_time: float = math.inf
    derivative_time: float = 0.0
    filter_time: float = 0.0
    rate_weight: float = 0.0
    tracking_time: float = math.inf

    def __post_init__(self) -> None:
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

    @classmethod
    def tuned(cls, gains: PidGains, *, period: float, **more: Any) -> Self:
        """PID of some gains, beside a feed-forward or for smooth references.

        The period [s] is also the filter's time; ``more`` are other attributes.
        """
        tracking = max(gains.derivative_time, 2.0 * period)
        times = {"period": period, "filter_time": period, "tracking_time": tracking}
        return cls(rate_weight=1.0, **times, **dataclasses.asdict(gains), **more)

    def wanted(self, joint: JointObservation, memory: PidMemory) -> tuple[float, PidMemory]:
        """What is commanded before the limits, and the memory if they take nothing."""
        goal, goal_rate = present_reference(joint, self.period)
        share = self.period / (self.filter_time + self.period)
        rate = joint.velocity - self.rate_weight * goal_rate
        rate = memory.rate + share * (rate - memory.rate)
        error = goal - joint.position
        wanted = self.gain * (error - self.derivative_time * rate) + memory.integral
        grown = self.period * self.gain * error / self.integral_time
        return wanted, PidMemory(memory.integral + grown, rate)

    def limited(self, memory: PidMemory, missed: float) -> PidMemory:
        """Memory after limits that gave ``missed`` more than was wanted."""
        reduced = memory.integral + self.period * missed / self.tracking_time
        return PidMemory(reduced, memory.rate)


@dataclass(frozen=True, kw_only=True)
class Pid(PidLaw):
    """PID from the angle of a rig's only joint to its two muscles' pressures, by a ``split``."""

    command = "pressure_set"
    split: PressureSplit

    def start(self, first: Observation) -> PidMemory:
        """Memory that keeps the pressures at rest."""
        return PidMemory(integral=first.pressure[0] - first.pressure[1])

    def step(self, observation: Observation, memory: PidMemory) -> tuple[Command, PidMemory]:
        """Pressures from now on, and the memory for the next sample."""
        wanted, after = self.wanted(observation.joint, memory)
        missed = self.split.given(wanted) - wanted
        return self.split.pressures(wanted), self.limited(after, missed)


@dataclass(frozen=True, kw_only=True)
class GainSchedule:
    """A PID over the operating point: gains on lines between points, constant beyond.

    Attributes:
        pid: whose gain, integral and derivative time are replaced at every sample.
        by: one of `SCHEDULES`.
        points: increasing values of it at which gains are known [Pa or rad].
        gains: at each of them.

    Raises:
        InputError: for an unknown, empty or not increasing schedule.
    """

    command = "pressure_set"
    pid: Pid
    by: str
    points: tuple[float, ...]
    gains: tuple[PidGains, ...]

    def __post_init__(self) -> None:
        if self.by not in SCHEDULES:
            raise InputError(f"no schedule by {self.by!r}; {nearest(self.by, SCHEDULES)}")
        rising = all(a < b for a, b in pairwise(self.points))
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
        at: Sequence[float],
    ) -> GainSchedule:
        """Tune local models from p1 - p2 to the angle by internal model control.

        The closed loop is to have one time constant [s] everywhere. Models at one place, such as of
        rising and falling steps, are averaged; those whose fit cannot be trusted are left out. A
        model's place [Pa or rad] is that of ``at``.

        Raises:
            InputError: for no trusted model, or one that is not of G1's or G2's structure.
        """
        if len(at) != len(models.models):
            raise InputError(
                f"`at` has {len(at)} values for {len(models.models)} local models; give one each"
            )
        tuned: dict[float, list[PidGains]] = {}
        for place, item in zip(at, models.models, strict=True):
            if item.fit.status is FitStatus.CONVERGED:
                gains = imc_gains_of_fit(item.fit, closed_loop_time=closed_loop_time)
                tuned.setdefault(place, []).append(gains)
        points = tuple(sorted(tuned))
        means = tuple(_combined(fmean, tuned[place]) for place in points)
        return cls(pid=pid, by=by, points=points, gains=means)

    def at(self, place: float) -> PidGains:
        """Gains at an operating point [Pa or rad]."""
        return _combined(lambda each: float(np.interp(place, self.points, each)), self.gains)

    def start(self, first: Observation) -> PidMemory:
        """Memory that keeps the pressures at rest."""
        return self.pid.start(first)

    def step(self, observation: Observation, memory: PidMemory) -> tuple[Command, PidMemory]:
        """Pressures from now on, and the memory for the next sample."""
        first, second = observation.pressure
        place = observation.joint.position if self.by == "angle" else first - second
        here = dataclasses.replace(self.pid, **dataclasses.asdict(self.at(place)))
        return here.step(observation, memory)


def _combined(rule: Callable[[list[float]], float], gains: Sequence[PidGains]) -> PidGains:
    """One set of gains of several, each by itself."""
    names = PidGains.__dataclass_fields__
    return PidGains(**{name: rule([getattr(one, name) for one in gains]) for name in names})
