"""Any linear controller designed with python-control, about an operating point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.linearisation_point import LinearisationPoint
from pamsim.controllers.present_reference import present_reference
from pamsim.linear.sampled_controller import SampledController


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
