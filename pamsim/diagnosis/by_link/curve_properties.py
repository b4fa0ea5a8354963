"""What a learned curve obeys within its band."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.curve_places import Curve, Kind


def properties(curve: Curve) -> tuple[str, ...]:
    """What a curve obeys within its band.

    Over speed it may be ``passive``: it brakes somewhere and drives nowhere for certain; and
    ``odd``: as large in both directions. Over position it may be ``restoring``: it falls somewhere
    and grows nowhere for certain. No torque over position takes or gives work in a closed cycle,
    nor does a moment arm or a curve over the contraction: what a muscle gives with pressure, its
    air has done. A dry friction is passive if it is somewhere above zero for certain and nowhere
    below.
    """
    at, torque, reach = curve.at, curve.value, curve.reach
    if curve.kind is Kind.FRICTION:
        return ("passive",) if _only_below(-torque, reach) else ()
    if curve.kind not in (Kind.POSITION, Kind.RATE):
        return ()
    if curve.kind is Kind.POSITION:
        rise, error = torque - torque[:, np.newaxis], reach + reach[:, np.newaxis]
        later = np.triu_indices(at.size, 1)
        return ("restoring",) if _only_below(rise[later], error[later]) else ()
    found = ("passive",) if _only_below(torque * np.sign(at), reach) else ()
    both = np.abs(at) <= min(-at[0], at[-1])
    mirrored, error = np.interp(-at[both], at, torque), np.interp(-at[both], at, reach)
    odd = both.any() and np.all(np.abs(torque[both] + mirrored) <= reach[both] + error)
    return (*found, "odd") if odd else found


def _only_below(values: FloatArray, error: FloatArray) -> bool:
    """Whether some values are below zero for certain, and none above."""
    return bool(np.any(values < -error) and np.all(values <= error))
