"""PID whose gains change with the operating point, from local models of the arm.

Gains are straight lines between the models' points and hold beyond the outermost. The integral part
is kept as a pressure, so that it does not jump when the gains change.
"""

from __future__ import annotations

import bisect
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.pid import Pid, PidMemory
from pamsim.core.errors import InputError, nearest
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.imc_tuning import PidGains, imc_gains_of_fit
from pamsim.linear.local_models import LocalModelMap

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
