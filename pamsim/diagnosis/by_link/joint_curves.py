"""Torques on a joint as forces along a tendon that runs over it alone: their ends and curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.link_inputs import smoothed
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.engine.equilibrium import moment_arms, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.learned import LENGTH, SPEED, Learned, learned_force
from pamsim.recordings.trial import Trial

POSITION, RATE = "position", "speed"

_POSITIONS, _RATES = (0.0, 100.0), (0.2, 99.8)
"""Percentiles of what was visited, between which a curve is spread: rates of read positions have
outliers."""

FIELD, COUNT = {POSITION: "force_", RATE: "drag_"}, {POSITION: LENGTH, RATE: SPEED}
"""Beginning of the names of a curve's control forces, and how many there are."""

_ENDS = {POSITION: ("low", "high"), RATE: ("slowest", "fastest")}

_POINTS = 60  # of a curve that is written


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A learned torque.

    Attributes:
        joint: on which.
        over: ``position`` or ``speed`` of the joint.
        at: (n,) of them, from one end of what was visited to the other [rad or m, or per s].
        torque: (n,) in the direction in which the position grows [N m or N].
        reach: (n,) half width of its 95 % band; infinite where the data do not show the curve.
    """

    joint: str
    over: str
    at: FloatArray
    torque: FloatArray
    reach: FloatArray


@dataclass(frozen=True)
class Place:
    """A joint, the tendon of the muscle that stands for it, and what was visited of both.

    Attributes:
        at: (n,) positions from one end to the other [rad or m].
        rates: slowest and fastest change of the position [per s].
        length: (n,) of the tendon at the positions [m].
        arm: (n,) change of that length with the position.
    """

    joint: str
    muscle: str
    at: FloatArray
    rates: tuple[float, float]
    length: FloatArray
    arm: FloatArray

    @property
    def middle(self) -> float:
        """The arm that speeds of the tendon are taken with."""
        return float(np.mean(self.arm))

    def ends(self, kinds: Sequence[str] = (POSITION, RATE)) -> dict[str, float]:
        """Parameters of the ends of curves over position, speed or both [SI]."""
        values = {
            POSITION: (float(self.length.min()), float(self.length.max())),
            RATE: sorted(self.middle * one for one in self.rates),
        }
        return {
            f"{self.muscle}:learned.{name}": value
            for kind in kinds
            for name, value in zip(_ENDS[kind], values[kind], strict=True)
        }


def places_of(rig: Rig, trials: Sequence[Trial]) -> list[Place]:
    """Each joint that moves freely, with a tendon that runs over it alone."""
    found: list[Place] = []
    for j, joint in enumerate(rig.joints):
        channel = rig.names.joint_channel(joint)
        seen = [trial for trial in trials if channel in trial.measured]
        if not seen:
            continue
        read = [smoothed(trial.time, trial.measured[channel]) for trial in seen]
        rates = [np.gradient(one, t.time) for one, t in zip(read, seen, strict=True)]
        at = np.linspace(*_between(read, _POSITIONS), _POINTS)
        poses = np.tile(rig.model.qpos0, (_POINTS, 1))
        poses[:, rig.position_addresses[j]] = at
        arms = moment_arms(rig, poses)  # (n, m, j)
        over = np.abs(arms).max(axis=0) > 0.0
        alone = [m for m, row in enumerate(over) if row[j] and np.count_nonzero(row) == 1]
        if alone:
            lengths = tendon_lengths(rig, poses)[:, alone[0]]
            found.append(
                Place(
                    joint=joint,
                    muscle=list(rig.muscles)[alone[0]],
                    at=at,
                    rates=_between(rates, _RATES),
                    length=lengths,
                    arm=arms[:, alone[0], j],
                )
            )
    return found


def _between(
    signals: Sequence[FloatArray], percentiles: tuple[float, float]
) -> tuple[float, float]:
    low, high = np.percentile(np.concatenate(signals), percentiles).tolist()
    return low, high


def curves_of(
    place: Place, kinds: Sequence[str], forces: Mapping[str, float], errors: SizeErrors
) -> Iterator[Curve]:
    """The learned curves of a joint as torques on it.

    They are sums of the control forces. A constant may lie in either curve. Where there are two,
    the one over speed is 0 at rest.
    """
    visited = {POSITION: place.at, RATE: np.linspace(*place.rates, _POINTS)}
    at_rest = _columns(place, RATE, np.zeros(1)) if len(kinds) == 2 else {}
    for kind in kinds:
        columns = _columns(place, kind, visited[kind])
        if kind == RATE:
            columns = {n: column - at_rest.get(n, 0.0) for n, column in columns.items()}
        else:
            columns |= {n: place.arm / place.middle * torque for n, torque in at_rest.items()}
        yield Curve(
            joint=place.joint,
            over=kind,
            at=visited[kind],
            torque=sum((forces[n] * column for n, column in columns.items()), np.zeros(_POINTS)),
            reach=errors.reach(columns),
        )


def _columns(place: Place, kind: str, at: FloatArray) -> dict[str, FloatArray]:
    """Control force -> torque (n,) of one newton of it at positions or speeds (n,)."""
    ends = {name.rpartition(".")[2]: end for name, end in place.ends((kind,)).items()}
    over_length = kind == POSITION
    lengths = np.interp(at, place.at, place.length) if over_length else np.zeros(at.size)
    speeds = np.zeros(at.size) if over_length else place.middle * at
    # A force against lengthening pulls the joint to where the tendon is shorter.
    arm = np.interp(at, place.at, place.arm) if over_length else place.middle
    found: dict[str, FloatArray] = {}
    for k in range(1, COUNT[kind] + 1):
        one = Learned(**ends, **{f"{FIELD[kind]}{k}": 1.0})
        force = [learned_force(one, *x) for x in zip(lengths, speeds, strict=True)]
        found[f"{place.muscle}:learned.{FIELD[kind]}{k}"] = -arm * np.array(force)
    return found
