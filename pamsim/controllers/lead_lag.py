"""Lead-lag filter on the error, over the model's own input for the wanted motion.

Its memory holds the limited output and the error that corresponds to it, so that the filter does
not wind up (Hanus, Kinnaert and Henrotte 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.linearisation_point import LinearisationPoint
from pamsim.controllers.present_reference import present_reference
from pamsim.linear.lead_lag_design import LeadLagDesign
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
