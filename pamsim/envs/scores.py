"""How well an episode was driven: error, overshoot, settling, switching, air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.envs.closed_loop import OPEN, Drive

FloatArray = NDArray[np.float64]

SETTLED_SHARE, SETTLED_ANGLE = 0.05, math.radians(0.2)
"""A step has settled within this share of its height, or this angle [rad], the larger of both."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """Figures of one joint in an episode, or their means over several.

    Attributes:
        rmse: of the position [rad or m].
        worst: largest error of the position [rad or m].
        overshoot: largest travel beyond a new reference, as a share of the step; NaN without steps.
        settling: median time from a step to the end of what exceeds the band [s]; what has not
            settled when the next step comes counts with the time till then; NaN without steps.
        stiffness_error: RMS error relative to the stiffness wanted; NaN where none is.
        switching: changes of all muscles' valves between filling, shut and exhausting [1/s].
        air: let in by all muscles [kg/s].
        reward: of the episode.
    """

    rmse: float
    worst: float
    overshoot: float
    settling: float
    stiffness_error: float
    switching: float
    air: float
    reward: float


def score(run: Drive, joint: str | None = None) -> Score:
    """Figures of one joint in one episode.

    Args:
        run: the episode.
        joint: name; may be left out for a rig with one joint.

    Raises:
        InputError: if there is no such joint, or several to choose from.
    """
    if joint not in run.joints and (joint is not None or len(run.joints) > 1):
        raise InputError(f"score: name one joint of the rig; known: {', '.join(run.joints)}")
    column = run.joints.index(joint) if joint else 0
    position, reference = run.position[:, column], run.reference[:, column]
    error = position - reference
    seconds = len(error) * run.period
    state = np.sign(run.opening) * (np.abs(run.opening) > OPEN)
    steps = _steps(position, reference, run.period)
    asked = run.wanted_stiffness[:, column]
    wanted = asked > 0.0
    relative = run.stiffness[wanted, column] / asked[wanted] - 1.0
    return Score(
        rmse=float(np.sqrt(np.mean(error**2))),
        worst=float(np.abs(error).max()),
        overshoot=max((s[0] for s in steps), default=math.nan),
        settling=float(np.median([s[1] for s in steps])) if steps else math.nan,
        stiffness_error=float(np.sqrt(np.mean(relative**2))) if wanted.any() else math.nan,
        switching=float((np.diff(state, axis=0) != 0.0).sum() / seconds),
        air=float(run.air.sum() / seconds),
        reward=run.reward,
    )


def mean_score(scores: list[Score]) -> Score:
    """Means over episodes; of the RMSE the root of the mean square, of the worst the largest."""

    def mean(name: str) -> float:
        return float(np.mean([getattr(score, name) for score in scores]))

    return Score(
        rmse=math.sqrt(float(np.mean([score.rmse**2 for score in scores]))),
        worst=max(score.worst for score in scores),
        overshoot=mean("overshoot"),
        settling=mean("settling"),
        stiffness_error=mean("stiffness_error"),
        switching=mean("switching"),
        air=mean("air"),
        reward=mean("reward"),
    )


def _steps(position: FloatArray, reference: FloatArray, period: float) -> list[tuple[float, float]]:
    """Overshoot [-] and settling time [s] of every jump of a reference that is held after it."""
    jumps = np.flatnonzero(np.diff(reference) != 0.0) + 1
    # A reference that moves all the time has no steps.
    if len(jumps) > 0.1 * len(reference):
        return []
    starts = [0, *jumps.tolist()]
    steps: list[tuple[float, float]] = []
    for begin, end in zip(starts, [*jumps.tolist(), len(reference)], strict=True):
        wanted = float(reference[begin])
        height = wanted - float(position[begin - 1] if begin else 0.0)
        if abs(height) < SETTLED_ANGLE:
            continue
        beyond = (position[begin:end] - wanted) * math.copysign(1.0, height)
        band = max(SETTLED_SHARE * abs(height), SETTLED_ANGLE)
        outside = np.flatnonzero(np.abs(beyond) > band)
        settled = (int(outside[-1]) + 1) * period if len(outside) else 0.0
        steps.append((max(0.0, float(beyond.max()) / abs(height)), settled))
    return steps
