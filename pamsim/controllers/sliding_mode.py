"""Integral sliding mode on G2 with a boundary layer.

With e = angle - reference the surface is s = e' + 2 l e + l^2 integral of e, on which the error
dies out with both poles at -l, whatever disturbs the input less than ``reach`` can overcome. Inside
the layer |s| < layer the switching is a gain, so that valves do not chatter; the integral removes
the offset that the layer would leave (Slotine and Li, Applied Nonlinear Control, 1991, chapter 7).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.controller import Command, Observation
from pamsim.controllers.linearisation_point import LinearisationPoint
from pamsim.controllers.present_reference import present_reference
from pamsim.linear.second_order_model import SecondOrderModel


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
