"""Every controller of the library, designed for one rig, each with one number left to choose.

Designs rest on simulated experiments with the rig: steps about several operating points, and a
slow triangle that shows its hysteresis. Designs assume the load that is given here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

from pamsim.controllers.cascade import Cascade, PressureLoop
from pamsim.controllers.controller import Controller, PressureSplit
from pamsim.controllers.feed_forward import FeedForward
from pamsim.controllers.hysteresis import decaying_triangle, loop_operator
from pamsim.controllers.imc_tuning import imc_gains
from pamsim.controllers.lead_lag_design import design_lead_lag
from pamsim.controllers.model_based import (
    LinearisedArm,
    Lqg,
    Lti,
    SlidingMode,
    lead_lag,
    linearise_arm,
)
from pamsim.controllers.pid import GainSchedule, Pid
from pamsim.controllers.regulator_design import design_regulator
from pamsim.core.errors import InputError
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import simulate
from pamsim.identification.local_models import (
    LocalModel,
    LocalModelMap,
    OperatingPoint,
    local_model_map,
)
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum

_SCHEDULED = (-0.6, -0.3, 0.0, 0.3, 0.6)
"""Pressure differences of the local models, as shares of twice the common pressure."""
_ROOM = 0.8  # share of the possible difference that the triangle uses
_PHASE_MARGIN = math.radians(50.0)
_WORST_ERROR, _WORST_INPUT = math.radians(2.0), 3e4
"""As bad as each other for the LQG regulator [rad, Pa]."""
_ENCODER_NOISE, _PRESSURE_NOISE = math.radians(0.1), 1e4  # rad, Pa


@dataclass(frozen=True, kw_only=True)
class Suite:
    """A rig to design controllers for; models are identified once, when first needed.

    Attributes:
        rig: as the designer knows it.
        period: between two samples [s].
        common_pressure: mean of both muscles' [Pa].
        load: mass on the arm [kg].

    Raises:
        InputError: if the rig has not one joint between two muscles.
    """

    rig: Rig
    period: float = 0.02
    common_pressure: float = 300e3
    load: float = 0.0

    def __post_init__(self) -> None:
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

    @property
    def differences(self) -> tuple[float, ...]:
        """Pressure differences of the local models [Pa]."""
        return tuple(2.0 * share * self.split.common for share in _SCHEDULED)

    @cached_property
    def local_models(self) -> LocalModelMap:
        """G2 about several pressure differences."""
        point = OperatingPoint(self.split.common, self.load)
        arms = (
            linearise_arm(self.rig, self.split, difference=difference, load=self.load)
            for difference in self.differences
        )
        return local_model_map([LocalModel(point, arm.fit) for arm in arms])

    @cached_property
    def inverse(self) -> PlaySum:
        """Inverse of the hysteresis in the loops that a slow triangle draws."""
        amplitude = _ROOM * 2.0 * min(self.split.common, self.split.supply - self.split.common)
        run = simulate(self.rig, decaying_triangle(self.split, amplitude=amplitude, load=self.load))
        return loop_operator(self.rig, run.completed()).operator.inverse()

    def pid(self, closed_loop_time: float) -> Pid:
        """PID by internal model control; its derivative is that of the error."""
        gains = imc_gains(self.linearised.model, closed_loop_time=closed_loop_time)
        return Pid.tuned(gains, period=self.period, split=self.split)

    def scheduled(self, closed_loop_time: float) -> GainSchedule:
        """PID over the operating point, from local models of G2's structure."""
        return GainSchedule.from_models(
            self.local_models,
            pid=self.pid(closed_loop_time),
            closed_loop_time=closed_loop_time,
            at=self.differences,
        )

    def lead_lag(self, crossover: float) -> Lti:
        """Lead-lag of a crossover [rad/s]: 50 deg of phase margin with a period of delay."""
        point, model, _ = self.linearised
        design = design_lead_lag(
            model, period=self.period, crossover=crossover, phase_margin=_PHASE_MARGIN, delay=1
        )
        return lead_lag(design, model, point)

    def lqg(self, integral_time: float) -> Lqg:
        """LQG with integral action over a time [s]."""
        point, model, _ = self.linearised
        design = design_regulator(
            model,
            period=self.period,
            largest_error=_WORST_ERROR,
            largest_input=_WORST_INPUT,
            integral_time=integral_time,
            input_noise=_PRESSURE_NOISE,
            output_noise=_ENCODER_NOISE,
        )
        return Lqg(design=design, point=point, tracking_time=integral_time)

    def sliding_mode(self, bandwidth: float) -> SlidingMode:
        """Sliding mode of a bandwidth [rad/s]; its layer is crossed in about five samples."""
        point, model, _ = self.linearised
        return SlidingMode(
            model=model,
            point=point,
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
        inner = PressureLoop.for_rig(
            self.rig,
            period=self.period,
            common_pressure=self.common_pressure,
            closed_loop_time=2.0 * self.period,
        )
        return Cascade(outer=self.feed_forward(closed_loop_time, compensated=True), inner=inner)


class Family(NamedTuple):
    """A kind of controller of a suite for a number left to choose; values of it, an unused 0."""

    make: Callable[[Suite, float], Controller]
    tried: tuple[float, ...] = (0.05, 0.1, 0.2, 0.4)


FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        "PID": Family(Suite.pid),
        "scheduled PID": Family(Suite.scheduled),
        "lead-lag": Family(Suite.lead_lag, (6.0, 10.0, 14.0)),
        "LQG": Family(Suite.lqg, (0.1, 0.3, 1.0)),
        "sliding mode": Family(Suite.sliding_mode, (4.0, 6.0, 9.0, 13.0)),
        "feed-forward": Family(lambda suite, _: suite.feed_forward(), (0.0,)),
        "feed-forward, compensated": Family(
            lambda suite, _: suite.feed_forward(compensated=True), (0.0,)
        ),
        "feed-forward + PID": Family(Suite.feed_forward),
        "feed-forward, compensated + PID": Family(
            lambda suite, time: suite.feed_forward(time, compensated=True)
        ),
        "valves: cascade": Family(Suite.cascade),
    }
)
"""Name -> family. All but the last command pressures; compensated: with the hysteresis undone."""
