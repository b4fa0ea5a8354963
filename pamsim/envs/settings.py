"""Options of the environments, checked."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.rig import Rig, load_rig
from pamsim.envs.actions import KINDS
from pamsim.envs.reset_options import LOAD, PRESSURE
from pamsim.envs.tasks import TASKS

_RANGES: dict[str, FieldSpec] = {
    "frame_skip": FieldSpec(
        unit="1", low=1.0, high=1e4, low_open=False, doc="time steps per action"
    ),
    "load": LOAD,
    "top_pressure": FieldSpec(unit="Pa", low=0.0, high=2e6, low_open=True, doc="set point"),
    "start_pressure": PRESSURE,
    "angle_noise": FieldSpec(
        unit="rad or m", low=0.0, high=1.0, low_open=False, doc="standard deviation"
    ),
    "pressure_noise": FieldSpec(
        unit="Pa", low=0.0, high=1e6, low_open=False, doc="standard deviation"
    ),
    "delay": FieldSpec(unit="s", low=0.0, high=1.0, low_open=False, doc="of commands"),
    "effort": FieldSpec(unit="1", low=0.0, high=1e3, low_open=False, doc="weight in the reward"),
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
        check_value("frame_skip", self.frame_skip, _RANGES["frame_skip"])
        if int(self.frame_skip) != self.frame_skip:
            raise InputError(f"frame_skip {self.frame_skip:g} is not a whole number of time steps")
        low, high = self.load_range
        if low > high:
            raise InputError(f"load ({low:g}, {high:g}) kg is no range: give the lower end first")
        for name, allowed in _RANGES.items():
            for value in self.load_range if name == "load" else (getattr(self, name),):
                if value is not None:
                    check_value(name, value, allowed)

    @property
    def load_range(self) -> tuple[float, float]:
        """Smallest and largest load [kg]."""
        if isinstance(self.load, int | float):
            return float(self.load), float(self.load)
        return _pair(self.load)

    def loaded_rig(self) -> Rig:
        """The rig.

        Raises:
            InputError: as `pamsim.load_rig`.
        """
        return self.rig if isinstance(self.rig, Rig) else load_rig(self.rig)


def env_settings(options: dict[str, Any]) -> EnvSettings:
    """Options of an environment, checked.

    Raises:
        InputError: for an unknown one, with the nearest name.
        ParameterError: for a number out of range.
    """
    known = EnvSettings.__dataclass_fields__
    for name in options:
        if name not in known:
            raise InputError(f"no option {name!r} of the environment; {nearest(name, known)}")
    return EnvSettings(**options)


def _pair(load: Any) -> tuple[float, float]:
    try:
        low, high = load
        return float(low), float(high)
    except (TypeError, ValueError):
        raise InputError(f"load {load!r}: give a mass in kg, or the ends of a range") from None
