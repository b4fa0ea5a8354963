"""Hysteresis of the arm for a feed-forward that undoes it: the experiment, and the operator.

The force law without hysteresis predicts the angle at rest for given pressures; with hysteresis the
arm lags behind it. A Prandtl-Ishlinskii operator P maps the predicted angle to the reached one, and
the force law is evaluated at P^-1 of the wanted angle. So the law holds the nonlinearity, and P the
dependence on the past. A slow triangle of the pressure difference that shrinks from period to
period draws loops inside loops, which identify P: with its thresholds given, the output is linear
in the weights, so that the fit by non-negative least squares is unique; weights that are not
negative make an operator that lags and can be inverted (Kuhnen 2003).
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike

from pamsim.controllers.controller import PressureSplit
from pamsim.core.errors import InputError
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig
from pamsim.inference.record_checks import finite_samples
from pamsim.physics.hysteresis.maxwell_slip import play
from pamsim.physics.hysteresis.prandtl_ishlinskii import PlaySum
from pamsim.recordings.excitation import triangle
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording

_nnls: Any = scipy.optimize.nnls

_NOTHING = 1e-6  # of the sum of all weights: a play operator of smaller weight is dropped
_RATE = 20.0
"""Of commands and samples [Hz]: a step of the set points is then below the regulator's band."""


class PlaySumFit(NamedTuple):
    """An operator with the plays that the data want, and its rms error on the loop it is of."""

    operator: PlaySum
    rms: float


def identify_play_sum(input: ArrayLike, output: ArrayLike, *, plays: int = 12) -> PlaySumFit:
    """Fit the operator ``w_0 v + sum of w_k play(v; r_k)`` to a loop of input v and output, (n,).

    The loop begins where every play is at 0; a decaying triangle shows every threshold. They, as
    many as there are plays, lie evenly over the largest input.

    Raises:
        InputError: shapes differ, an input that never moves, or an output that no operator with
            an inverse follows.
    """
    v, y = finite_samples(input, "input"), finite_samples(output, "output")
    if v.shape != y.shape:
        raise InputError(f"input has {v.size} samples, output {y.size}; give one for each")
    thresholds = np.max(np.abs(v)) * (np.arange(plays) + 0.5) / plays
    if not thresholds[0] > 0.0:
        raise InputError("the input stays at 0; give a loop, such as a decaying triangle")
    played = (
        list(accumulate(v.tolist(), lambda held, x, r=r: play(x, held, r), initial=0.0))[1:]
        for r in thresholds.tolist()
    )
    weights, miss = _nnls(np.column_stack([v, *played]), y)
    felt = weights > _NOTHING * weights.sum()
    if not felt[0]:
        raise InputError(
            "the loop has no part that follows its input at once, so that its operator has no"
            " inverse; give fewer plays or a loop that reaches farther"
        )
    operator = PlaySum(
        linear=float(weights[0]),
        thresholds=tuple(thresholds[felt[1:]].tolist()),
        weights=tuple(weights[1:][felt[1:]].tolist()),
    )
    return PlaySumFit(operator, float(miss / np.sqrt(v.size)))


def decaying_triangle(
    split: PressureSplit,
    *,
    amplitude: float,
    load: float = 0.0,
    period: float = 8.0,
    periods: int = 5,
    shrink: float = 0.7,
) -> Experiment:
    """A triangle of the pressure difference around equal pressures, for an arm with a load [kg].

    Its amplitude [Pa] shrinks by a factor from period to period. The period [s] is long against the
    arm's own, so that damping does not pass for hysteresis.
    """
    time = np.arange(round(period * periods * _RATE) + 1) / _RATE
    return split.experiment(
        time,
        amplitude * triangle(time, period, shrink),
        duration=float(time[-1]),
        sample_rate=_RATE,
        load=load,
        name="decaying triangle",
    )


def loop_operator(rig: Rig, recording: Recording) -> PlaySumFit:
    """Fit the operator from the angle the rig's force law predicts to the angle reached.

    The recording is of an arm that started at rest near angle 0, run slowly.

    Raises:
        InputError: as `rest_angles` and `identify_play_sum`.
    """
    load = np.full(recording.time.size, recording.load)
    predicted = rest_angles(rig, recording.pressure, load, recording.angle)
    return identify_play_sum(predicted, recording.angle)
