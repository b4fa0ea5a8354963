"""Torques on a joint as forces along a tendon that runs over it alone: their ends and curves."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.link_inputs import smoothed
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.learned_curve import POINTS, Curve, Kind
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.engine.equilibrium import moment_arms, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.learned import LENGTH, SPEED, learns
from pamsim.physics.spline import shares
from pamsim.recordings.trial import Trial

_RATES = (0.2, 99.8)
"""Percentiles of rates between which a curve is spread: those of read positions have outliers."""

_FIELD, _COUNT = (
    {Kind.POSITION: "force_", Kind.RATE: "drag_"},
    {Kind.POSITION: LENGTH, Kind.RATE: SPEED},
)
"""Beginning of the names of a curve's control forces, and how many there are."""

_ENDS = {Kind.POSITION: ("low", "high"), Kind.RATE: ("slowest", "fastest")}


@dataclass(frozen=True)
class JointPlace:
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

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends of curves over position, speed or both [SI]."""
        values = {
            Kind.POSITION: (float(self.length.min()), float(self.length.max())),
            Kind.RATE: sorted(self.middle * one for one in self.rates),
        }
        return {
            f"{self.muscle}:learned.{name}": value
            for kind in values
            if kind in kinds
            for name, value in zip(_ENDS[kind], values[kind], strict=True)
        }

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control forces of a curve."""
        count = _COUNT.get(kind, 0)
        return [f"{self.muscle}:learned.{_FIELD[kind]}{k}" for k in range(1, count + 1)]

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """The learned curves as torques on the joint.

        They are sums of the control forces. A constant may lie in either curve. Where there are
        two, the one over speed is 0 at rest.
        """
        own = [kind for kind in kinds if kind in _FIELD]
        visited = {Kind.POSITION: self.at, Kind.RATE: np.linspace(*self.rates, POINTS)}
        at_rest = self._columns(Kind.RATE, np.zeros(1)) if len(own) == 2 else {}
        for kind in own:
            columns = self._columns(kind, visited[kind])
            if kind is Kind.RATE:
                columns = {n: column - at_rest.get(n, 0.0) for n, column in columns.items()}
            else:
                columns |= {n: self.arm / self.middle * torque for n, torque in at_rest.items()}
            yield Curve(
                kind=kind,
                acts_at=self.joint,
                at=visited[kind],
                value=sum((values[n] * column for n, column in columns.items()), np.zeros(POINTS)),
                reach=errors.reach(columns),
            )

    def _columns(self, kind: Kind, at: FloatArray) -> dict[str, FloatArray]:
        """Control force -> torque (n,) of one newton of it at positions or speeds (n,)."""
        along = np.interp(at, self.at, self.length) if kind is Kind.POSITION else self.middle * at
        # A force against lengthening pulls the joint to where the tendon is shorter.
        arm = np.interp(at, self.at, self.arm) if kind is Kind.POSITION else self.middle
        low, high = self.ends((kind,)).values()
        of_each = shares(along, low, high, _COUNT[kind])
        return dict(zip(self.controls(kind), (-arm * of_each.T), strict=True))


def joint_places(rig: Rig, trials: Sequence[Trial]) -> list[JointPlace]:
    """Each joint that moves freely, with a tendon over it alone that has no curve yet."""
    found: list[JointPlace] = []
    muscles = list(rig.muscles.values())
    for j, joint in enumerate(rig.joints):
        channel = rig.names.joint_channel(joint)
        seen = [trial for trial in trials if channel in trial.measured]
        if not seen:
            continue
        read = smoothed_readings(seen, channel)
        rates = [np.gradient(one, t.time) for one, t in zip(read, seen, strict=True)]
        at = np.linspace(*between(read), POINTS)
        poses = np.tile(rig.model.qpos0, (POINTS, 1))
        poses[:, rig.position_addresses[j]] = at
        arms = moment_arms(rig, poses)  # (n, m, j)
        over = np.abs(arms).max(axis=0) > 0.0
        alone = [
            m
            for m, (row, muscle) in enumerate(zip(over, muscles, strict=True))
            if row[j] and np.count_nonzero(row) == 1 and not learns(muscle.learned)
        ]
        if alone:
            lengths = tendon_lengths(rig, poses)[:, alone[0]]
            found.append(
                JointPlace(
                    joint=joint,
                    muscle=list(rig.muscles)[alone[0]],
                    at=at,
                    rates=between(rates, _RATES),
                    length=lengths,
                    arm=arms[:, alone[0], j],
                )
            )
    return found


def smoothed_readings(trials: Sequence[Trial], channel: str) -> list[FloatArray]:
    """Smoothed signals of a channel that every trial has."""
    return [smoothed(trial.time, trial.measured[channel]) for trial in trials]


def between(
    signals: Sequence[FloatArray], percentiles: tuple[float, float] = (0.0, 100.0)
) -> tuple[float, float]:
    """Percentiles of some signals together, their least and largest values if left out."""
    low, high = np.percentile(np.concatenate(signals), percentiles).tolist()
    return low, high
