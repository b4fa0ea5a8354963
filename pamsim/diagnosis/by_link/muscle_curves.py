"""Tensions of all muscles over their contraction: between which contractions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.comparison.link_inputs import link_inputs
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.even_curves import EvenPlace
from pamsim.diagnosis.by_link.learned_curve import MUSCLES, Kind
from pamsim.engine.equilibrium import tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.learned_tension import CONTROLS, LearnedTension, learns_tension
from pamsim.recordings.trial import Trial

_GROUP = LearnedTension.group
_FIELDS = {Kind.PRESSED: f"{_GROUP}.area_", Kind.UNPRESSED: f"{_GROUP}.pull_"}

_SEEN = 40  # rows of a trial whose contractions show the range that was visited


def muscle_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The muscles of a rig; None if one pushes or has a curve, or no trial has all positions.

    See `pamsim.physics.learned_tension` for which contractions their curves run over.
    """
    if any(one.pushes or learns_tension(one.learned_tension) for one in rig.muscles.values()):
        return None
    found = contractions(rig, trials)
    low = min((float(one.min()) for one in found), default=0.0)
    high = max((float(one.max()) for one in found), default=0.0)
    if not high > low:
        return None
    return EvenPlace(
        acts_at=MUSCLES,
        ends_at=f"{_GROUP}.",
        low=low,
        high=high,
        fields=_FIELDS,
        count=CONTROLS,
    )


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
