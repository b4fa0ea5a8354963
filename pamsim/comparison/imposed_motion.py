"""Inputs of a rig whose joints are moved by a machine: a tensile machine, a dynamometer."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.protocols import DURATION, RATE, share_of_supply
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.excitation import held_levels, triangle
from pamsim.recordings.experiment import Experiment

Input = Callable[[FloatArray, np.random.Generator], FloatArray]

_ROUNDED = 0.1  # time over which corners of a motion are rounded [s]
_LOW, _HIGH = 0.35, 0.88
"""Part of a joint's range that is moved over; at its upper end a muscle pulls."""

DRIVES_OF_MOTION = {"angle": "angle", "position": "length"}
"""Kind of a joint's position -> drive that imposes it."""


@dataclass(frozen=True, kw_only=True)
class ImposedMotion:
    """An input of set points for all muscles, and of positions for all joints.

    Attributes:
        name: as in recordings.
        shows: what it is for.
        pressure: times (n,) [s] and random numbers to set points (n,) [Pa] of a supply of 5 bar;
            they are lower in proportion where a rig's is.
        motion: to positions (n,), -1 and 1 at the ends of the part of the range that is used.
        command: drive of all muscles.
        load: mass on the arm [kg].
    """

    name: str
    shows: str
    pressure: Input
    motion: Input
    command: str = "pressure_set"
    load: float = 0.0

    def experiment(self, rig: Rig, seed: int = 0, duration: float | None = None) -> Experiment:
        """The experiment on a rig; the same seed gives the same one.

        Args:
            rig: whose recorded joints have ranges.
            seed: of its random levels, periods and signs.
            duration: [s]; `pamsim.comparison.protocols.DURATION` if left out.

        Raises:
            InputError: if a joint has no range.
        """
        duration = DURATION if duration is None else duration
        time = np.arange(round(duration * RATE) + 1) / RATE
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        lower = share_of_supply(rig.supply_pressure)
        pressures = [lower * self.pressure(time, rng) for _ in rig.muscles]
        shares = [_rounded(self.motion(time, rng)) for _ in rig.joints]
        ranges = [_range(rig, joint) for joint in rig.joints]
        moved = [
            low + 0.5 * (share + 1.0) * (high - low)
            for share, (low, high) in zip(shares, ranges, strict=True)
        ]
        start = np.array([pressure[0] for pressure in pressures])
        return Experiment(
            drive={
                **dict.fromkeys(rig.muscles, self.command),
                **{joint: DRIVES_OF_MOTION[kind] for joint, kind in rig.joints.items()},
            },
            command_time=time,
            command_value=np.column_stack([*pressures, *moved]),
            start_pressure=start,
            duration=duration,
            sample_rate=RATE,
            load=self.load,
            name=self.name,
        )


def _range(rig: Rig, joint: str) -> tuple[float, float]:
    index = rig.model.joint(joint).id
    if not rig.model.jnt_limited[index]:
        raise InputError(
            f"rig {rig.name!r}: joint {joint!r} has no range, within which it could be moved; state"
            " one in the MJCF"
        )
    low, high = rig.model.jnt_range[index].tolist()
    return low + _LOW * (high - low), low + _HIGH * (high - low)


def _rounded(shape: FloatArray) -> FloatArray:
    """A motion without corners, which no machine makes."""
    half = round(0.5 * _ROUNDED * RATE)
    window = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(shape, half, mode="edge")
    smooth: FloatArray = np.convolve(padded, window / window.sum(), mode="valid").astype(np.float64)
    return smooth


def _levels(middle: float, half: float, hold: float) -> Input:
    return lambda time, rng: middle + half * held_levels(time, hold, 4, rng)


def _triangles(middle: float, half: float, shrink: float) -> Input:
    def drawn(time: FloatArray, rng: np.random.Generator) -> FloatArray:
        period, sign = rng.uniform(1.2, 1.8), rng.choice([-1.0, 1.0])
        return middle + half * sign * triangle(time, period, shrink)

    return drawn


def _one_level(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.full(time.size, rng.uniform(-0.4, 0.6))


IMPOSED_MOTIONS: dict[str, ImposedMotion] = {
    one.name: one
    for one in (
        ImposedMotion(
            name="stretch",
            shows="hysteresis and friction: loops of length at held pressures",
            pressure=_levels(2.5e5, 1.5e5, 1.5),
            motion=_triangles(0.0, 1.0, 0.8),
        ),
        ImposedMotion(
            name="isometric",
            shows="what pressure does to the force at a length that is held",
            pressure=_triangles(2.3e5, 1.8e5, 0.8),
            motion=_one_level,
        ),
        ImposedMotion(
            name="relaxation",
            shows="creep and leaks: lengths held at a held pressure",
            pressure=_levels(2.5e5, 1.2e5, 4.0),
            motion=_levels(0.0, 0.9, 1.0),
        ),
    )
}
"""Name -> input."""
