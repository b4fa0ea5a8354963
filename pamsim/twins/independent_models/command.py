"""What lies between command and valves, formulated otherwise."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from pamsim.effects.catalog import effect
from pamsim.twins.independent_models.independent_model import Law, Truth
from pamsim.twins.independent_models.plant import Occasion, Plant

_TICK_SHARE = 0.6
"""Period of the bus, of the mean delay: the delay varies by 30 % up and down."""

_ROUND = 0.35
"""Width over which the smooth dead zone gives way, of the dead zone."""


class SampledBus:
    """A bus that takes commands up at its ticks and hands them on after a dead time.

    Args:
        delay: in the mean [s].
        phase: time of the first tick, in periods.
        before: what it carries before time 0, per muscle.
    """

    def __init__(self, delay: float, phase: float, before: list[float]) -> None:
        self._period = _TICK_SHARE * delay
        self._dead = delay - 0.5 * self._period
        self._next = phase * self._period
        self._coming: deque[tuple[float, list[float]]] = deque()
        self._heard = before

    def heard(self, time: float, told: list[float]) -> list[float]:
        """What the valves hear at a time [s] that does not decrease from call to call."""
        slack = 1e-9
        while time >= self._next - slack:
            self._coming.append((self._next + self._dead, told))
            self._next += self._period
        while self._coming and self._coming[0][0] <= time + slack:
            self._heard = self._coming.popleft()[1]
        return self._heard

    def __call__(self, plant: Plant) -> None:
        """Tell the muscles late."""
        if plant.resting:
            return
        heard = self.heard(plant.time, list(plant.command))
        for i in plant.muscles:
            plant.tell(i, heard[i])


class TwoLags:
    """Two equal first-order lags in series.

    Args:
        lag: sum of their time constants [s].
        before: what they carry before time 0, per muscle.
    """

    def __init__(self, lag: float, before: list[float]) -> None:
        self._half = 0.5 * lag
        self._first, self._second = list(before), list(before)

    def carried(self, told: list[float], timestep: float) -> list[float]:
        """What arrives after a time step [s]."""
        share = -math.expm1(-timestep / self._half)
        for i, command in enumerate(told):
            self._second[i] += share * (self._first[i] - self._second[i])
            self._first[i] += share * (command - self._first[i])
        return self._second

    def __call__(self, plant: Plant) -> None:
        """Tell the muscles late."""
        if plant.resting:
            return
        carried = self.carried(plant.command, plant.timestep)
        for i in plant.muscles:
            plant.tell(i, carried[i])


def smooth_dead_zone(opening: float, dead_zone: float) -> float:
    """Opening behind an overlap that gives way gradually; odd, 0 at 0 and 1 at 1.

    Args:
        opening: in [-1, 1].
        dead_zone: opening about which the flow sets in, above 0.
    """
    width = _ROUND * dead_zone

    def soft(x: float) -> float:
        return width * math.log1p(math.exp((x - dead_zone) / width))

    none = soft(0.0)
    return math.copysign((soft(abs(opening)) - none) / (soft(1.0) - none), opening)


def _before(occasion: Occasion) -> list[float]:
    start = occasion.experiment.start_pressure.tolist()
    return start if occasion.experiment.command == "pressure" else [0.0] * len(start)


def _delay(size: float, occasion: Occasion) -> Law:
    rng = np.random.default_rng([occasion.seed, occasion.number, 3])
    mean = size * effect("valve_delay").parameters[0].typical
    return SampledBus(mean, float(rng.uniform()), _before(occasion))


def _lag(size: float, occasion: Occasion) -> Law:
    return TwoLags(size * effect("line_lag").parameters[0].typical, _before(occasion))


def _dead_zone(size: float, occasion: Occasion) -> Law:
    width = size * effect("valve_dead_zone").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.open(i, smooth_dead_zone(plant.opening(i), width))

    return law


TRUTHS = (
    Truth(
        name="valve_delay",
        formulation="a bus that samples the command, so that the delay varies by 30 %",
        law=_delay,
    ),
    Truth(
        name="line_lag",
        formulation="two equal lags in series",
        law=_lag,
    ),
    Truth(
        name="valve_dead_zone",
        formulation="an overlap of the valves that gives way gradually",
        law=_dead_zone,
    ),
)
"""Truths between command and valves."""
