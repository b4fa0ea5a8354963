"""Inputs of the independent plant's recordings, none of them on the menu of a diagnosis.

A set point is a common pressure, plus or minus half a difference by the side on which a muscle
pulls, both as shares of the supply pressure, so that the inputs suit any rig.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.recordings.experiment import Experiment
from tests.plant.read_rig import Numbers

RATE = 100.0
"""Sampling rate of a trial [Hz]."""

DURATION = 8.0
"""Length of a trial [s]."""

_MIDDLE = 0.42

Drive = Callable[[FloatArray, np.random.Generator, FloatArray], FloatArray]
"""Times (n,) [s], random numbers and sides (m,) to commands (n, m): shares of supply, openings."""


@dataclass(frozen=True)
class Input:
    """An input of a rig with any number of muscles, and the load of its arm, if it takes one [kg].

    Its command is of pressures or of valves.
    """

    name: str
    command: str
    drive: Drive
    load: float = 0.0

    def experiment(
        self, numbers: Numbers, seed: int, duration: float | None = None, *, loads: bool = True
    ) -> Experiment:
        """The experiment on a plant that may carry loads; the same seed gives the same one."""
        duration = DURATION if duration is None else duration
        time = np.arange(round(duration * RATE)) / RATE
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        arms = np.asarray(numbers.muscles["arm"])
        supply = float(np.min(numbers.muscles["supply"]))
        command = self.drive(time, rng, -np.sign(arms))
        start = np.full(arms.size, _MIDDLE * supply)
        if self.command == "pressure_set":
            command = supply * np.clip(command, 0.0, 0.9)
            start = command[0]
        return Experiment(
            drive=self.command,
            command_time=time,
            command_value=command,
            start_pressure=start,
            duration=duration,
            sample_rate=RATE,
            load=self.load if loads else 0.0,
            name=self.name,
        )


def _sides(common: FloatArray, half: FloatArray, sides: FloatArray) -> FloatArray:
    return common[:, None] + half[:, None] * sides


def _held(
    time: FloatArray, rng: np.random.Generator, size: float, short: float, long: float
) -> FloatArray:
    """Random levels in [-size, size] held for random times between two lengths [s]."""
    count = int(time[-1] / short) + 2
    ends = np.cumsum(np.exp(rng.uniform(np.log(short), np.log(long), count)))
    return rng.uniform(-size, size, count)[np.searchsorted(ends, time, side="right")]


def _levels(half: float, common: float) -> Drive:
    """Steps of many sizes: random levels, held for random times."""

    def drive(time: FloatArray, rng: np.random.Generator, sides: FloatArray) -> FloatArray:
        middle = _MIDDLE + _held(time, rng, common, 1.0, 2.5)
        return _sides(middle, _held(time, rng, half, 0.35, 1.6), sides)

    return drive


def _chirp(time: FloatArray, rng: np.random.Generator, sides: FloatArray) -> FloatArray:
    """A sine that becomes faster."""
    first, last = rng.uniform(0.15, 0.3), rng.uniform(1.8, 2.8)
    growth = np.log(last / first) / time[-1]
    phase = 2.0 * np.pi * first / growth * (np.exp(growth * time) - 1.0)
    half = rng.choice([-1.0, 1.0]) * rng.uniform(0.14, 0.22) * np.sin(phase)
    return _sides(np.full(time.size, _MIDDLE + rng.uniform(-0.08, 0.08)), half, sides)


def _tones(time: FloatArray, rng: np.random.Generator, sides: FloatArray) -> FloatArray:
    """Sums of tones: three of the common pressure, seven of the difference."""

    def sum_of_tones(low: float, high: float, count: int, size: float) -> FloatArray:
        tones = np.geomspace(low, high, count) * rng.uniform(0.9, 1.1, count)
        waves = np.sin(2.0 * np.pi * np.outer(time, tones) + rng.uniform(0, 2 * np.pi, count))
        total = waves @ tones**-0.4
        return size * total / np.abs(total).max()

    common = _MIDDLE + sum_of_tones(0.1, 0.6, 3, 0.12)
    return _sides(common, sum_of_tones(0.17, 3.1, 7, 0.24), sides)


def _ramps(time: FloatArray, rng: np.random.Generator, sides: FloatArray) -> FloatArray:
    """Ramps of random rates to random levels, with pauses; reversals at every size."""
    at, level, corners = 0.0, 0.0, [(0.0, 0.0)]
    while at < time[-1]:
        pause, move = rng.uniform(0.0, 0.5), rng.uniform(0.3, 1.5)
        target = rng.uniform(-0.27, 0.27)
        corners += [(at + pause, level), (at + pause + move, target)]
        at, level = at + pause + move, target
    when, where = np.array(corners).T
    common = _MIDDLE + rng.uniform(-0.12, 0.12)
    return _sides(np.full(time.size, common), np.interp(time, when, where), sides)


def _pulses(time: FloatArray, rng: np.random.Generator, sides: FloatArray) -> FloatArray:
    """Partial and full openings, each followed by its opposite after a hold."""
    out = np.zeros((time.size, sides.size))
    for column in out.T:
        at = rng.uniform(0.1, 0.4)
        while at < time[-1]:
            length, opening = rng.uniform(0.06, 0.3), rng.uniform(0.3, 1.0)
            sign = rng.choice([-1.0, 1.0])
            for turn in (sign, -sign):
                column[(time >= at) & (time < at + length)] = turn * opening
                at += length + rng.uniform(0.2, 0.7)
    return out


INPUTS = {
    one.name: one
    for one in (
        Input("levels", "pressure_set", _levels(0.28, 0.12)),
        Input("ramps", "pressure_set", _ramps),
        Input("tones", "pressure_set", _tones),
        Input("chirp", "pressure_set", _chirp),
        Input("pulses", "valve", _pulses),
        Input("loaded_levels", "pressure_set", _levels(0.07, 0.08), load=0.9),
    )
}
"""Name -> input."""
