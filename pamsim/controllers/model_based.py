"""Controllers that a linear model about an operating point is the base of.

A lead-lag filter, an LQG regulator, an integral sliding mode, and any linear controller designed
with python-control. Feedback acts on the deviation from the wanted motion, for which the model's
own input goes ahead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from pamsim.controllers.controller import Command, Observation, present_reference
from pamsim.controllers.operating_point import LinearisationPoint
from pamsim.linear.lead_lag_design import LeadLagDesign
from pamsim.linear.regulator_design import RegulatorDesign
from pamsim.linear.sampled_controller import SampledController
from pamsim.linear.second_order_model import SecondOrderModel


@dataclass(frozen=True, kw_only=True)
class LinearisedController:
    """A controller from the angle to pressures about an operating point.

    Attributes:
        point: where its model holds; its limits bound the output.
    """

    command = "pressure_set"
    point: LinearisationPoint


class LqgMemory(NamedTuple):
    """State as predicted at the last sample [rad, rad/s], and integral of the error [rad s]."""

    expected: tuple[float, ...]
    integral: float


@dataclass(frozen=True, kw_only=True)
class Lqg(LinearisedController):
    """Sampled LQG regulator with integral action.

    Attributes:
        design: gains, see `pamsim.linear.regulator_design.design_regulator`.
        tracking_time: in which the integral follows what the limits take; infinite: not [s].
    """

    design: RegulatorDesign
    tracking_time: float = math.inf

    def start(self, first: Observation) -> LqgMemory:
        """Memory that keeps the pressures at rest."""
        away = first.joint.position - self.point.angle
        departure = self.point.measured_departure(first) - away / self.design.model.gain
        return LqgMemory((away, 0.0), departure / self.design.integral_gain)

    def step(self, observation: Observation, memory: LqgMemory) -> tuple[Command, LqgMemory]:
        """Pressures from now on, and the memory for the next sample."""
        joint, design, point = observation.joint, self.design, self.point
        innovation = joint.position - point.angle - memory.expected[0]
        state = tuple(
            x + gain * innovation
            for x, gain in zip(memory.expected, design.correction, strict=True)
        )
        now, rate = present_reference(joint, design.period)
        missed = now - point.angle - state[0], rate - state[1]
        wanted = point.input_for(design.model, joint) + _dot(design.feedback, missed)
        wanted += design.integral_gain * memory.integral
        given = point.given(wanted)
        grown = now - joint.position
        grown += (given - wanted) / (design.integral_gain * self.tracking_time)
        expected = tuple(
            _dot(row, state) + into * given
            for row, into in zip(design.transition, design.input, strict=True)
        )
        integral = memory.integral + design.period * grown
        return point.pressures(wanted), LqgMemory(expected, integral)


@dataclass(frozen=True, kw_only=True)
class SlidingMode(LinearisedController):
    """Integral sliding surface s = e' + 2 l e + l^2 integral of e; the memory is the integral.

    Attributes:
        model: G2.
        period: between two samples [s].
        bandwidth: l of the surface [rad/s].
        reach: rate at which s is driven to the layer [rad/s^2].
        layer: half width of the boundary layer [rad/s].
    """

    model: SecondOrderModel
    period: float
    bandwidth: float
    reach: float
    layer: float

    def start(self, first: Observation) -> float:
        """Integral of the error so far, none [rad s]."""
        del first
        return 0.0

    def surface(self, observation: Observation, memory: float) -> float:
        """Distance s from the surface [rad/s]."""
        error, drift = self._missed(observation)
        return drift + self.bandwidth * (2.0 * error + self.bandwidth * memory)

    def step(self, observation: Observation, memory: float) -> tuple[Command, float]:
        """Pressures from now on, and the memory for the next sample."""
        joint, point = observation.joint, self.point
        error, drift = self._missed(observation)
        pull = min(max(self.surface(observation, memory) / self.layer, -1.0), 1.0)
        acceleration = joint.reference_acceleration - self.reach * pull
        acceleration -= self.bandwidth * (2.0 * drift + self.bandwidth * error)
        wanted = self.model.input_for(joint.position - point.angle, joint.velocity, acceleration)
        # No sliding while the pressures are limited: the integral is held.
        waits = point.split.beyond(point.difference + wanted)
        return point.pressures(wanted), memory if waits else memory + self.period * error

    def _missed(self, observation: Observation) -> tuple[float, float]:
        goal, rate = present_reference(observation.joint, self.period)
        return observation.joint.position - goal, observation.joint.velocity - rate


@dataclass(frozen=True, kw_only=True)
class Lti(LinearisedController):
    """Sampled linear controller; the memory is its state.

    Its inputs are the error, or the departures of reference and angle from the point [rad]; its
    output is the departure of the pressure difference [Pa].

    Attributes:
        design: see `pamsim.linear.sampled_controller.sampled_controller`.
        model: G2, whose own input goes ahead; or None.
    """

    design: SampledController
    model: SecondOrderModel | None = None

    def start(self, first: Observation) -> tuple[float, ...]:
        """State that keeps the pressures at rest, if the controller integrates; else zeros."""
        departure = self.point.measured_departure(first)
        if self.model is not None:
            departure -= self.model.input_for(first.joint.position - self.point.angle, 0.0, 0.0)
        return tuple(departure * x for x in self.design.rest)

    def step(
        self, observation: Observation, memory: tuple[float, ...]
    ) -> tuple[Command, tuple[float, ...]]:
        """Pressures from now on, and the state at the next sample."""
        joint, design, point = observation.joint, self.design, self.point
        angle = joint.position - point.angle
        goal = present_reference(joint, design.period)[0] - point.angle
        seen = (goal - angle,) if len(design.direct) == 1 else (goal, angle)
        wanted = _dot(design.output, memory) + _dot(design.direct, seen)
        if self.model is not None:
            # Limited first: feedback must not compensate a reference that is out of reach.
            wanted += point.given(point.input_for(self.model, joint))
        missed = point.given(wanted) - wanted
        state = tuple(
            _dot(a, memory) + _dot(b, seen) + k * missed
            for a, b, k in zip(design.transition, design.input, design.correction, strict=True)
        )
        return point.pressures(wanted), state


def lead_lag(design: LeadLagDesign, model: SecondOrderModel, point: LinearisationPoint) -> Lti:
    """Lead-lag filter of the error beside the input of G2, about the point where it holds.

    At limits its state becomes what it had been under the error that gives the limited output. It
    starts as if it had always given what the pressures at rest need.
    """
    (first, *numerator), (_, *denominator) = design.numerator, design.denominator
    order = range(len(denominator))
    into = tuple(b - a * first for b, a in zip(numerator, denominator, strict=True))
    filtered = SampledController(
        period=design.period,
        transition=tuple((-denominator[k], *(float(j == k + 1) for j in order[1:])) for k in order),
        input=tuple((b,) for b in into),
        output=tuple(float(k == 0) for k in order),
        direct=(first,),
        rest=tuple(-sum(denominator[k:]) for k in order),
        correction=tuple(b / first for b in into),
    )
    return Lti(design=filtered, model=model, point=point)


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
