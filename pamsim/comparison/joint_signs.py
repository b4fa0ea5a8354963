"""The sign of a joint's column in a log, by what drives the joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import moment_arms
from pamsim.engine.rig import Rig
from pamsim.recordings.column_guess import Guess
from pamsim.recordings.signals import (
    JOINT_KINDS,
    kind_of,
    owner_of,
)
from pamsim.recordings.trial import Trial

_AGAINST = -0.7
"""Correlation of a joint with what its muscles' pressures pull from which its sign is turned."""


def turned_joints(
    guesses: tuple[Guess, ...], stated: Sequence[str], trials: Sequence[Trial], rig: Rig
) -> tuple[Guess, ...]:
    """The guesses, the signs of joints turned that move against what drives them."""
    shortening = -moment_arms(rig, rig.model.qpos0)
    arms = dict(zip(rig.joints, shortening.T, strict=True))
    along: dict[str, list[float]] = {}
    for joint, channel in zip(rig.joints, rig.names.joint_channels, strict=True):
        for trial in trials:
            pull, angle = _driving(trial, joint, arms[joint], rig), trial.measured.get(channel)
            if pull is None or angle is None:
                continue
            if np.ptp(pull) > 0.0 and np.ptp(angle) > 0.0:
                along.setdefault(joint, []).append(float(np.corrcoef(pull, angle)[0, 1]))
    against = {joint for joint, found in along.items() if np.mean(found) < _AGAINST}
    by_itself = {joint for trial in trials for joint in trial.drives.joints}

    def why(joint: str) -> str:
        if joint in by_itself:
            return f"sign reversed, because it falls while {joint} is driven up"
        swapped = "; or they are swapped" if len(rig.muscles) > 1 else ""
        return f"sign reversed, because it falls while the muscles pull it up{swapped}"

    return tuple(
        replace(one, sign=-one.sign, warnings=(*one.warnings, why(owner_of(one.quantity))))
        if owner_of(one.quantity) in against
        and kind_of(one.quantity) in JOINT_KINDS
        and one.quantity not in stated
        else one
        for one in guesses
    )


def _driving(trial: Trial, joint: str, arm: FloatArray, rig: Rig) -> FloatArray | None:
    """What drives a joint in a trial up to a factor, (n,): its own torque or force, or its muscles.

    It is None where nothing says its sign: the pressures of muscles that drive nothing, as sealed
    ones, follow the joint; a motion may be imposed. ``arm``, (m,), is by how much each muscle
    shortens as the joint moves up.
    """
    drives = trial.drives
    if joint in drives.imposed:
        return None
    if joint in drives.joints:
        return trial.command[:, len(drives.muscles) + list(drives.joints).index(joint)]
    pressures = [trial.measured.get(name) for name in rig.names.of_muscles("pressure")]
    known = [p for p in pressures if p is not None]
    if len(known) < len(pressures) or set(drives.muscles) == {"sealed"}:
        return None
    return np.column_stack(known) @ arm
