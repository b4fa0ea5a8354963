"""Controllers that a linear model about an operating point is the base of.

A lead-lag filter, an LQG regulator, an integral sliding mode, and any linear controller designed
with python-control. Feedback acts on the deviation from the wanted motion, for which the model's
own input goes ahead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pamsim.controllers.controller import (
    Command,
    JointObservation,
    Observation,
    PressureSplit,
    present_reference,
)
from pamsim.controllers.lead_lag_design import LeadLagDesign
from pamsim.controllers.regulator_design import RegulatorDesign
from pamsim.controllers.sampled_controller import SampledController, rows, sampled_controller
from pamsim.controllers.second_order_model import SecondOrderModel
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import simulate
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import SignalRecord

_STEPS = 2e4 * np.array([0.0, 1.0, 0.0, -1.0, 0.0])  # Pa
_RATE = 50.0  # Hz
_NAME = "steps about an operating point"


@dataclass(frozen=True, kw_only=True)
class LinearisationPoint:
    """A pressure difference and the angle that it holds; linear models are deviations from it.

    Attributes:
        split: makes pressures of the difference.
        difference: p1 - p2 [Pa].
        angle: at rest there [rad].
    """

    split: PressureSplit
    difference: float = 0.0
    angle: float = 0.0

    def held(self, first: Observation, model: SecondOrderModel | None) -> float:
        """Departure [Pa] of pressures at rest, beyond what a model needs to hold the angle."""
        departure = first.pressure[0] - first.pressure[1] - self.difference
        if model is None:
            return departure
        return departure - model.input_for(first.joint.position - self.angle, 0.0, 0.0)

    def input_for(self, model: SecondOrderModel, joint: JointObservation) -> float:
        """Departure [Pa] under which a model of this point moves as the reference."""
        return model.input_for(
            joint.reference - self.angle, joint.reference_rate, joint.reference_acceleration
        )

    def given(self, departure: float) -> float:
        """Departure [Pa] that remains of a wanted one after the limits."""
        return self.split.given(self.difference + departure) - self.difference

    def pressures(self, departure: float) -> Command:
        """Pressures for a departure from the point's difference, gauge [Pa]."""
        return self.split.pressures(self.difference + departure)


class LinearisedArm(NamedTuple):
    """An operating point; G2 there from p1 - p2 [Pa] to the angle [rad]; the fit that found it."""

    point: LinearisationPoint
    model: SecondOrderModel
    fit: IdentifiedModel


def linearise_arm(
    rig: Rig,
    split: PressureSplit,
    *,
    difference: float = 0.0,
    load: float = 0.0,
    hold: float = 1.5,
) -> LinearisedArm:
    """Simulate steps of 20 kPa about a pressure difference [Pa] and fit G2.

    The arm has a load [kg] and comes to rest while each step is held [s].

    Raises:
        InputError: if the fitted G2 is unstable or its gain is not positive.
        SimulationError: if the run broke down.
    """
    # The first level is short: it only shows the angle at rest.
    time = np.array([0.0, *(0.1 + hold * np.arange(len(_STEPS) - 1))])
    steps = split.experiment(
        time,
        difference + _STEPS,
        duration=float(time[-1]) + hold,
        sample_rate=_RATE,
        load=load,
        name=_NAME,
    )
    run = simulate(rig, steps).completed()
    record = SignalRecord(
        name=_NAME,
        time=run.time,
        inputs=run.command[:, 0] - run.command[:, 1],
        output=run.angle,
        units_input=("Pa",),
        unit_output="rad",
    )
    fit = fit_model([record], ContinuousStructure(order=2, real_lags=False))
    point = LinearisationPoint(split=split, difference=difference, angle=float(run.angle[0]))
    return LinearisedArm(point, SecondOrderModel.of_fit(fit), fit)


