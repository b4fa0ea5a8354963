"""Options of the environments, and those of `reset` for one episode, checked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.rig import Rig
from pamsim.envs.actions import KINDS
from pamsim.envs.tasks import TASKS

_RANGES = {
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


@dataclass(frozen=True, kw_only=True)
class EnvSettings:
    """Options of the environments.

    Attributes:
        rig: name of a shipped rig, a rig folder (such as ``rig`` in what `pamsim diagnose` writes),
            or a loaded rig.
        action: one of `pamsim.envs.actions.KINDS`.
        task: one of `pamsim.envs.tasks.TASKS`.
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
    task: str = "regulation"
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
        for what, name, known in (("action", self.action, KINDS), ("task", self.task, TASKS)):
            if name not in known:
                raise InputError(f"no {what} {name!r}; {nearest(str(name), known)}")
        low, high = self.load_range
        for name, value in {**vars(self), "load": low}.items():
            if name in _RANGES and value is not None:
                check_value(name, value, _RANGES[name])
        check_value("load", high, _RANGES["load"])
        if int(self.frame_skip) != self.frame_skip:
            raise InputError(f"frame_skip {self.frame_skip:g} is not a whole number of time steps")
        if low > high:
            raise InputError(f"load ({low:g}, {high:g}) kg is no range: give the lower end first")

    @property
    def load_range(self) -> tuple[float, float]:
        """Smallest and largest load [kg].

        Raises:
            InputError: if the load is neither a number nor two.
        """
        given: Any = self.load
        try:
            low, high = (given, given) if isinstance(given, int | float) else given
            return float(low), float(high)
        except (TypeError, ValueError):
            raise InputError(f"load {given!r}: give a mass in kg, or the ends of a range") from None


def env_settings(options: Mapping[str, Any]) -> EnvSettings:
    """Options of an environment, checked.

    Raises:
        InputError: for an unknown one, with the nearest name.
        ParameterError: for a number out of range.
    """
    _check_names("no option", options, EnvSettings.__dataclass_fields__, " of the environment")
    return EnvSettings(**options)


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


def reset_options(given: Mapping[str, Any] | None, rig: Rig, usual: float) -> Episode:
    """Options of `reset`, checked.

    Args:
        given: ``start_pressure``, ``load``, ``target`` and ``parameters``; None for none.
        rig: of the environment.
        usual: start pressure of muscles for which none is given [Pa].

    Raises:
        InputError: for an unknown option, muscle or joint; for a pressure above the supply's.
        ParameterError: for a number out of range.
    """
    asked: dict[str, Any] = {"start_pressure": usual, "load": None, "target": {}, "parameters": {}}
    _check_names("no option", given or {}, asked, " of reset")
    asked |= given or {}
    load, target, pressure = asked["load"], asked["target"] or {}, asked["start_pressure"]
    _check_names("target: no joint", target, rig.joints)
    for joint, value in target.items():
        check_value(f"target {joint}", value, _RANGES["target"])
    own: dict[str, Any] = dict.fromkeys(rig.muscles, usual)
    own |= pressure if isinstance(pressure, Mapping) else dict.fromkeys(rig.muscles, pressure)
    _check_names("start_pressure: no muscle", own, rig.muscles)
    for value in own.values():
        check_value("start_pressure", value, _RANGES["start_pressure"])
        check_supply("start_pressure", value, rig)
    return Episode(
        start_pressure=tuple(float(own[name]) for name in rig.muscles),
        load=None if load is None else check_value("load", load, _RANGES["load"]),
        target=dict(target),
        parameters=dict(asked["parameters"] or {}),
    )


def check_supply(what: str, pressure: float, rig: Rig) -> None:
    """Refuse a gauge pressure [Pa] above that of a rig's supply.

    Raises:
        InputError: naming both.
    """
    top = rig.supply_pressure
    if pressure > top:
        raise InputError(f"{what} {pressure / 1e3:g} kPa is above the supply's {top / 1e3:g} kPa")


def _check_names(what: str, given: Iterable[str], known: Iterable[str], where: str = "") -> None:
    for name in given:
        if name not in known:
            raise InputError(f"{what} {name!r}{where}; {nearest(name, known)}")
