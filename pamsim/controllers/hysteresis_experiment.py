"""The experiment that identifies an arm's hysteresis, and the operator fitted to its recording.

A slow triangle of the pressure difference that shrinks from period to period draws loops inside
loops. Input of the operator is the angle that the force law without hysteresis predicts for the
measured pressures, output the measured angle; `pamsim.controllers.hysteresis_inverse` undoes.
"""

from __future__ import annotations

import numpy as np

from pamsim.controllers.play_sum_fit import PlaySumFit, identify_play_sum
from pamsim.controllers.pressure_split import PressureSplit
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig
from pamsim.recordings.excitation import triangle
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording

_RATE = 20.0
"""Of commands and samples [Hz]: a step of the set points is then below the regulator's band."""


def decaying_triangle(
    split: PressureSplit,
    *,
    amplitude: float,
    load: float = 0.0,
    period: float = 8.0,
    periods: int = 5,
    shrink: float = 0.7,
) -> Experiment:
    """A triangle of the pressure difference around equal pressures.

    Args:
        split: makes pressures of the difference.
        amplitude: of the difference in the first period [Pa].
        load: mass on the arm [kg].
        period: long against the arm's own, so that damping does not pass for hysteresis [s].
        periods: their number.
        shrink: factor on the amplitude from one period to the next.
    """
    time = np.arange(round(period * periods * _RATE) + 1) / _RATE
    differences = amplitude * triangle(time, period, shrink)
    return Experiment(
        drive="pressure_set",
        command_time=time,
        command_value=np.array([split.pressures(float(item)) for item in differences]),
        start_pressure=np.array(split.pressures(0.0)),
        duration=float(time[-1]),
        sample_rate=_RATE,
        load=load,
        name="decaying triangle",
    )


def loop_operator(rig: Rig, recording: Recording, *, plays: int = 12) -> PlaySumFit:
    """Fit the operator from the angle the force law predicts to the angle reached.

    Args:
        rig: its law, gravity and springs predict; its hysteresis is not used.
        recording: of an arm that started at rest near angle 0, run slowly.
        plays: number of thresholds, evenly over the largest predicted angle.

    Raises:
        InputError: as `rest_angles` and `identify_play_sum`.
    """
    load = np.full(recording.time.size, recording.load)
    predicted = rest_angles(rig, recording.pressure, load, recording.angle)
    return identify_play_sum(predicted, recording.angle, plays=plays)
