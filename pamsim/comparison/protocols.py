"""Safe inputs that show what a rig's model is missing.

Of antagonistic muscles, and of a rig whose joints are moved by a machine: a tensile machine, a
dynamometer.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError, refuse_unknown
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.excitation import bursts, held_levels, multisine, triangle
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.signals import MOTIONS

Drive = Callable[[FloatArray, np.random.Generator], FloatArray]

DURATION = 8.0
"""Length of a trial [s]."""

RATE = 100.0
"""Sampling rate of a trial [Hz]."""

MULTISINE_PERIOD = 4.0
"""Period of the multisines' fundamental [s]; two fit into a trial."""

MULTISINE_LINES = 12  # odd harmonics, up to 5.75 Hz

_MIDDLE = 2.5e5  # common pressure about which trials move [Pa]
_SUPPLY = 5e5  # gauge pressure that no set point reaches [Pa]
_ROUNDED = 0.1  # time over which corners of an imposed motion are rounded [s]
_LOW, _HIGH = 0.35, 0.88
"""Part of a joint's range that is moved over; at its upper end a muscle pulls."""


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """An input for antagonistic muscles, in pairs.

    Attributes:
        name: as in recordings.
        shows: what it is for.
        command: drive of all muscles, ``pressure_set`` or ``valve``.
        drive: times (n,) [s] and random numbers to commands (n, 2) of a pair [Pa or -].
        load: mass on the arm [kg].
    """

    name: str
    shows: str
    command: str
    drive: Drive
    load: float = 0.0

    def experiment(
        self,
        seed: int = 0,
        duration: float | None = None,
        *,
        muscles: int = 2,
        supply: float = _SUPPLY,
    ) -> Experiment:
        """The experiment; the same seed gives the same one.

        Args:
            seed: of its random levels, periods, phases and signs.
            duration: [s]; `DURATION` if left out.
            muscles: of the rig. The first two are a pair, the next two another one, and so on;
                each pair has its own random numbers.
            supply: gauge pressure of the rig's supply [Pa]. Below 5 bar all pressures are lower in
                proportion.
        """
        share = _share_of_supply(supply)
        duration = DURATION if duration is None else duration
        time = np.arange(round(duration * RATE)) / RATE
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        pairs = [self.drive(time, rng) for _ in range(0, muscles, 2)]
        command = np.hstack(pairs)[:, :muscles]
        start = np.full(muscles, share * _MIDDLE)
        if self.command == "pressure_set":
            command = share * command
            start = command[0]
        return Experiment(
            drive=self.command,
            command_time=time,
            command_value=command,
            start_pressure=start,
            duration=duration,
            sample_rate=RATE,
            load=self.load,
            name=self.name,
        )


def _share_of_supply(supply: float) -> float:
    """Share of the library's pressures that a rig gets, by its supply's gauge pressure [Pa]."""
    return min(supply / _SUPPLY, 1.0)


def _apart(difference: FloatArray, common: float | FloatArray = _MIDDLE) -> FloatArray:
    """Set points (n, 2) of a common pressure and half a difference [Pa]."""
    return np.stack([common + difference, common - difference], axis=1)


