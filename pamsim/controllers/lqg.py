"""LQG regulator: a Kalman filter on G2, feedback of its state, and an integral of the error.

The model's input for the wanted motion is fed forward, so that feedback acts on the deviation only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.linearisation_point import LinearisationPoint
from pamsim.controllers.present_reference import present_reference
from pamsim.linear.regulator_design import RegulatorDesign


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
