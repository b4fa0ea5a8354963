"""What an observation holds: names, units and scales of its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.envs.reach import Reach

FloatArray = NDArray[np.float64]

LIMIT = 10.0
"""Observations are clipped to +-LIMIT; those of a rig that works stay far inside."""

_PACE = math.pi
"""Of a reference of 0.5 Hz: scales rates and accelerations [rad/s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservedSignals:
    """Names and scales of the numbers of an observation: each is (signal - centre) / scale.

    Attributes:
        names: such as ``elbow.angle``, ``biceps.pressure`` or ``elbow.angle_set``.
        units: of the signals, SI.
        centre: (n,) signal that is observed as 0.
        scale: (n,) change of the signal that is observed as 1.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    centre: FloatArray
    scale: FloatArray

    def si(self, observation: ArrayLike) -> FloatArray:
        """Signals (..., n) [SI] of observations."""
        return np.asarray(observation) * self.scale + self.centre

    def named(self, observation: ArrayLike) -> dict[str, float]:
        """Signals [SI] of one observation by name."""
        return dict(zip(self.names, self.si(observation).tolist(), strict=True))


def observed_signals(
    joints: Mapping[str, str], muscles: Iterable[str], reaches: Sequence[Reach], supply: float
) -> ObservedSignals:
    """Signals of a rig, in the order of observations.

    Args:
        joints: name -> ``angle`` or ``position``.
        muscles: names.
        reaches: of the joints.
        supply: pressure [Pa].
    """
    rows: list[tuple[str, str, float, float]] = []

    def add_joints(quantity: str, unit: str, power: int, suffix: str = "") -> None:
        for (name, kind), reach in zip(joints.items(), reaches, strict=True):
            length = "rad" if kind == "angle" else "m"
            centre = reach.centre if power == 0 else 0.0
            scale = reach.travel * _PACE**power
            what = (kind if power == 0 else quantity) + suffix
            rows.append((f"{name}.{what}", length + unit, centre, scale))

    add_joints("angle", "", 0)
    add_joints("velocity", "/s", 1)
    rows += [(f"{name}.pressure", "Pa", 0.5 * supply, 0.5 * supply) for name in muscles]
    add_joints("angle", "", 0, "_set")
    add_joints("velocity", "/s", 1, "_set")
    add_joints("acceleration", "/s^2", 2, "_set")
    for (name, kind), reach in zip(joints.items(), reaches, strict=True):
        unit = "N m/rad" if kind == "angle" else "N/m"
        rows.append((f"{name}.stiffness_set", unit, 0.0, reach.stiffness[1]))
    names, units, centre, scale = zip(*rows, strict=True)
    return ObservedSignals(names=names, units=units, centre=np.array(centre), scale=np.array(scale))