@dataclass(frozen=True, kw_only=True)
class LinearisedController:
    """A controller to pressures about an operating ``point``, whose limits bound the output."""

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
        design: gains, see `pamsim.controllers.regulator_design.design_regulator`.
        tracking_time: in which the integral follows what the limits take; infinite: not [s].
    """

    design: RegulatorDesign
    tracking_time: float = math.inf

    def start(self, first: Observation) -> LqgMemory:
        """Memory that keeps the pressures at rest."""
        departure = self.point.held(first, self.design.model)
        away = first.joint.position - self.point.angle
        return LqgMemory((away, 0.0), departure / self.design.integral_gain)

    def step(self, observation: Observation, memory: LqgMemory) -> tuple[Command, LqgMemory]:
        """Pressures from now on, and the memory for the next sample."""
        joint, design, point = observation.joint, self.design, self.point
        innovation = joint.position - point.angle - memory.expected[0]
        angle, rate = _moved(memory.expected, design.correction, innovation)
        goal, goal_rate = present_reference(joint, design.period)
        wanted = point.input_for(design.model, joint) + design.integral_gain * memory.integral
        wanted += _dot(design.feedback, (goal - point.angle - angle, goal_rate - rate))
        given = point.given(wanted)
        missed = (given - wanted) / (design.integral_gain * self.tracking_time)
        integral = memory.integral + design.period * (goal - joint.position + missed)
        turned = [_dot(row, (angle, rate)) for row in design.transition]
        return point.pressures(wanted), LqgMemory(_moved(turned, design.input, given), integral)


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
        design: see `pamsim.controllers.sampled_controller.sampled_controller`.
        model: G2, whose own input goes ahead; or None.
    """

    design: SampledController
    model: SecondOrderModel | None = None

    def start(self, first: Observation) -> tuple[float, ...]:
        """State that keeps the pressures at rest, if the controller integrates; else zeros."""
        departure = self.point.held(first, self.model)
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
        each = zip(design.transition, design.input, strict=True)
        state = [_dot(a, memory) + _dot(b, seen) for a, b in each]
        missed = point.given(wanted) - wanted
        return point.pressures(wanted), _moved(state, design.correction, missed)


def linear_controller(
    system: Any, rig: Rig, *, period: float, common: float, load: float = 0.0
) -> Lti:
    """Run what was designed with python-control, about the angle at which a rig rests.

    Args:
        system: see `pamsim.controllers.sampled_controller.sampled_controller`; rad to Pa.
        rig: of one joint between two muscles.
        period: between two samples [s], ``dt`` of the environment.
        common: pressure of both muscles where the arm rests, gauge [Pa].
        load: on the arm [kg].

    Raises:
        InputError: for a common pressure beyond the supply's, or a system that is no controller.
    """
    split = PressureSplit(common=common, supply=rig.supply_pressure)
    moment = split.experiment(
        np.zeros(1), np.zeros(1), duration=1.0 / _RATE, sample_rate=_RATE, load=load
    )
    angle = float(simulate(rig, moment).completed().angle[0])
    return Lti(
        design=sampled_controller(system, period),
        point=LinearisationPoint(split=split, angle=angle),
    )


def lead_lag(design: LeadLagDesign, model: SecondOrderModel, point: LinearisationPoint) -> Lti:
    """Lead-lag filter of the error beside the input of G2, about the point where it holds.

    At limits its state becomes what it had been under the error that gives the limited output. It
    starts as if it had always given what the pressures at rest need.
    """
    numerator, poles = np.array(design.numerator), np.array(design.denominator[1:])
    first, into = design.numerator[0], numerator[1:] - poles * numerator[0]
    transition = np.eye(len(poles), k=1)
    transition[:, 0] = -poles
    filtered = SampledController(
        period=design.period,
        transition=rows(transition),
        input=rows(into[:, None]),
        output=(1.0, *[0.0] * (len(poles) - 1)),
        direct=(first,),
        rest=tuple((-np.cumsum(poles[::-1])[::-1]).tolist()),
        correction=tuple((into / first).tolist()),
    )
    return Lti(design=filtered, model=model, point=point)


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _moved(state: Sequence[float], along: Sequence[float], by: float) -> tuple[float, ...]:
    return tuple(x + way * by for x, way in zip(state, along, strict=True))
