"""Every controller of the library, designed for one rig, each with one number left to choose.

Designs rest on simulated experiments with the rig: steps about several operating points, and a
slow triangle that shows its hysteresis. Designs assume the load that is given here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from pamsim.controllers.cascade import Cascade, PressureLoop
from pamsim.controllers.controller import Controller
from pamsim.controllers.feed_forward import FeedForward
from pamsim.controllers.hysteresis import HysteresisInverse, decaying_triangle, loop_operator
from pamsim.controllers.model_based import LeadLag, Lqg, SlidingMode
from pamsim.controllers.operating_point import LinearisedArm, PressureSplit, linearise_arm
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import simulate
from pamsim.linear.imc_tuning import imc_gains
from pamsim.linear.lead_lag_design import design_lead_lag
from pamsim.linear.local_models import LocalModel, OperatingPoint, local_model_map
from pamsim.linear.regulator_design import design_regulator

_SCHEDULED = (-0.6, -0.3, 0.0, 0.3, 0.6)
"""Pressure differences of the local models, as shares of twice the common pressure."""

_ROOM = 0.8
"""Share of the possible difference that the triangle uses."""

_MARGIN = math.radians(50.0)
_WORST = math.radians(2.0)
_ENCODER = math.radians(0.1)
_PRESSURE = 1e4
"""Phase margin; error as bad as `_PUSH`; noise of the angle and of the pressures [rad, Pa]."""

_PUSH = 3e4
"""Pressure difference that is as bad as `_WORST` [Pa]."""


@dataclass(frozen=True, kw_only=True)
class Suite:
    """A rig to design controllers for; models are identified once, when first needed.

    Attributes:
        rig: as the designer knows it.
        period: between two samples [s].
        common_pressure: mean of both muscles' [Pa].
        load: mass on the arm [kg].
    """

    rig: Rig
    period: float = 0.02
    common_pressure: float = 300e3
    load: float = 0.0

    def __post_init__(self) -> None:
        """Check the rig.

        Raises:
            InputError: if it has not one joint between two muscles.
        """
        if len(self.rig.joints) != 1 or len(self.rig.muscles) != 2:
            raise InputError(
                f"these controllers drive one joint between two muscles, rig {self.rig.name!r} has"
                f" {len(self.rig.joints)} and {len(self.rig.muscles)};"
                " pamsim.controllers.joint_control drives any number"
            )

    @cached_property
    def split(self) -> PressureSplit:
        """Common pressure and supply."""
        return PressureSplit(common=self.common_pressure, supply=self.rig.supply_pressure)

    @cached_property
    def linearised(self) -> LinearisedArm:
        """G2 about equal pressures."""
        return linearise_arm(self.rig, self.split, load=self.load)

    @cached_property
    def inverse(self) -> HysteresisInverse:
        """Of the loops that a slow triangle draws."""
        amplitude = _ROOM * 2.0 * min(self.split.common, self.split.supply - self.split.common)
        run = simulate(self.rig, decaying_triangle(self.split, amplitude=amplitude, load=self.load))
        return HysteresisInverse.of(loop_operator(self.rig, run.completed()).operator)

    def pid(self, closed_loop_time: float) -> Pid:
        """PID by internal model control; its derivative is that of the error."""
        gains = imc_gains(self.linearised.model, closed_loop_time=closed_loop_time)
        return Pid(
            split=self.split,
            period=self.period,
            filter_time=self.period,
            tracking_time=max(gains.derivative_time, 2.0 * self.period),
            rate_weight=1.0,
            **dataclasses.asdict(gains),
        )

    def scheduled(self, closed_loop_time: float) -> GainSchedule:
        """PID over the operating point, from local models of G2's structure."""
        arms = self._local
        models = local_model_map(
            [
                LocalModel(OperatingPoint(pressure=arm.point.difference, load=self.load), arm.fit)
                for arm in arms
            ]
        )
        return GainSchedule.from_models(
            models, pid=self.pid(closed_loop_time), closed_loop_time=closed_loop_time
        )

    @cached_property
    def _local(self) -> tuple[LinearisedArm, ...]:
        span = 2.0 * self.split.common
        return tuple(
            linearise_arm(self.rig, self.split, difference=share * span, load=self.load)
            for share in _SCHEDULED
        )

    def lead_lag(self, crossover: float) -> LeadLag:
        """Lead-lag of a crossover [rad/s]: 50 deg of phase margin with a period of delay."""
        model = self.linearised.model
        design = design_lead_lag(
            model, period=self.period, crossover=crossover, phase_margin=_MARGIN, delay=1
        )
        return LeadLag(design=design, model=model, point=self.linearised.point)

    def lqg(self, integral_time: float) -> Lqg:
        """LQG with integral action over a time [s]."""
        design = design_regulator(
            self.linearised.model,
            period=self.period,
            largest_error=_WORST,
            largest_input=_PUSH,
            integral_time=integral_time,
            input_noise=_PRESSURE,
            output_noise=_ENCODER,
        )
        return Lqg(design=design, point=self.linearised.point, tracking_time=integral_time)

    def sliding_mode(self, bandwidth: float) -> SlidingMode:
        """Sliding mode of a bandwidth [rad/s]; its layer is crossed in about five samples."""
        return SlidingMode(
            model=self.linearised.model,
            point=self.linearised.point,
            period=self.period,
            bandwidth=bandwidth,
            reach=bandwidth,
            layer=5.0 * self.period * bandwidth,
        )

    def feed_forward(
        self, closed_loop_time: float | None = None, *, compensated: bool = False
    ) -> FeedForward:
        """Inverse force law, with a PID beside it if a time [s] is given."""
        return FeedForward.for_rig(
            self.rig,
            load=self.load,
            common_pressure=self.common_pressure,
            hysteresis=self.inverse if compensated else None,
            feedback=None if closed_loop_time is None else self.pid(closed_loop_time),
        )

    def cascade(self, closed_loop_time: float) -> Cascade:
        """Compensated feed-forward with PID over pressure loops: for valves."""
        return Cascade(
            outer=self.feed_forward(closed_loop_time, compensated=True),
            inner=PressureLoop.for_rig(
                self.rig,
                period=self.period,
                common_pressure=self.common_pressure,
                closed_loop_time=2.0 * self.period,
            ),
        )


