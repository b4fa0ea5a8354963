"""What is drawn at reset for a whole episode, and the state at rest in which it begins.

An episode is a function of this draw and of the actions alone, so that single and vector
environments with the same seeds have the same episodes. Its rows can be made for any number of
samples: more of them continue the fewer.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.parameters import check_value
from pamsim.core.units import FloatArray
from pamsim.engine.parameter_names import ParameterName, muscles_with
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.engine.state import RestSteps, save_state, settle_quickly
from pamsim.engine.stepping import live
from pamsim.envs.actions import KINDS
from pamsim.envs.plant import fixed_tendons
from pamsim.envs.scales import Reach
from pamsim.envs.settings import RANGES, EnvSettings, check_names, check_supply
from pamsim.envs.tasks import held, task_signals
from pamsim.inference.estimate import NORMAL95
from pamsim.recordings.experiment import Experiment

STIFFNESS, TORQUE, NOISE = 3, 4, 5
"""Blocks of an episode's columns: first those of `TaskSignals`, each one column per joint, then the
noise of all joints' positions and all muscles' pressures."""

_DELAYS = ("valve.delay", "valve.closing_delay")
"""Parameters of no episode: an environment delays commands, by the same time steps in all."""

_SEEDS = 2**63

_ROUNDING = 1e-9  # of a stop [rad or m]

_STEPS = 16
"""Time steps in one in which a rig whose parameters are drawn comes to rest: its angle is within
0.02 deg of that in single steps, far below what the draw changes."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """What an episode is made from: fixed by ``options`` of `reset`, the rest drawn.

    Attributes:
        start_pressure: (m,) of the muscles, at rest [Pa].
        load: [kg]; None before it is drawn.
        target: joint -> position asked for all the time [rad or m]; other joints have the task's.
        parameters: of the rig, as `Rig.with_parameters` takes them [SI].
        seeds: of each joint's task, and of the noise; empty before they are drawn.
    """

    start_pressure: tuple[float, ...]
    load: float | None = None
    target: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    seeds: tuple[int, ...] = ()


_FIXED = Episode.__dataclass_fields__.keys() - {"seeds"}


def random_parameters(rig: Rig) -> dict[str, tuple[float, float, float, float]]:
    """The parameters that a rig's file states with a 95 % interval.

    Name -> centre, standard deviation, smallest and largest allowed value [SI]. The deviation is 0
    where one muscle states a value of its own without an interval and the others' is drawn. Delays
    of the valves are left out.
    """
    file = rig.file
    sections = {"": file.muscle, **{f"{name}:": own for name, own in file.overrides.items()}}
    names = [
        f"{muscle}{group}.{field}"
        for muscle, groups in sections.items()
        for group, section in groups.items()
        for field in section
        if field != "law" and f"{group}.{field}" not in _DELAYS
    ]
    names += [*file.native, *(f"sensor.{field}" for field in file.sensor)]
    drawn = {}
    for name in names:
        known = rig_parameter(rig, _read_at(rig, name))
        if known.interval95 is not None:
            low, high = known.interval95
            sd = abs(high - low) / (2.0 * NORMAL95)
        elif name.rpartition(":")[2] in drawn:
            sd = 0.0
        else:
            continue
        drawn[name] = known.value, sd, known.spec.low, known.spec.high
    return drawn


def _read_at(rig: Rig, name: str) -> str:
    """The name of a shared parameter in a muscle that states no other value itself."""
    parsed = ParameterName.parse(name)
    if parsed.owner != "muscle" or parsed.muscle:
        return name
    own = rig.file.overrides
    for muscle in muscles_with(parsed, rig.muscles, rig.file.native):
        if parsed.field not in own[muscle].get(parsed.group, {}):
            return f"{muscle}:{name}"
    return name


class Episodes:
    """Draws the episodes of an environment, and brings its rig to rest for them."""

    def __init__(
        self,
        settings: EnvSettings,
        rig: Rig,
        reaches: tuple[Reach, ...],
        top: float,
        period: float,
    ) -> None:
        self._settings, self._rig, self._period = settings, rig, period
        given = settings.start_pressure
        self._start_pressure = 0.5 * top if given is None else given
        self._reaches = dict(zip(rig.joints, reaches, strict=True))
        self._noises = len(rig.joints) + len(rig.muscles)
        self.columns = NOISE * len(rig.joints) + self._noises
        self._random = random_parameters(rig) if settings.randomize else {}
        if settings.randomize and not self._random:
            raise InputError(
                f"randomize: rig {rig.name!r} states no 95 % interval to draw from; add interval95"
                " to numbers in its params.toml, or take the rig that `pamsim calibrate` writes"
            )
        self._fixed = fixed_tendons(rig.model) is not None
        self._data = mujoco.MjData(rig.model)
        # Many episodes have the same one.
        self._usual = functools.lru_cache(1)(functools.partial(self._settled, rig, 1))

    def asked(self, options: Mapping[str, Any] | None = None) -> Episode:
        """What the options of `reset` fix of an episode.

        Raises:
            InputError: for an unknown option, muscle or joint; for a target or parameter without a
                name, or a target beyond the joint's stops; for a pressure above the supply's; for a
                delay of the valves.
            ParameterError: for a number out of range.
        """
        given, muscles = dict(options or {}), self._rig.muscles
        check_names("no option", given, _FIXED, " of reset")
        for name in ("target", "parameters"):
            value: Any = {} if given.get(name) is None else given[name]
            if not isinstance(value, Mapping):
                raise InputError(f"{name} is {value!r}; give a number by name: {{NAME: NUMBER}}")
            given[name] = value
        target, load = given["target"], given.get("load")
        check_names("target: no joint", target, self._rig.joints)
        for joint, value in target.items():
            check_value(f"target {joint}", value, RANGES["target"])
            stops = self._rig.model.joint(joint)
            low, high = stops.range.tolist()
            if stops.limited and not low - _ROUNDING <= value <= high + _ROUNDING:
                raise InputError(
                    f"target: joint {joint!r} cannot be at {value:g}, beyond its stops at {low:.4g}"
                    f" and {high:.4g}; give rad, or m of a joint that slides"
                )
        parameters = dict(given["parameters"])
        for name in parameters:
            if name.rpartition(":")[2] in _DELAYS:
                raise InputError(
                    f"parameters: {name} cannot change from episode to episode; make the"
                    " environment with the option `delay`"
                )
        pressure: Any = given.get("start_pressure", self._start_pressure)
        if not isinstance(pressure, Mapping):
            pressure = dict.fromkeys(muscles, pressure)
        check_names("start_pressure: no muscle", pressure, muscles)
        own = [pressure.get(muscle, self._start_pressure) for muscle in muscles]
        start = [check_value("start_pressure", one, RANGES["start_pressure"]) for one in own]
        return Episode(
            start_pressure=tuple(check_supply("start_pressure", one, self._rig) for one in start),
            load=None if load is None else check_value("load", load, RANGES["load"]),
            target=dict(target),
            parameters=parameters,
        )

    def draw(self, rng: np.random.Generator, asked: Episode) -> Episode:
        """One episode; what `reset` was asked for takes the place of what is drawn."""
        drawn = {
            name: min(max(float(rng.normal(centre, sd)), least), most)
            for name, (centre, sd, least, most) in self._random.items()
        }
        # What is asked of all muscles is asked of those with a value of their own.
        drawn = {n: v for n, v in drawn.items() if n.rpartition(":")[2] not in asked.parameters}
        low, high = self._settings.load_range
        load = float(rng.uniform(low, high)) if high > low else low
        return replace(
            asked,
            load=load if asked.load is None else asked.load,
            parameters={**drawn, **asked.parameters},
            seeds=tuple(rng.integers(_SEEDS, size=len(self._reaches) + 1).tolist()),
        )

    def table(self, episode: Episode, rows: int) -> FloatArray:
        """Rows (rows, columns) of an episode.

        Row k holds the references at the end of step k and the torques during it, in SI, and the
        noise of the readings before it, in standard deviations.

        Raises:
            InputError: if the task gives what it may not, or asks a stiffness of a rig whose
                tendons are not all fixed.
        """
        joints, table = len(self._reaches), np.empty((rows, self.columns))
        time = self._period * np.arange(rows + 1, dtype=np.float64)
        *tasks, noise = map(np.random.default_rng, episode.seeds)
        for joint, (name, reach) in enumerate(self._reaches.items()):
            asked = task_signals(self._settings.own_task, tasks[joint], time, reach)
            if asked.stiffness.any() and not self._fixed:
                raise InputError(
                    f"the task asks a stiffness of rig {self._rig.name!r}, whose moment arms change"
                    " with its position; choose a task without, or a rig of fixed tendons"
                )
            if name in episode.target:
                there = held(time, episode.target[name])
                asked = replace(there, stiffness=asked.stiffness, torque=asked.torque)
            # The references are those of the next sample, the torques those of the present one.
            for block, signal in enumerate(vars(asked).values()):
                table[:, block * joints + joint] = signal[:-1] if block == TORQUE else signal[1:]
        table[:, NOISE * joints :] = noise.standard_normal((rows, self._noises))
        return table

    def rest(self, episode: Episode) -> tuple[Rig, FloatArray]:
        """The rig of an episode, with its load and parameters, and the state in which it begins.

        Raises:
            InputError: if the rig cannot be stepped at its time step, or for a parameter that
                gives it other states.
        """
        load, values = float(episode.load or 0.0), episode.parameters
        if not values:
            return self._usual(load, episode.start_pressure)
        # The load sets the mass of its body after all other parameters.
        rig = self._rig.with_parameters(values, data=self._data)
        if rig.compiled is not self._rig.compiled:
            raise InputError(
                f"{', '.join(values)}: an episode cannot have another law or operator than its"
                f" environment; make one with rig=pamsim.load_rig({self._rig.name!r})"
                ".with_parameters(...)"
            )
        return self._settled(rig, _STEPS, load, episode.start_pressure)

    def _settled(
        self, rig: Rig, steps: int, load: float, pressure: tuple[float, ...]
    ) -> tuple[Rig, FloatArray]:
        kind, start = KINDS[self._settings.action], np.array(pressure)
        model = rig.model_for(load=load, command=kind.command, data=self._data)
        check_timestep(model, rig.limits)
        at_rest = Experiment(
            drive=kind.command,
            command_time=np.zeros(1),
            command_value=kind.rest(start)[np.newaxis],
            start_pressure=start,
            duration=self._period,
            sample_rate=1.0 / self._period,
        )
        rest = RestSteps(later=steps * float(model.opt.timestep))
        with live(model):
            settle_quickly(model, self._data, at_rest, rig.limits, rest)
        self._data.ctrl[:] = at_rest.command_value[0]
        return replace(rig, model=model), save_state(model, self._data)
