"""What is drawn at reset for a whole episode: arm, task, disturbance, noise.

An episode is a function of this draw and of the actions alone, so that single and vector
environments with the same seeds have the same episodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.envs.randomisation import random_parameters
from pamsim.envs.reach import Reach
from pamsim.envs.settings import ArmSettings
from pamsim.envs.tasks import TASKS

FloatArray = NDArray[np.float64]

ANGLE, RATE, ACCELERATION, STIFFNESS, TORQUE, NOISE = range(6)
"""Columns of an episode's table; the noise is of the angle and of both pressures."""

COLUMNS = NOISE + 3


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One episode.

    Attributes:
        values: parameters of the arm that differ from the rig's [SI].
        load: [kg].
        table: (samples + 1, COLUMNS). Row k holds the reference at the end of step k and the torque
            during it, in SI, and the noise of the readings before it, in standard deviations.
    """

    values: dict[str, float]
    load: float
    table: FloatArray


class Episodes:
    """Draws the episodes of an environment.

    Args:
        settings: of it.
        rig: its arm.
        reach: what that can do.
        period: between samples [s].
    """

    def __init__(self, settings: ArmSettings, rig: Rig, reach: Reach, period: float) -> None:
        self.samples = max(1, round(settings.duration / period))
        self._settings = settings
        self._reach = reach
        self._time: FloatArray = period * np.arange(self.samples + 2, dtype=np.float64)
        self._random = random_parameters(rig) if settings.randomize else []

    def draw(self, rng: np.random.Generator) -> Episode:
        """One episode."""
        values = {
            p.name: float(np.clip(rng.normal(p.value, p.sd), p.low, p.high)) for p in self._random
        }
        low, high = self._settings.load_range
        load = float(rng.uniform(low, high)) if high > low else low
        asked = TASKS[self._settings.task](rng, self._time, self._reach)
        table = np.empty((self.samples + 1, COLUMNS))
        wanted = (asked.angle, asked.rate, asked.acceleration, asked.stiffness)
        for column, signal in enumerate(wanted):
            table[:, column] = signal[1:]
        table[:, TORQUE] = asked.torque[:-1]
        table[:, NOISE:] = rng.standard_normal((self.samples + 1, 3))
        return Episode(values=values, load=load, table=table)
