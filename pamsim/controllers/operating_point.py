"""Where a linear model of the arm holds: pressure difference, angle at rest, and G2 fitted there.

The difference of both muscles' pressures turns the joint, the common pressure stiffens it. Linear
models are deviations from a difference and the angle that it holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pamsim.controllers.controller import Command, JointObservation, Observation
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import simulate
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.identified_model import IdentifiedModel
from pamsim.linear.second_order_model import SecondOrderModel
from pamsim.linear.signal_record import SignalRecord
from pamsim.recordings.experiment import Experiment

_STEPS = (0.0, 1.0, 0.0, -1.0, 0.0)
_RATE = 50.0  # Hz
_NAME = "steps about an operating point"


@dataclass(frozen=True, kw_only=True)
class PressureSplit:
    """Makes pressures of a difference.

    Attributes:
        common: p0, mean of both pressures where neither is limited, gauge [Pa].
        supply: highest pressure there is, gauge [Pa].

    Raises:
        InputError: if the common pressure is not between 0 and the supply.
    """

    common: float
    supply: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.common <= self.supply:
            raise InputError(
                f"common pressure {self.common / 1e3:g} kPa is not between 0 and the supply's"
                f" {self.supply / 1e3:g} kPa; choose one that is"
            )

    def pressures(self, difference: float) -> Command:
        """Pressures of muscles 1 and 2 for a wanted difference p1 - p2, gauge [Pa]."""
        wanted = self.common + 0.5 * difference, self.common - 0.5 * difference
        return tuple(min(max(pressure, 0.0), self.supply) for pressure in wanted)

    def given(self, difference: float) -> float:
        """Difference [Pa] that remains of a wanted one after the limits."""
        first, second = self.pressures(difference)
        return first - second

    def experiment(
        self, time: FloatArray, differences: FloatArray, *, hold: float = 0.0, **more: Any
    ) -> Experiment:
        """Run that starts at the first of some differences (n,) [Pa], each set at a time (n,) [s].

        The last one is held for ``hold`` [s]; ``more`` are other attributes of `Experiment`.
        """
        command = np.array([self.pressures(each) for each in differences.tolist()])
        return Experiment(
            drive="pressure_set",
            command_time=time,
            command_value=command,
            start_pressure=command[0],
            duration=float(time[-1]) + hold,
            **more,
        )

    def beyond(self, difference: float) -> bool:
        """Whether the limits reduce a wanted difference [Pa]."""
        return 0.5 * abs(difference) > min(self.common, self.supply - self.common)


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

    def measured_departure(self, observation: Observation) -> float:
        """Measured difference from the point's [Pa]."""
        return observation.pressure[0] - observation.pressure[1] - self.difference

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


@dataclass(frozen=True, eq=False)
class LinearisedArm:
    """An operating point with its model.

    Attributes:
        point: pressure difference and angle that the model is linear about.
        model: G2 from p1 - p2 [Pa] to the angle [rad].
        fit: the model with intervals, scores and status.
    """

    point: LinearisationPoint
    model: SecondOrderModel
    fit: IdentifiedModel


def linearise_arm(
    rig: Rig,
    split: PressureSplit,
    *,
    difference: float = 0.0,
    step: float = 2e4,
    load: float = 0.0,
    hold: float = 1.5,
) -> LinearisedArm:
    """Simulate steps about a pressure difference and fit G2.

    Args:
        rig: the rig.
        split: makes pressures of the difference.
        difference: p1 - p2 at the operating point [Pa].
        step: to either side of it [Pa].
        load: mass on the arm [kg].
        hold: time between two steps, long enough to come to rest [s].

    Raises:
        InputError: if the fitted G2 is unstable or its gain is not positive.
        SimulationError: if the run broke down.
    """
    # The first level is short: it only shows the angle at rest.
    time = np.array([0.0, *(0.1 + hold * np.arange(len(_STEPS) - 1))])
    levels = difference + step * np.array(_STEPS)
    experiment = split.experiment(time, levels, hold=hold, sample_rate=_RATE, load=load, name=_NAME)
    run = simulate(rig, experiment).completed()
    record = SignalRecord(
        name=_NAME,
        time=run.time,
        inputs=run.command[:, 0] - run.command[:, 1],
        output=run.angle,
        units_input=("Pa",),
        unit_output="rad",
    )
    fit = fit_continuous([record], order=2, real_lags=False)
    point = LinearisationPoint(split=split, difference=difference, angle=float(run.angle[0]))
    return LinearisedArm(point=point, model=SecondOrderModel.of_fit(fit), fit=fit)
