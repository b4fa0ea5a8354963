"""Safe inputs of a rig of antagonistic muscles that show what its model is missing."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.recordings.excitation import bursts, held_levels, multisine, triangle
from pamsim.recordings.experiment import Experiment

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
        share = share_of_supply(supply)
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


def share_of_supply(supply: float) -> float:
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
    if name not in PROTOCOLS:
        raise InputError(f"no protocol {name!r}; {nearest(name, PROTOCOLS)}")
    return PROTOCOLS[name]
