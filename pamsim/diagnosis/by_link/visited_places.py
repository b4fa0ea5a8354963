"""Where curves may be learned of what has no name, from end to end of what trials have visited."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from pamsim.comparison.link_inputs import link_inputs, smoothed
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.curve_places import (
    ALL_VALVES,
    MUSCLES,
    POINTS,
    EvenPlace,
    JointPlace,
    Kind,
    Place,
)
from pamsim.engine.equilibrium import moment_arms, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.chain import CONTROLS as ARMS
from pamsim.physics.chain import learns_arm
from pamsim.physics.learned import learns
from pamsim.physics.learned_tension import CONTROLS as TENSIONS
from pamsim.physics.learned_tension import LearnedTension, learns_tension
from pamsim.physics.valves import CONTROLS as FLOWS
from pamsim.physics.valves import learns_flow
from pamsim.recordings.sensors import CONTROLS as READINGS
from pamsim.recordings.trial import Trial

_RATES = (0.2, 99.8)
"""Percentiles of rates between which a curve is spread: those of read positions have outliers."""

_SEEN = 40  # rows of a trial whose contractions show the range that was visited
_SENSOR, _VALVE, _ARM = "sensor.learned_", "valve.learned_", "chain.learned_"


def places_of(rig: Rig, trials: Sequence[Trial]) -> list[Place]:
    """Everything that a curve can be learned of."""
    shared = (muscle_place(rig, trials), sensor_place(rig, trials), valve_place(rig, trials))
    return [*joint_places(rig, trials), *(one for one in shared if one)]


def joint_places(rig: Rig, trials: Sequence[Trial]) -> list[Place]:
    """Each joint that moves freely with a tendon over it alone, and each such tendon.

    Those that have a curve already are left out.
    """
    found: list[Place] = []
    for j, joint in enumerate(rig.joints):
        read, seen = _readings(rig, joint, trials)
        if not seen:
            continue
        rates = [np.gradient(one, t.time) for one, t in zip(read, seen, strict=True)]
        at = np.linspace(*_between(read), POINTS)
        poses = np.tile(rig.model.qpos0, (POINTS, 1))
        poses[:, rig.position_addresses[j]] = at
        arms = moment_arms(rig, poses)  # (n, m, j)
        over = np.abs(arms).max(axis=0) > 0.0
        alone = [
            (m, name)
            for m, name in enumerate(rig.muscles)
            if over[m, j] and np.count_nonzero(over[m]) == 1
        ]
        lengths = tendon_lengths(rig, poses)
        found += [
            EvenPlace(
                acts_at=name,
                joint=joint,
                ends_at=f"{name}:{_ARM}",
                at=at,
                along=lengths[:, m],
                fields={Kind.ARM: f"{name}:{_ARM}"},
                count=ARMS,
            )
            for m, name in alone
            # What pushes has no chain.
            if not (rig.muscles[name].pushes or learns_arm(rig.muscles[name].chain))
        ]
        for m, name in [one for one in alone if not learns(rig.muscles[one[1]].learned)][:1]:
            found.append(
                JointPlace(
                    joint=joint,
                    muscle=name,
                    at=at,
                    rates=_between(rates, _RATES),
                    length=lengths[:, m],
                    arm=arms[:, m, j],
                )
            )
    return found


def _readings(
    rig: Rig, joint: str, trials: Sequence[Trial]
) -> tuple[list[FloatArray], list[Trial]]:
    """Smoothed positions of a joint in the trials that record it, and these trials."""
    channel = rig.names.joint_channel(joint)
    seen = [trial for trial in trials if channel in trial.measured]
    return [smoothed(trial.time, trial.measured[channel]) for trial in seen], seen


def _between(
    signals: Sequence[FloatArray], percentiles: tuple[float, float] = (0.0, 100.0)
) -> tuple[float, float]:
    """Percentiles of some signals together, their least and largest values if left out."""
    low, high = np.percentile(np.concatenate(signals), percentiles).tolist()
    return low, high


def sensor_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The sensor of a rig's only joint; None of several, if it has a curve, or is not recorded.

    A rig states one error for the sensors of all of its joints, which curves would not share.
    """
    if len(rig.joints) > 1 or (rig.sensor is not None and rig.sensor.learns):
        return None
    (joint,) = rig.joints
    read, _ = _readings(rig, joint, trials)
    ends = _between(read) if read else (0.0, 0.0)
    return _even(joint, _SENSOR, ends, {Kind.READING: _SENSOR}, READINGS, joint)


