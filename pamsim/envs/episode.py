"""What is drawn at reset for a whole episode, and the state at rest in which it begins.

An episode is a function of this draw and of the actions alone, so that single and vector
environments with the same seeds have the same episodes. Its rows can be made for any number of
samples: more of them continue the fewer.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.engine.state import save_state, settle_quickly
from pamsim.engine.stepping import live
from pamsim.envs.actions import KINDS
from pamsim.envs.scales import Reach
from pamsim.envs.settings import EnvSettings, ResetOptions
from pamsim.envs.tasks import TASKS, held
from pamsim.recordings.experiment import Experiment

FloatArray = NDArray[np.float64]

POSITION, VELOCITY, ACCELERATION, STIFFNESS, TORQUE, NOISE = range(6)
"""Blocks of an episode's columns, each of the first five one column per joint; the noise is of all
joints' positions, then of all muscles' pressures."""

_SEEDS = 2**63

_NORMAL95 = 1.959964
"""Standard deviations from the centre of a 95 % interval to its ends."""

_STEPS = 16
"""Time steps in one in which a rig whose parameters are drawn comes to rest: its angle is within
0.02 deg of that in single steps, far below what the draw changes."""


@dataclass(frozen=True, kw_only=True)
class RandomParameter:
    """A parameter drawn for every episode.

    Attributes:
        name: as `Rig.with_parameters` takes it.
        value: centre [SI].
        sd: standard deviation [SI].
        low: smallest allowed value.
        high: largest.
    """

    name: str
    value: float
    sd: float
    low: float
    high: float


def random_parameters(rig: Rig) -> list[RandomParameter]:
    """The parameters that a rig's file states with a 95 % interval.

    The dead time of the valves is left out: commands are delayed by whole time steps.
    """
    file = rig.file
    names = [f"{group}.{field}" for group, section in file.muscle.items() for field in section]
    names += [
        f"{muscle}:{group}.{field}"
        for muscle, groups in file.overrides.items()
        for group, section in groups.items()
        for field in section
    ]
    names += [*file.native, *(f"sensor.{field}" for field in file.sensor)]
    drawn: list[RandomParameter] = []
    for name in names:
        if name.endswith((".law", "valve.delay")):
            continue
        known = rig_parameter(rig, name)
        if known.interval95 is not None:
            low, high = known.interval95
            sd = abs(high - low) / (2.0 * _NORMAL95)
            limits = {"low": known.spec.low, "high": known.spec.high}
            drawn.append(RandomParameter(name=name, value=known.value, sd=sd, **limits))
    return drawn


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
    """Draws the episodes of an environment and brings its rig to rest for them.

    Args:
        settings: of it.
        rig: as loaded.
        reaches: of its joints.
        period: between samples [s].
    """

    def __init__(
        self, settings: EnvSettings, rig: Rig, reaches: tuple[Reach, ...], period: float
    ) -> None:
        self._settings, self._rig, self._period = settings, rig, period
        self._kind = KINDS[settings.action]
        self._reaches = dict(zip(rig.joints, reaches, strict=True))
        self._noises = len(rig.joints) + len(rig.muscles)
        self._random = random_parameters(rig) if settings.randomize else []
        # The load sets the mass of its body after all other parameters.
        own = f"body.{rig.file.load_body}."
        self._apart = {p.name for p in self._random if not p.name.startswith(own)}
        self.columns = NOISE * len(rig.joints) + self._noises
        self._data = mujoco.MjData(rig.model)
        self._loaded: dict[float, Rig] = {}
        self._starts: dict[tuple[float, ...], Experiment] = {}
        self._known: dict[object, tuple[Rig, FloatArray]] = {}

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
            moved = held(time, episode.target[name]) if name in episode.target else asked
            references = moved.position, moved.velocity, moved.acceleration, asked.stiffness
            for block, signal in enumerate(references):
                table[:, block * joints + joint] = signal[1:]
            table[:, TORQUE * joints + joint] = asked.torque[:-1]
        table[:, NOISE * joints :] = generators[-1].standard_normal((rows, self._noises))
        return table

    def rest(self, episode: Episode) -> tuple[Rig, FloatArray]:
        """The rig of an episode, with its load and parameters, and the state in which it begins.

        That of the rig's own numbers is kept for the next episode.

        Raises:
            InputError: if the rig cannot be stepped at its time step.
        """
        key = episode.load, episode.start_pressure
        if not episode.values and key in self._known:
            return self._known[key]
        rig, data = self._with_parameters(episode), self._data
        start = self._start(episode.start_pressure)
        check_timestep(rig.model, rig.muscles)
        with live(rig.model):
            steps = _STEPS if episode.values else 1
            settle_quickly(rig.model, data, start, rig.muscles, steps)
        data.ctrl[:] = start.command_value[0]
        found = rig, save_state(rig.model, data)
        if not episode.values:
            self._known = {key: found}
        return found

    def _with_parameters(self, episode: Episode) -> Rig:
        data, load, values = self._data, episode.load, episode.values
        if not values.keys() <= self._apart:
            return self._with_load(self._rig.with_parameters(values, data=data), load)
        if load not in self._loaded:
            self._loaded = {load: self._with_load(self._rig, load)}
        return self._loaded[load].with_parameters(values, data=data)

    def _with_load(self, rig: Rig, load: float) -> Rig:
        model = rig.model_for(load=load, command=self._kind.command, data=self._data)
        return dataclasses.replace(rig, model=model)

    def _start(self, pressure: tuple[float, ...]) -> Experiment:
        if pressure not in self._starts:
            start_pressure = np.array(pressure)
            self._starts = {
                pressure: Experiment(
                    drive=self._kind.command,
                    command_time=np.zeros(1),
                    command_value=self._kind.rest(start_pressure)[np.newaxis],
                    start_pressure=start_pressure,
                    duration=self._period,
                    sample_rate=1.0 / self._period,
                )
            }
        return self._starts[pressure]