def _triangle(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    period, shrink = rng.uniform(2.8, 4.4), rng.uniform(0.5, 0.75)
    half = rng.choice([-1.0, 1.0]) * rng.uniform(1.2e5, 1.8e5)
    return _apart(half * triangle(time, period, shrink))


def _staircase(hold: float, half: float, levels: int) -> Drive:
    return lambda time, rng: _apart(half * held_levels(time, hold, levels, rng))


def _multisine(half: float) -> Drive:
    return lambda time, rng: _apart(half * multisine(time, MULTISINE_PERIOD, MULTISINE_LINES, rng))


def _cocontraction(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    # The lowest set point stays above the atmosphere and the highest far below the supply.
    period, swing = rng.uniform(2.8, 4.4), rng.uniform(1.4e5, 1.9e5)
    half = rng.choice([-1.0, 1.0]) * rng.uniform(2e4, 4e4)
    common = _MIDDLE - swing * np.cos(2.0 * np.pi * time / period)
    side = np.where(np.mod(time, 2.0 * period) < period, 1.0, -1.0)
    return _apart(half * side, common)


def _bursts(spacing: float) -> Drive:
    return lambda time, rng: np.stack(
        [bursts(time, spacing, 0.05, 0.2, rng), bursts(time, spacing, 0.05, 0.2, rng)], axis=1
    )


PROTOCOLS: dict[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        Protocol(
            name="triangle",
            shows="hysteresis, friction, backlash: slow loops with minor loops inside",
            command="pressure_set",
            drive=_triangle,
        ),
        Protocol(
            name="staircase",
            shows="creep and leaks in holds, angles at rest over the whole range",
            command="pressure_set",
            drive=_staircase(1.6, 1.8e5, 6),
        ),
        Protocol(
            name="multisine",
            shows="linear dynamics apart from even and odd distortion",
            command="pressure_set",
            drive=_multisine(1.6e5),
        ),
        Protocol(
            name="cocontraction",
            shows="what grows with the common pressure: stiffness, threshold, mismatch",
            command="pressure_set",
            drive=_cocontraction,
        ),
        Protocol(
            name="bursts",
            shows="valves, delays, and shut chambers between",
            command="valve",
            drive=_bursts(0.8),
        ),
        Protocol(
            name="loaded_steps",
            shows="load, inertia and friction: small steps with a mass on the arm",
            command="pressure_set",
            drive=_staircase(1.0, 4e4, 5),
            load=1.2,
        ),
    )
}
"""Name -> protocol."""


def protocol(name: str) -> Protocol:
    """Look a protocol up.

    Raises:
        InputError: if there is none of that name, with the nearest.
    """
    refuse_unknown(name, PROTOCOLS, f"no protocol {name!r}")
    return PROTOCOLS[name]


@dataclass(frozen=True, kw_only=True)
class ImposedMotion:
    """An input of set points for all muscles, and of positions for all joints."""

    name: str  # as in recordings
    shows: str  # what it is for
    # Times (n,) [s] and random numbers to set points (n,) [Pa] of a supply of 5 bar; they are lower
    # in proportion where a rig's is
    pressure: Drive
    motion: Drive  # to positions (n,), -1 and 1 at the ends of the part of the range that is used
    command: str = "pressure_set"  # drive of all muscles
    load: float = 0.0  # mass on the arm [kg]

    def experiment(self, rig: Rig, seed: int = 0, duration: float | None = None) -> Experiment:
        """The experiment on a rig; the same seed gives the same one.

        Args:
            rig: whose recorded joints have ranges.
            seed: of its random levels, periods and signs.
            duration: [s]; `DURATION` if left out.

        Raises:
            InputError: if a joint has no range.
        """
        duration = DURATION if duration is None else duration
        time = np.arange(round(duration * RATE) + 1) / RATE
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        lower = _share_of_supply(rig.supply_pressure)
        pressures = [lower * self.pressure(time, rng) for _ in rig.muscles]
        shares = [_without_corners(self.motion(time, rng)) for _ in rig.joints]
        ranges = [_range(rig, joint) for joint in rig.joints]
        moved = [
            low + 0.5 * (share + 1.0) * (high - low)
            for share, (low, high) in zip(shares, ranges, strict=True)
        ]
        start = np.array([pressure[0] for pressure in pressures])
        return Experiment(
            drive={
                **dict.fromkeys(rig.muscles, self.command),
                **{joint: MOTIONS[kind] for joint, kind in rig.joints.items()},
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


def _without_corners(shape: FloatArray) -> FloatArray:
    """A motion without corners, which no machine makes."""
    half = round(0.5 * _ROUNDED * RATE)
    window = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(shape, half, mode="edge")
    smooth: FloatArray = np.convolve(padded, window / window.sum(), mode="valid").astype(np.float64)
    return smooth


def _about_levels(middle: float, half: float, hold: float) -> Drive:
    return lambda time, rng: middle + half * held_levels(time, hold, 4, rng)


def _triangles(middle: float, half: float, shrink: float) -> Drive:
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
            pressure=_about_levels(2.5e5, 1.5e5, 1.5),
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
            pressure=_about_levels(2.5e5, 1.2e5, 4.0),
            motion=_about_levels(0.0, 0.9, 1.0),
        ),
    )
}
"""Name -> input."""