def muscle_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The muscles of a rig; None if one pushes or has a curve, or no trial has all positions.

    See `pamsim.physics.learned_tension` for which contractions their curves run over.
    """
    if any(one.pushes or learns_tension(one.learned_tension) for one in rig.muscles.values()):
        return None
    found = contractions(rig, trials)
    low = min((float(one.min()) for one in found), default=0.0)
    high = max((float(one.max()) for one in found), default=0.0)
    at = f"{LearnedTension.group}."
    fields = {Kind.PRESSED: f"{at}area_", Kind.UNPRESSED: f"{at}pull_"}
    return _even(MUSCLES, at, (low, high), fields, TENSIONS)


def contractions(rig: Rig, trials: Sequence[Trial]) -> list[FloatArray]:
    """Contractions (r, m) of a rig's muscles at some rows of each trial that records all joints.

    They are those against the lengths at which the pressurised muscles are free, where pressures
    are measured.
    """
    zeros = np.array([one.mounting.length_at_zero for one in rig.muscles.values()])
    nominal = np.array([one.braided.nominal_length for one in rig.muscles.values()])
    extended = np.array([one.braided.extensibility for one in rig.muscles.values()])
    found: list[FloatArray] = []
    for trial in trials:
        inputs = link_inputs(rig, trial)
        if inputs.positions.keys() != rig.joints.keys():
            continue
        rows = np.linspace(0, trial.time.size - 1, _SEEN).astype(int)
        poses = np.tile(rig.model.qpos0, (_SEEN, 1))
        for address, joint in zip(rig.position_addresses, rig.joints, strict=True):
            poses[:, address] = inputs.positions[joint][rows]
        pressure = np.zeros((_SEEN, zeros.size))
        for muscle, values in inputs.pressures.items():
            pressure[:, muscle] = values[rows]
        free = nominal * (1.0 + extended * pressure)
        found.append(1.0 - (zeros + tendon_lengths(rig, poses)) / free)
    return found


def valve_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The valves of a rig; None if one has a curve or pulses, or none opens.

    A valve that pulses is open or shut. Which openings a regulator has commanded is not recorded:
    all may have been visited.
    """
    kinds = {kind for trial in trials for kind in trial.drives.muscles}
    if "pulse" in kinds or any(learns_flow(one.valve) for one in rig.muscles.values()):
        return None
    visited = [end for trial in trials for end in _openings(trial)]
    ends = min(visited, default=0.0), max(visited, default=0.0)
    return _even(ALL_VALVES, _VALVE, ends, {Kind.FLOW: _VALVE}, FLOWS)


def _openings(trial: Trial) -> Iterator[float]:
    for column, kind in zip(trial.command.T, trial.drives.muscles, strict=False):
        if kind == "pressure_set":
            yield from (-1.0, 1.0)
        elif kind == "valve":
            yield from np.clip([column.min(), column.max()], -1.0, 1.0).tolist()


def _even(
    acts_at: str,
    ends_at: str,
    ends: tuple[float, float],
    fields: Mapping[Kind, str],
    count: int,
    joint: str = "",
) -> EvenPlace | None:
    """A place with its fields; None where nothing was visited."""
    at = np.linspace(*ends, POINTS)
    place = EvenPlace(
        acts_at=acts_at,
        joint=joint,
        ends_at=ends_at,
        at=at,
        along=at,
        fields=fields,
        count=count,
    )
    return place if at[-1] > at[0] else None
