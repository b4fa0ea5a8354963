"""Independent models between command and valves: sampled bus, two lags, smooth dead zone."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from pamsim.effects.catalog import effect
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_TICK_SHARE = 0.6
"""Period of the bus as a share of the mean delay: the delay varies by +-30 %."""

_ROUND = 0.35
"""Width of the smooth transition as a share of the dead zone."""


class SampledBus:
    """A bus that samples commands periodically and forwards them after a dead time.

    Args:
        delay: mean [s].
        phase: time of the first sample, in periods.
        before: commands before time 0, per muscle.
    """

    def __init__(self, delay: float, phase: float, before: list[float]) -> None:
        self._period = _TICK_SHARE * delay
        self._dead = delay - 0.5 * self._period
        self._next = phase * self._period
        self._coming: deque[tuple[float, list[float]]] = deque()
        self._received = before

    def received(self, time: float, sent: list[float]) -> list[float]:
        """Commands that reach the valves at a time [s], which must not decrease between calls."""
        slack = 1e-9
        while time >= self._next - slack:
            self._coming.append((self._next + self._dead, sent))
            self._next += self._period
        while self._coming and self._coming[0][0] <= time + slack:
            self._received = self._coming.popleft()[1]
        return self._received

    def __call__(self, plant: Plant) -> None:
        """Delay the commands."""
        if plant.settling:
            return
        received = self.received(plant.time, list(plant.command))
        for i in plant.muscles:
            plant.set_command(i, received[i])


class TwoLags:
    """Two equal first-order lags in series.

    Args:
        lag: sum of their time constants [s].
        before: outputs before time 0, per muscle.
    """

    def __init__(self, lag: float, before: list[float]) -> None:
        self._half = 0.5 * lag
        self._first, self._second = list(before), list(before)

    def output(self, commands: list[float], timestep: float) -> list[float]:
        """Outputs after a time step [s]."""
        share = -math.expm1(-timestep / self._half)
        for i, command in enumerate(commands):
            self._second[i] += share * (self._first[i] - self._second[i])
            self._first[i] += share * (command - self._first[i])
        return self._second

    def __call__(self, plant: Plant) -> None:
        """Delay the commands."""
        if plant.settling:
            return
        output = self.output(plant.command, plant.timestep)
        for i in plant.muscles:
            plant.set_command(i, output[i])


def smooth_dead_zone(opening: float, dead_zone: float) -> float:
    """Opening after a smooth dead zone; odd, 0 at 0 and 1 at 1.

    Args:
        opening: in [-1, 1].
        dead_zone: opening around which the flow starts, above 0.
    """
    width = _ROUND * dead_zone

    def soft(x: float) -> float:
        return width * math.log1p(math.exp((x - dead_zone) / width))

    none = soft(0.0)
    return math.copysign((soft(abs(opening)) - none) / (soft(1.0) - none), opening)


def _before(context: RunContext) -> list[float]:
    start = context.experiment.start_pressure.tolist()
    return start if context.experiment.command == "pressure" else [0.0] * len(start)


def _delay(size: float, context: RunContext) -> Law:
    rng = np.random.default_rng([context.seed, context.number, 3])
    mean = size * effect("valve_delay").parameters[0].typical
    return SampledBus(mean, float(rng.uniform()), _before(context))


def _lag(size: float, context: RunContext) -> Law:
    return TwoLags(size * effect("line_lag").parameters[0].typical, _before(context))


def _dead_zone(size: float, context: RunContext) -> Law:
    width = size * effect("valve_dead_zone").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.set_opening(i, smooth_dead_zone(plant.opening(i), width))

    return law


MODELS = (
    IndependentModel(
        name="valve_delay",
        formulation="a bus that samples the command, so that the delay varies by 30 %",
        law=_delay,
    ),
    IndependentModel(
        name="line_lag",
        formulation="two equal lags in series",
        law=_lag,
    ),
    IndependentModel(
        name="valve_dead_zone",
        formulation="a dead zone of the valves with a gradual transition",
        law=_dead_zone,
    ),
)
"""Independent models of the command effects."""
