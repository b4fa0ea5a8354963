"""What is drawn at reset for a whole episode: rig, task, disturbance, noise.

An episode is a function of this draw and of the actions alone, so that single and vector
environments with the same seeds have the same episodes. Its rows can be made for any number of
samples: more of them continue the fewer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.envs.randomisation import random_parameters
from pamsim.envs.reach import Reach
from pamsim.envs.reset_options import ResetOptions
from pamsim.envs.settings import EnvSettings
from pamsim.envs.tasks import TASKS, held

FloatArray = NDArray[np.float64]

POSITION, VELOCITY, ACCELERATION, STIFFNESS, TORQUE, NOISE = range(6)
"""Blocks of an episode's columns, each of the first five one column per joint; the noise is of all
joints' positions, then of all muscles' pressures."""

_SEEDS = 2**63


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One episode.

    Attributes:
        values: parameters of the rig that differ from its own [SI].
        load: [kg].
        start_pressure: (m,) of the muscles, at rest [Pa].
        target: joint -> position that is asked for all the time, in place of the task's.
        seeds: of each joint's task, and of the noise.
    """

    values: dict[str, float]
    load: float
    start_pressure: tuple[float, ...]
    target: dict[str, float]
    seeds: tuple[int, ...]


class Episodes:
    """Draws the episodes of an environment.

    Args:
        settings: of it.
        rig: as loaded.
        reaches: of its joints.
        period: between samples [s].
    """

    def __init__(
        self, settings: EnvSettings, rig: Rig, reaches: tuple[Reach, ...], period: float
    ) -> None:
        self._settings = settings
        self._reaches = dict(zip(rig.joints, reaches, strict=True))
        self._noises = len(rig.joints) + len(rig.muscles)
        self._period = period
        self._random = random_parameters(rig) if settings.randomize else []
        self.columns = NOISE * len(rig.joints) + self._noises

    def draw(self, rng: np.random.Generator, asked: ResetOptions) -> Episode:
        """One episode; what `reset` was asked for takes the place of what is drawn."""
        values = {
            p.name: float(np.clip(rng.normal(p.value, p.sd), p.low, p.high)) for p in self._random
        }
        low, high = self._settings.load_range
        load = float(rng.uniform(low, high)) if high > low else low
        return Episode(
            values={**values, **asked.parameters},
            load=load if asked.load is None else asked.load,
            start_pressure=asked.start_pressure,
            target=asked.target,
            seeds=tuple(rng.integers(_SEEDS, size=len(self._reaches) + 1).tolist()),
        )

    def table(self, episode: Episode, rows: int) -> FloatArray:
        """Rows of an episode.

        Returns:
            (rows, columns). Row k holds the references at the end of step k and the torques during
            it, in SI, and the noise of the readings before it, in standard deviations.
        """
        joints = len(self._reaches)
        table = np.empty((rows, self.columns))
        # The references are those of the next sample, the torques those of the present one.
        time = self._period * np.arange(rows + 1, dtype=np.float64)
        generators = [np.random.default_rng(seed) for seed in episode.seeds]
        for joint, (name, reach) in enumerate(self._reaches.items()):
            asked = TASKS[self._settings.task](generators[joint], time, reach)
            if name in episode.target:
                wanted = held(time, episode.target[name])
                moved = wanted.position, wanted.velocity, wanted.acceleration
            else:
                moved = asked.position, asked.velocity, asked.acceleration
            for block, signal in enumerate((*moved, asked.stiffness)):
                table[:, block * joints + joint] = signal[1:]
            table[:, TORQUE * joints + joint] = asked.torque[:-1]
        table[:, NOISE * joints :] = generators[-1].standard_normal((rows, self._noises))
        return table
