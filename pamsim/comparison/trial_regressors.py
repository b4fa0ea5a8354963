"""Simulated and commanded quantities over which residuals are mapped.

Over measured ones, noise alone makes a map: a sample whose noise is high is counted among the high
values.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.recordings.signals import JOINT_KINDS, kind_of, owner_of
from pamsim.recordings.trial import Trial

_SMOOTH = 5  # samples on either side, for a speed without jitter
_STILL = 0.05  # of a trial's largest speed: slower counts as standing still


def regressors(trial: Trial, simulated: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Quantities at the samples of a trial.

    Args:
        trial: as measured.
        simulated: channel -> (n,) at its samples [SI].

    Returns:
        Name -> (n,): ``elapsed`` [s]; where pressures are simulated, ``common_pressure`` and, of
        two muscles, ``pressure_difference`` [Pa]; ``in_hold`` [s], since the command last changed;
        of each joint ``angle`` [rad] and ``speed`` [rad/s], or ``position`` [m] and
        ``sliding_speed`` [m/s], ``direction`` and ``since_reversal`` [s], such as ``knee.speed``;
        without the joint's name on a rig with one that turns.
    """
    quantities: dict[str, FloatArray] = {"elapsed": trial.time}
    pressures = [simulated.get(channel) for channel in trial.pressure_channels]
    if all(p is not None for p in pressures):
        stack = np.stack([p for p in pressures if p is not None], axis=1)
        quantities["common_pressure"] = stack.mean(axis=1)
        if trial.muscles == 2:
            quantities["pressure_difference"] = stack[:, 0] - stack[:, 1]
    commands = trial.command[:, : trial.muscles]
    changed = np.concatenate([[True], np.any(np.diff(commands, axis=0) != 0.0, axis=1)])
    if changed.mean() < 0.5:  # a command that changes at every sample has no holds
        quantities["in_hold"] = _since(trial.time, changed)
    for channel, position in simulated.items():
        if kind_of(channel) in JOINT_KINDS and position.size > 4 * _SMOOTH:
            quantities |= _of_joint(channel, trial.time, position)
    return quantities


def _of_joint(channel: str, time: FloatArray, position: FloatArray) -> dict[str, FloatArray]:
    """Quantities of a joint from its positions, named after it where it has a name."""
    joint = owner_of(channel)
    named = f"{joint}." if joint else ""
    window = np.hanning(2 * _SMOOTH + 3)[1:-1]
    padded = np.pad(position, _SMOOTH, mode="edge")
    smooth = np.convolve(padded, window / window.sum(), mode="valid")
    speed = np.asarray(np.gradient(smooth, time), dtype=np.float64)
    moving = np.abs(speed) > _STILL * np.abs(speed).max()
    direction = np.where(moving, np.sign(speed), 0.0)
    pace = "speed" if kind_of(channel) == "angle" else "sliding_speed"
    quantities = {channel: position, f"{named}{pace}": speed, f"{named}direction": direction}
    going = direction[moving]
    if going.size:
        last = np.maximum.accumulate(np.where(moving, np.arange(position.size), 0))
        held = direction[last]
        turned = np.concatenate([[True], (np.diff(held) != 0.0)])
        quantities[f"{named}since_reversal"] = _since(time, turned)
    return quantities


def _since(time: FloatArray, events: NDArray[np.bool_]) -> FloatArray:
    """Time since the last event [s]."""
    last = np.maximum.accumulate(np.where(events, np.arange(time.size), 0))
    return time - time[last]
