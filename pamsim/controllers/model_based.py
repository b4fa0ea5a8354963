"""Controllers that a linear model about an operating point is the base of.

A lead-lag filter, an LQG regulator, an integral sliding mode, and any linear controller designed
with python-control. Feedback acts on the deviation from the wanted motion, for which the model's
own input goes ahead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation, present_reference
from pamsim.controllers.operating_point import LinearisationPoint
from pamsim.linear.lead_lag_design import LeadLagDesign
from pamsim.linear.regulator_design import RegulatorDesign
from pamsim.linear.sampled_controller import SampledController
from pamsim.linear.second_order_model import SecondOrderModel


@dataclass(frozen=True, kw_only=True, slots=True)
class LeadLagMemory:
    """What a lead-lag filter keeps, latest first.

    Attributes:
        errors: (2,) that led to the outputs [rad].
        outputs: (2,) [Pa].
    """

    errors: tuple[float, ...]
    outputs: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class LeadLag:
    """From angle to pressures by a sampled lead-lag design.

    Attributes:
        design: see `pamsim.linear.lead_lag_design.design_lead_lag`.
        model: G2, whose inverse goes ahead.
        point: where it holds.
        command: always ``pressure``.
    """

    design: LeadLagDesign
    model: SecondOrderModel
    point: LinearisationPoint
    command: str = "pressure_set"

    def start(self, first: Observation) -> LeadLagMemory:
        """Memory that keeps the pressures at rest at first."""
        ahead = self.model.input_for(first.joint.position - self.point.angle, 0.0, 0.0)
        count = len(self.design.denominator) - 1
        return LeadLagMemory(
            errors=(0.0,) * count, outputs=(self.point.measured_departure(first) - ahead,) * count
        )

    def step(
        self, observation: Observation, memory: LeadLagMemory
    ) -> tuple[Command, LeadLagMemory]:
        """Pressures from now on, and the memory for the next sample."""
        goal = observation.joint.reference - self.point.angle
        ahead = self.model.input_for(
            goal, observation.joint.reference_rate, observation.joint.reference_acceleration
        )
        errors = (
            present_reference(observation.joint, self.design.period)[0]
            - observation.joint.position,
            *memory.errors,
        )
        # Limited first: the filter must not compensate a reference that is out of reach.
        ahead = self.point.given(ahead)
        filtered = sum(b * e for b, e in zip(self.design.numerator, errors, strict=True))
        filtered -= sum(
            a * u for a, u in zip(self.design.denominator[1:], memory.outputs, strict=True)
        )
        let_through = self.point.given(ahead + filtered) - ahead
        realised = errors[0] + (let_through - filtered) / self.design.numerator[0]
        return self.point.pressures(ahead + filtered), LeadLagMemory(
            errors=(realised, *errors[1:-1]), outputs=(let_through, *memory.outputs[:-1])
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class LqgMemory:
    """What an LQG regulator keeps.

    Attributes:
        expected: (2,) state at this sample as predicted at the last one [rad, rad/s].
        integral: of the error [rad s].
    """

    expected: tuple[float, float]
    integral: float


@dataclass(frozen=True, kw_only=True)
class Lqg:
    """From angle to pressures by a sampled LQG design.

    Attributes:
        design: gains, see `pamsim.linear.regulator_design.design_regulator`.
        point: where its model holds.
        tracking_time: in which the integral follows what the limits take; infinite: not [s].
        command: always ``pressure``.
    """

    design: RegulatorDesign
    point: LinearisationPoint
    tracking_time: float = math.inf
    command: str = "pressure_set"

    def start(self, first: Observation) -> LqgMemory:
        """Memory that keeps the pressures at rest."""
        away = first.joint.position - self.point.angle
        departure = self.point.measured_departure(first) - away / self.design.model.gain
        return LqgMemory(expected=(away, 0.0), integral=departure / self.design.integral_gain)

    def step(self, observation: Observation, memory: LqgMemory) -> tuple[Command, LqgMemory]:
        """Pressures from now on, and the memory for the next sample."""
        design = self.design
        innovation = observation.joint.position - self.point.angle - memory.expected[0]
        angle, rate = (
            x + gain * innovation
            for x, gain in zip(memory.expected, design.correction, strict=True)
        )
        now, rate_now = present_reference(observation.joint, design.period)
        ahead = design.model.input_for(
            observation.joint.reference - self.point.angle,
            observation.joint.reference_rate,
            observation.joint.reference_acceleration,
        )
        wanted = (
            ahead
            + design.feedback[0] * (now - self.point.angle - angle)
            + design.feedback[1] * (rate_now - rate)
            + design.integral_gain * memory.integral
        )
        given = self.point.given(wanted)
        grown = now - observation.joint.position
        grown += (given - wanted) / (design.integral_gain * self.tracking_time)
        first, second = (
            row[0] * angle + row[1] * rate + into * given
            for row, into in zip(design.transition, design.input, strict=True)
        )
        return self.point.pressures(wanted), LqgMemory(
            expected=(first, second), integral=memory.integral + design.period * grown
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class SlidingMemory:
    """What a sliding mode keeps.

    Attributes:
        integral: of the error [rad s].
    """

    integral: float


@dataclass(frozen=True, kw_only=True)
class SlidingMode:
    """From angle to pressures by an integral sliding surface.

    Attributes:
        model: G2.
        point: where it holds.
        period: between two samples [s].
        bandwidth: l of the surface [rad/s].
        reach: rate at which s is driven to the layer [rad/s^2].
        layer: half width of the boundary layer [rad/s].
        command: always ``pressure``.
    """

    model: SecondOrderModel
    point: LinearisationPoint
    period: float
    bandwidth: float
    reach: float
    layer: float
    command: str = "pressure_set"

    def start(self, first: Observation) -> SlidingMemory:
        """Memory without error so far."""
        del first
        return SlidingMemory(integral=0.0)

    def surface(self, observation: Observation, memory: SlidingMemory) -> float:
        """Distance s from the surface [rad/s]."""
        error, drift = self._missed(observation)
        return (
            drift + 2.0 * self.bandwidth * error + self.bandwidth * self.bandwidth * memory.integral
        )

    def step(
        self, observation: Observation, memory: SlidingMemory
    ) -> tuple[Command, SlidingMemory]:
        """Pressures from now on, and the memory for the next sample."""
        error, drift = self._missed(observation)
        pull = min(max(self.surface(observation, memory) / self.layer, -1.0), 1.0)
        acceleration = (
            observation.joint.reference_acceleration
            - 2.0 * self.bandwidth * drift
            - self.bandwidth * self.bandwidth * error
            - self.reach * pull
        )
        away = observation.joint.position - self.point.angle
        wanted = self.model.input_for(away, observation.joint.velocity, acceleration)
        # No sliding while the pressures are limited: the integral is held.
        waits = self.point.split.beyond(self.point.difference + wanted)
        integral = memory.integral if waits else memory.integral + self.period * error
        return self.point.pressures(wanted), SlidingMemory(integral=integral)

    def _missed(self, observation: Observation) -> tuple[float, float]:
        goal, rate = present_reference(observation.joint, self.period)
        return observation.joint.position - goal, observation.joint.velocity - rate


@dataclass(frozen=True, kw_only=True)
class Lti:
    """From angle to pressures by a sampled linear controller.

    Its inputs are the error, or the departures of reference and angle from the point [rad]; its
    output is the departure of the pressure difference [Pa]. The memory is the controller's state.

    Attributes:
        design: see `pamsim.linear.sampled_controller.sampled_controller`.
        point: operating point of the model that it was designed on; its limits bound the output.
        command: always ``pressure_set``.
    """

    design: SampledController
    point: LinearisationPoint
    command: str = "pressure_set"

    def start(self, first: Observation) -> tuple[float, ...]:
        """State that keeps the pressures at rest, if the controller integrates; else zeros."""
        departure = self.point.measured_departure(first)
        return tuple(departure * x for x in self.design.rest)

    def step(
        self, observation: Observation, memory: tuple[float, ...]
    ) -> tuple[Command, tuple[float, ...]]:
        """Pressures from now on, and the state at the next sample."""
        design = self.design
        angle = observation.joint.position - self.point.angle
        wanted_angle = present_reference(observation.joint, design.period)[0] - self.point.angle
        given = (wanted_angle - angle,) if len(design.direct) == 1 else (wanted_angle, angle)
        wanted = _product(design.output, memory) + _product(design.direct, given)
        missed = self.point.given(wanted) - wanted
        state = tuple(
            _product(a, memory) + _product(b, given) + k * missed
            for a, b, k in zip(design.transition, design.input, design.correction, strict=True)
        )
        return self.point.pressures(wanted), state


def _product(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
