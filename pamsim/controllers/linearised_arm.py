"""A linear model about an operating point: G2 fitted to small steps of the pressure difference.

The steps go both ways, so that the model averages filling and venting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pamsim.controllers.linearisation_point import LinearisationPoint
from pamsim.controllers.pressure_split import PressureSplit
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import simulate
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.identified_model import IdentifiedModel
from pamsim.linear.second_order_model import SecondOrderModel
from pamsim.linear.signal_record import SignalRecord
from pamsim.recordings.experiment import Experiment

_STEPS = (0.0, 1.0, 0.0, -1.0, 0.0)
_RATE = 50.0  # Hz


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

    Returns:
        The point and its model.

    Raises:
        InputError: if the fitted G2 is unstable or its gain is not positive.
        SimulationError: if the run broke down.
    """
    # The first level is short: it only shows the angle at rest.
    time = np.array([0.0, *(0.1 + hold * np.arange(len(_STEPS) - 1))])
    command = np.array([split.pressures(difference + step * level) for level in _STEPS])
    experiment = Experiment(
        drive="pressure_set",
        command_time=time,
        command_value=command,
        start_pressure=command[0],
        duration=float(time[-1]) + hold,
        sample_rate=_RATE,
        load=load,
        name="steps about an operating point",
    )
    run = simulate(rig, experiment).completed()
    record = SignalRecord(
        name=experiment.name,
        time=run.time,
        inputs=run.command[:, 0] - run.command[:, 1],
        output=run.angle,
        units_input=("Pa",),
        unit_output="rad",
    )
    fit = fit_continuous([record], order=2, real_lags=False)
    return LinearisedArm(
        point=LinearisationPoint(split=split, difference=difference, angle=float(run.angle[0])),
        model=SecondOrderModel.of_fit(fit),
        fit=fit,
    )