@dataclass(frozen=True, kw_only=True)
class Family:
    """A kind of controller and the values of the number that is left to choose.

    Attributes:
        tried: values of it; a single unused 0 if there is nothing to choose.
        make: controller of a suite for a value.
    """

    tried: tuple[float, ...]
    make: Callable[[Suite, float], Controller]


_TIMES = (0.05, 0.1, 0.2, 0.4)

FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        "PID": Family(tried=_TIMES, make=Suite.pid),
        "scheduled PID": Family(tried=_TIMES, make=Suite.scheduled),
        "lead-lag": Family(tried=(6.0, 10.0, 14.0), make=Suite.lead_lag),
        "LQG": Family(tried=(0.1, 0.3, 1.0), make=Suite.lqg),
        "sliding mode": Family(tried=(4.0, 6.0, 9.0, 13.0), make=Suite.sliding_mode),
        "feed-forward": Family(tried=(0.0,), make=lambda suite, _: suite.feed_forward()),
        "feed-forward, compensated": Family(
            tried=(0.0,), make=lambda suite, _: suite.feed_forward(compensated=True)
        ),
        "feed-forward + PID": Family(tried=_TIMES, make=Suite.feed_forward),
        "feed-forward, compensated + PID": Family(
            tried=_TIMES, make=lambda suite, time: suite.feed_forward(time, compensated=True)
        ),
        "valves: cascade": Family(tried=_TIMES, make=Suite.cascade),
    }
)
"""Name -> family. All but the last command pressures; compensated: with the hysteresis undone."""
