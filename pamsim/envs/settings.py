"""Options of the environments, checked."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.envs.actions import KINDS
from pamsim.envs.tasks import TASKS, Task

RANGES = {
    name: FieldSpec(unit=unit, low=low, high=high, low_open=name == "top_pressure", doc=doc)
    for name, unit, low, high, doc in (
        ("frame_skip", "1", 1.0, 1e4, "time steps per action"),
        ("load", "kg", 0.0, 1e3, "on the rig"),
        ("top_pressure", "Pa", 0.0, 2e6, "set point"),
        ("start_pressure", "Pa", 0.0, 2e6, "gauge, at the start"),
        ("angle_noise", "rad or m", 0.0, 1.0, "standard deviation"),
        ("pressure_noise", "Pa", 0.0, 1e6, "standard deviation"),
        ("delay", "s", 0.0, 1.0, "of commands"),
        ("effort", "1", 0.0, 1e3, "weight in the reward"),
        ("target", "rad or m", -1e3, 1e3, "of a joint"),
    )
}
"""Of the options of an environment, and of `reset`."""


Reward: TypeAlias = Callable[[Mapping[str, NDArray[Any]]], FloatArray]
"""Information of a step, each entry (n, ...) for n rigs -> rewards (n,)."""


@dataclass(frozen=True, kw_only=True)
class EnvSettings:
    """Options of the environments.

    Attributes:
        rig: name of a shipped rig, a rig folder (such as ``rig`` in what `pamsim diagnose` writes),
            or a loaded rig.
        action: one of `pamsim.envs.actions.KINDS`.
        task: one of `pamsim.envs.tasks.TASKS`, or a function as `pamsim.envs.tasks.Task`.
        reward: in place of the rewards of `pamsim.envs.rig_env.RigEnv`: a function of the
            information of a step, each entry (n, ...) for n rigs, that returns (n,).
        frame_skip: time steps of the engine per action.
        load: mass on the rig [kg], or a range from which it is drawn for every episode.
        top_pressure: largest set point [Pa]; the supply's if left out. Tasks and observations
            are scaled by what the rig does up to it.
        start_pressure: in all muscles, at rest, at the start [Pa]; half the top pressure if left
            out.
        angle_noise: standard deviation of white noise on measured positions [rad or m].
        pressure_noise: the same on the measured pressures [Pa].
        instruments: True to round as the rig's encoder and converter do.
        delay: dead time of the commands, on top of the rig's own ``valve.delay`` [s].
        randomize: True to draw, for every episode, each parameter that the rig's file states with a
            95 % interval from the normal distribution of that interval.
        effort: weight of the mean squared change of the commands in the reward.

    Raises:
        InputError: for an unknown action or task, a load that is no range, part of a time step.
        ParameterError: for a number out of range.
    """

    rig: str | os.PathLike[str] | Rig = "mas20_arm"
    action: str = "pressure_set"
    task: str | Task = "regulation"
    reward: Reward | None = None
    frame_skip: int = 40
    load: float | tuple[float, float] = 0.0
    top_pressure: float | None = None
    start_pressure: float | None = None
    angle_noise: float = 0.0
    pressure_noise: float = 0.0
    instruments: bool = False
    delay: float = 0.0
    randomize: bool = False
    effort: float = 0.02

    def __post_init__(self) -> None:
        check_names("no action", [self.action], KINDS)
        if not callable(self.task):
            check_names("no task", [self.task], TASKS)
        if self.reward is not None and not callable(self.reward):
            raise InputError(f"reward {self.reward!r}: give a function of a step's information")
        low, high = self.load_range
        for name, value in {**vars(self), "load": low}.items():
            if name in RANGES and value is not None:
                check_value(name, value, RANGES[name])
        check_value("load", high, RANGES["load"])
        if int(self.frame_skip) != self.frame_skip:
            raise InputError(f"frame_skip {self.frame_skip:g} is not a whole number of time steps")
        object.__setattr__(self, "frame_skip", int(self.frame_skip))
        if low > high:
            raise InputError(f"load ({low:g}, {high:g}) kg is no range: give the lower end first")

    @property
    def own_task(self) -> Task:
        """What the episodes ask of each joint."""
        return self.task if callable(self.task) else TASKS[self.task]

    def may_ask(self, task: str) -> bool:
        """Whether episodes may ask for what one of `TASKS` asks for; a task of one's own may."""
        return callable(self.task) or self.task == task

    @property
    def load_range(self) -> tuple[float, float]:
        """Smallest and largest load [kg].

        Raises:
            InputError: if the load is neither a number nor two.
        """
        try:
            low, high = np.broadcast_to(np.asarray(self.load, dtype=float), 2).tolist()
        except (TypeError, ValueError):
            raise InputError(
                f"load {self.load!r}: give a mass in kg, or the ends of a range"
            ) from None
        return low, high


def env_settings(options: Mapping[str, Any]) -> EnvSettings:
    """Options of an environment, checked.

    Raises:
        InputError: for an unknown one, with the nearest name.
        ParameterError: for a number out of range.
    """
    check_names("no option", options, EnvSettings.__dataclass_fields__, " of the environment")
    return EnvSettings(**options)


def check_names(what: str, given: Iterable[str], known: Iterable[str], where: str = "") -> None:
    """Refuse a name that is not known, with an `InputError` that gives the nearest one."""
    for name in given:
        if name not in known:
            raise InputError(f"{what} {name!r}{where}; {nearest(str(name), known)}")


def check_supply(what: str, pressure: float, rig: Rig) -> float:
    """A gauge pressure [Pa]; an `InputError` if it is above that of a rig's supply."""
    top = rig.supply_pressure
    if pressure > top:
        raise InputError(f"{what} {pressure / 1e3:g} kPa is above the supply's {top / 1e3:g} kPa")
    return pressure
