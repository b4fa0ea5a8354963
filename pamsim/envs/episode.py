"""What is drawn at reset for a whole episode, and the state at rest in which it begins.

An episode is a function of this draw and of the actions alone, so that single and vector
environments with the same seeds have the same episodes. Its rows can be made for any number of
samples: more of them continue the fewer.
"""

from __future__ import annotations

import dataclasses
import functools

import mujoco
import numpy as np

from pamsim.core.units import FloatArray
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.engine.state import save_state, settle_quickly
from pamsim.engine.stepping import live
from pamsim.envs.actions import KINDS
from pamsim.envs.scales import Reach
from pamsim.envs.settings import EnvSettings, Episode
from pamsim.envs.tasks import TASKS, held
from pamsim.recordings.experiment import Experiment

POSITION, VELOCITY, ACCELERATION, STIFFNESS, TORQUE, NOISE = range(6)
"""Blocks of an episode's columns, each of the first five one column per joint; the noise is of all
joints' positions, then of all muscles' pressures."""

_SEEDS = 2**63

_NORMAL95 = 1.959964
"""Standard deviations from the centre of a 95 % interval to its ends."""

_STEPS = 16
"""Time steps in one in which a rig whose parameters are drawn comes to rest: its angle is within
0.02 deg of that in single steps, far below what the draw changes."""


def random_parameters(rig: Rig) -> dict[str, tuple[float, float, float, float]]:
    """The parameters that a rig's file states with a 95 % interval.

    The dead time of the valves is left out: commands are delayed by whole time steps.

    Returns:
        Name -> centre, standard deviation, smallest and largest allowed value [SI].
    """
    file = rig.file
    sections = {"": file.muscle, **{f"{name}:": own for name, own in file.overrides.items()}}
    names = [
        f"{muscle}{group}.{field}"
        for muscle, groups in sections.items()
        for group, section in groups.items()
        for field in section
        if field != "law" and (group, field) != ("valve", "delay")
    ]
    names += [*file.native, *(f"sensor.{field}" for field in file.sensor)]
    drawn = {}
    for name in names:
        known = rig_parameter(rig, name)
        if known.interval95 is not None:
            low, high = known.interval95
            sd = abs(high - low) / (2.0 * _NORMAL95)
            drawn[name] = known.value, sd, known.spec.low, known.spec.high
    return drawn


class Episodes:
    """Draws the episodes of an environment, and brings its rig to rest for them."""

    def __init__(
        self, settings: EnvSettings, rig: Rig, reaches: tuple[Reach, ...], period: float
    ) -> None:
        self._rig, self._period, self._kind = rig, period, KINDS[settings.action]
        self._load_range, self._task = settings.load_range, TASKS[settings.task]
        self._reaches = dict(zip(rig.joints, reaches, strict=True))
        self._noises = len(rig.joints) + len(rig.muscles)
        self.columns = NOISE * len(rig.joints) + self._noises
        self._random = random_parameters(rig) if settings.randomize else {}
        self._numbers = np.array(list(self._random.values())).reshape(-1, 4).T
        # The load sets the mass of its body after all other parameters.
        own = f"body.{rig.file.load_body}."
        self._apart = {name for name in self._random if not name.startswith(own)}
        self._data = mujoco.MjData(rig.model)
        # What one episode after the other needs again.
        self._loaded = functools.lru_cache(1)(lambda load: self._with_load(rig, load))
        self._start = functools.lru_cache(1)(self._experiment)
        self._usual = functools.lru_cache(1)(
            lambda load, pressure: self._settled(self._loaded(load), pressure, 1)
        )

    def draw(self, rng: np.random.Generator, asked: Episode) -> Episode:
        """One episode; what `reset` was asked for takes the place of what is drawn."""
        values = {}
        if self._random:
            centre, sd, least, most = self._numbers
            drawn = np.minimum(np.maximum(rng.normal(centre, sd), least), most)
            values = dict(zip(self._random, drawn.tolist(), strict=True))
        low, high = self._load_range
        load = float(rng.uniform(low, high)) if high > low else low
        return Episode(
            start_pressure=asked.start_pressure,
            load=load if asked.load is None else asked.load,
            target=asked.target,
            parameters={**values, **asked.parameters},
            seeds=tuple(rng.integers(_SEEDS, size=len(self._reaches) + 1).tolist()),
        )

    def table(self, episode: Episode, rows: int) -> FloatArray:
        """Rows of an episode.

        Returns:
            (rows, columns). Row k holds the references at the end of step k and the torques during
            it, in SI, and the noise of the readings before it, in standard deviations.
        """
        joints, table = len(self._reaches), np.empty((rows, self.columns))
        time = self._period * np.arange(rows + 1, dtype=np.float64)
        *tasks, noise = map(np.random.default_rng, episode.seeds)
        for joint, (name, reach) in enumerate(self._reaches.items()):
            asked = self._task(tasks[joint], time, reach)
            moved = held(time, episode.target[name]) if name in episode.target else asked
            references = moved.position, moved.velocity, moved.acceleration, asked.stiffness
            # The references are those of the next sample, the torques those of the present one.
            for block, signal in enumerate((*(one[1:] for one in references), asked.torque[:-1])):
                table[:, block * joints + joint] = signal
        table[:, NOISE * joints :] = noise.standard_normal((rows, self._noises))
        return table

    def rest(self, episode: Episode) -> tuple[Rig, FloatArray]:
        """The rig of an episode, with its load and parameters, and the state in which it begins.

        Raises:
            InputError: if the rig cannot be stepped at its time step.
        """
        load, values = float(episode.load or 0.0), episode.parameters
        if not values:
            return self._usual(load, episode.start_pressure)
        if values.keys() <= self._apart:
            rig = self._loaded(load).with_parameters(values, data=self._data)
        else:
            rig = self._with_load(self._rig.with_parameters(values, data=self._data), load)
        return self._settled(rig, episode.start_pressure, _STEPS)

    def _settled(self, rig: Rig, pressure: tuple[float, ...], steps: int) -> tuple[Rig, FloatArray]:
        start = self._start(pressure)
        check_timestep(rig.model, rig.muscles)
        with live(rig.model):
            settle_quickly(rig.model, self._data, start, rig.muscles, steps)
        self._data.ctrl[:] = start.command_value[0]
        return rig, save_state(rig.model, self._data)

    def _with_load(self, rig: Rig, load: float) -> Rig:
        model = rig.model_for(load=load, command=self._kind.command, data=self._data)
        return dataclasses.replace(rig, model=model)

    def _experiment(self, pressure: tuple[float, ...]) -> Experiment:
        start_pressure = np.array(pressure)
        return Experiment(
            drive=self._kind.command,
            command_time=np.zeros(1),
            command_value=self._kind.rest(start_pressure)[np.newaxis],
            start_pressure=start_pressure,
            duration=self._period,
            sample_rate=1.0 / self._period,
        )
