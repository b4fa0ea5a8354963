"""Tensions of all muscles over their contraction: their ends and curves."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.link_inputs import link_inputs
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.learned_curve import MUSCLES, POINTS, Curve, Kind
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.engine.equilibrium import tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.learned_tension import (
    CONTROLS,
    LearnedTension,
    learned_area,
    learned_pull,
    learns_tension,
)
from pamsim.recordings.trial import Trial

_FIELD = {Kind.PRESSED: "area_", Kind.UNPRESSED: "pull_"}
"""Beginning of the names of a curve's control values."""

_SMALL = 1e-3  # a control value that is in range [m^2 or N]; curves are proportional to it
_SEEN = 40  # rows of a trial whose contractions show the range that was visited


@dataclass(frozen=True)
class MusclePlace:
    """The muscles of a rig, and between which contractions they were [-].

    See `pamsim.physics.learned_tension` for which contraction that is.
    """

    low: float
    high: float

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends that both curves share [-]."""
        if not set(kinds) & _FIELD.keys():
            return {}
        return {"learned_tension.low": self.low, "learned_tension.high": self.high}

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control values of a curve."""
        if kind not in _FIELD:
            return ()
        return [f"learned_tension.{_FIELD[kind]}{k}" for k in range(1, CONTROLS + 1)]

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """The learned curves as sums of their control values."""
        at = np.linspace(self.low, self.high, POINTS)
        for kind in (one for one in kinds if one in _FIELD):
            curve = learned_area if kind is Kind.PRESSED else learned_pull
            columns: dict[str, FloatArray] = {}
            for name in self.controls(kind):
                field = name.rpartition(".")[2]
                one = LearnedTension(low=self.low, high=self.high, **{field: _SMALL})
                column = [curve(one, kappa) / _SMALL for kappa in at.tolist()]
                columns[name] = np.array(column)
            yield Curve(
                kind=kind,
                acts_at=MUSCLES,
                at=at,
                value=sum((values[n] * column for n, column in columns.items()), np.zeros(POINTS)),
                reach=errors.reach(columns),
            )


def muscle_place(rig: Rig, trials: Sequence[Trial]) -> MusclePlace | None:
    """The muscles of a rig; None if one pushes or has a curve, or no trial has all positions."""
    if any(one.pushes or learns_tension(one.learned_tension) for one in rig.muscles.values()):
        return None
    found = contractions(rig, trials)
    low = min((float(one.min()) for one in found), default=0.0)
    high = max((float(one.max()) for one in found), default=0.0)
    return MusclePlace(low, high) if high > low else None


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
