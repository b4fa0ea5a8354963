"""Options of the environments, and those of `reset` for one episode, checked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.rig import Rig, load_rig
from pamsim.envs.actions import KINDS
from pamsim.envs.tasks import TASKS


def _range(
    unit: str, high: float, doc: str, low: float = 0.0, *, low_open: bool = False
) -> FieldSpec:
    return FieldSpec(unit=unit, low=low, high=high, low_open=low_open, doc=doc)


_RANGES: dict[str, FieldSpec] = {
    "frame_skip": _range("1", 1e4, "time steps per action", low=1.0),
    "load": _range("kg", 1e3, "on the rig"),
    "top_pressure": _range("Pa", 2e6, "set point", low_open=True),
    "start_pressure": _range("Pa", 2e6, "gauge, at the start"),
    "angle_noise": _range("rad or m", 1.0, "standard deviation"),
    "pressure_noise": _range("Pa", 1e6, "standard deviation"),
    "delay": _range("s", 1.0, "of commands"),
    "effort": _range("1", 1e3, "weight in the reward"),
}
_POSITION = _range("rad or m", 1e3, "of a joint", low=-1e3)


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
        """Check every option.

        Raises:
            InputError: for an unknown action or task, a load that is no range, part of a time step.
            ParameterError: for a number out of range.
        """
        for what, name, known in (("action", self.action, KINDS), ("task", self.task, TASKS)):
            if name not in known:
                raise InputError(f"no {what} {name!r}; {nearest(str(name), known)}")
        low, high = self.load_range
        for name, allowed in _RANGES.items():
            for value in (low, high) if name == "load" else (getattr(self, name),):
                if value is not None:
                    check_value(name, value, allowed)
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
        if isinstance(self.load, int | float):
            return float(self.load), float(self.load)
        given: Any = self.load
        try:
            low, high = given
            return float(low), float(high)
        except (TypeError, ValueError):
            raise InputError(f"load {given!r}: give a mass in kg, or the ends of a range") from None

    def loaded_rig(self) -> Rig:
        """The rig.

        Raises:
            InputError: as `pamsim.load_rig`.
        """
        return self.rig if isinstance(self.rig, Rig) else load_rig(self.rig)


def env_settings(options: Mapping[str, Any]) -> EnvSettings:
    """Options of an environment, checked.

    Raises:
        InputError: for an unknown one, with the nearest name.
        ParameterError: for a number out of range.
    """
    _check_names("of the environment", options, EnvSettings.__dataclass_fields__)
    return EnvSettings(**options)


@dataclass(frozen=True, kw_only=True)
class ResetOptions:
    """What ``options`` of `reset` fix of an episode, in place of what is drawn.

    Attributes:
        start_pressure: (m,) of the muscles, at rest [Pa].
        load: [kg]; None to draw it.
        target: joint -> position asked for all the time [rad or m]; other joints have the task's.
        parameters: of the rig, as `Rig.with_parameters` takes them [SI].
    """

    start_pressure: tuple[float, ...]
    load: float | None = None
    target: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)


def reset_options(given: Mapping[str, Any] | None, rig: Rig, usual: float) -> ResetOptions:
    """Options of `reset`, checked.

    Args:
        given: by the caller; None for none.
        rig: of the environment.
        usual: start pressure of muscles for which none is given [Pa].

    Raises:
        InputError: for an unknown option, muscle or joint; for a pressure above the supply's.
        ParameterError: for a number out of range.
    """
    asked = dict(given or {})
    _check_names("of reset", asked, ResetOptions.__dataclass_fields__)
    load = asked.get("load")
    target = dict(asked.get("target") or {})
    for joint, value in target.items():
        if joint not in rig.joints:
            raise InputError(f"target: no joint {joint!r}; {nearest(joint, rig.joints)}")
        check_value(f"target {joint}", value, _POSITION)
    pressure = asked.get("start_pressure", usual)
    each = pressure if isinstance(pressure, Mapping) else dict.fromkeys(rig.muscles, pressure)
    own: dict[str, Any] = dict(each)
    for name, value in own.items():
        if name not in rig.muscles:
            raise InputError(f"start_pressure: no muscle {name!r}; {nearest(name, rig.muscles)}")
        check_value("start_pressure", value, _RANGES["start_pressure"])
        if value > rig.supply_pressure:
            raise InputError(
                f"start_pressure {value / 1e3:g} kPa is above the supply's"
                f" {rig.supply_pressure / 1e3:g} kPa"
            )
    return ResetOptions(
        start_pressure=tuple(float(own.get(name, usual)) for name in rig.muscles),
        load=None if load is None else check_value("load", load, _RANGES["load"]),
        target=target,
        parameters=dict(asked.get("parameters") or {}),
    )


def _check_names(where: str, given: Iterable[str], known: Iterable[str]) -> None:
    for name in given:
        if name not in known:
            raise InputError(f"no option {name!r} {where}; {nearest(name, known)}")
