"""Undoes the hysteresis of the arm: the experiment, the operator fitted to it, its inverse.

The force law without hysteresis predicts the angle at rest for given pressures; with hysteresis the
arm lags behind it. A Prandtl-Ishlinskii operator P maps the predicted angle to the reached one, and
the force law is evaluated at P^-1 of the wanted angle. So the law holds the nonlinearity, and P the
dependence on the past. A slow triangle of the pressure difference that shrinks from period to
period draws loops inside loops, which identify P: with its thresholds given, the output is linear
in the weights, so that the fit by non-negative least squares is unique; weights that are not
negative make an operator that lags and can be inverted (Kuhnen 2003).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike, NDArray

from pamsim.controllers.operating_point import PressureSplit
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig
from pamsim.inference.record_checks import finite_samples
from pamsim.physics.hysteresis.maxwell_slip import play
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from pamsim.recordings.excitation import triangle
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording


@dataclass(frozen=True, kw_only=True)
class HysteresisInverse:
    """From the wanted angle to the angle at which the force law is evaluated.

    Attributes:
        inverse: P^-1, angle to angle [rad].
    """

    inverse: PlaySum

    @classmethod
    def of(cls, lagging: PlaySum) -> HysteresisInverse:
        """Inverse of an operator P from predicted to reached angle."""
        return cls(inverse=lagging.inverse())

    def start(self, angle: float) -> tuple[float, ...]:
        """Memory of an arm that moved from angle 0 to an angle [rad] without turning back."""
        return self.inverse.step(self.inverse.virgin(), angle)[0]

    def undone(self, angle: float, plays: tuple[float, ...]) -> tuple[float, tuple[float, ...]]:
        """Angle at which the force law is evaluated [rad], and the new memory.

        Args:
            angle: wanted [rad].
            plays: memory.
        """
        plays_after, compensated = self.inverse.step(plays, angle)
        return compensated, plays_after


FloatArray = NDArray[np.float64]
_nnls: Any = scipy.optimize.nnls

_NOTHING = 1e-6  # of the sum of all weights: a play operator of smaller weight is dropped


@dataclass(frozen=True)
class PlaySumFit:
    """An operator and its error on the loop it was fitted to.

    Attributes:
        operator: with the plays that the data want.
        rms: root mean square of measured less fitted output [output unit].
    """

    operator: PlaySum
    rms: float


def identify_play_sum(
    input: ArrayLike,
    output: ArrayLike,
    *,
    plays: int = 12,
) -> PlaySumFit:
    """Fit the operator ``w_0 v + sum of w_k play(v; r_k)`` to a loop.

    Args:
        input: v, shape ``(n,)``, from a state in which every play is at 0; a decaying triangle
            shows every threshold [input unit].
        output: shape ``(n,)`` [output unit].
        plays: number of thresholds, evenly over the largest input.

    Returns:
        The operator and its error.

    Raises:
        InputError: shapes differ, an input that never moves, or an output that no operator with
            an inverse follows.
    """
    v, y = finite_samples(input, "input"), finite_samples(output, "output")
    if v.shape != y.shape:
        raise InputError(f"input has {v.size} samples, output {y.size}; give one for each")
    largest = float(np.max(np.abs(v)))
    if not largest > 0.0:
        raise InputError("the input stays at 0; give a loop, such as a decaying triangle")
    thresholds = [largest * (k + 0.5) / plays for k in range(plays)]
    columns = np.column_stack([v, *(_played(v, r) for r in thresholds)])
    weights, miss = _nnls(columns, y)
    total = float(np.sum(weights))
    if not weights[0] > _NOTHING * total:
        raise InputError(
            "the loop has no part that follows its input at once, so that its operator has no"
            " inverse; give fewer plays or a loop that reaches farther"
        )
    kept = [k for k in range(len(thresholds)) if weights[k + 1] > _NOTHING * total]
    operator = PlaySum(
        linear=float(weights[0]),
        thresholds=tuple(float(thresholds[k]) for k in kept),
        weights=tuple(float(weights[k + 1]) for k in kept),
    )
    return PlaySumFit(operator=operator, rms=float(miss) / float(np.sqrt(v.size)))


def _played(values: FloatArray, threshold: float) -> FloatArray:
    held, output = 0.0, np.empty_like(values)
    for k, x in enumerate(values.tolist()):
        output[k] = held = play(x, held, threshold)
    return output


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
