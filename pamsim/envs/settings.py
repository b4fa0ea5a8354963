"""Options of the environments, checked."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.rig import Rig, load_rig
from pamsim.envs.tasks import TASKS

_RANGES: dict[str, FieldSpec] = {
    name: FieldSpec(unit=unit, low=low, high=high, low_open=low_open, doc="")
    for name, unit, low, high, low_open in (
        ("duration", "s", 0.0, 1e4, True),
        ("frame_skip", "1", 1.0, 1e4, False),
        ("load", "kg", 0.0, 1e3, False),
        ("start_pressure", "Pa", 0.0, 2e6, False),
        ("angle_noise", "rad", 0.0, 1.0, False),
        ("pressure_noise", "Pa", 0.0, 1e6, False),
        ("delay", "s", 0.0, 1.0, False),
        ("effort", "1", 0.0, 1e3, False),
    )
}


@dataclass(frozen=True, kw_only=True)
class ArmSettings:
    """Options of every environment of the arm.

    Attributes:
        rig: name of a shipped rig, a rig folder (such as ``rig`` in what `pamsim diagnose` writes),
            or a loaded rig.
        task: one of `pamsim.envs.tasks.TASKS`.
        duration: of an episode [s].
        frame_skip: time steps of the engine per action.
        load: mass on the arm [kg], or a range from which it is drawn for every episode.
        start_pressure: in both muscles, at rest, at the start [Pa].
        angle_noise: standard deviation of white noise on the measured angle [rad].
        pressure_noise: the same on the measured pressures [Pa].
        instruments: True to round as the rig's encoder and converter do.
        delay: dead time of the commands, on top of the rig's own ``valve.delay`` [s].
        randomize: True to draw, for every episode, each parameter that the rig's file states with a
            95 % interval from the normal distribution of that interval.
        effort: weight of the change of command in the reward.
    """

    rig: str | os.PathLike[str] | Rig = "mas20_arm"
    task: str = "regulation"
    duration: float = 8.0
    frame_skip: int = 40
    load: float | tuple[float, float] = 0.0
    start_pressure: float = 300e3
    angle_noise: float = 0.0
    pressure_noise: float = 0.0
    instruments: bool = False
    delay: float = 0.0
    randomize: bool = False
    effort: float = 0.01

    def __post_init__(self) -> None:
        """Check every option.

        Raises:
            InputError: for an unknown task, a load that is no range, part of a time step.
            ParameterError: for a number out of range.
        """
        if self.task not in TASKS:
            raise InputError(f"no task {self.task!r}; {nearest(self.task, TASKS)}")
        if int(self.frame_skip) != self.frame_skip:
            raise InputError(f"frame_skip {self.frame_skip:g} is not a whole number of time steps")
        low, high = self.load_range
        if low > high:
            raise InputError(f"load ({low:g}, {high:g}) kg is no range: give the lower end first")
        for name, allowed in _RANGES.items():
            for value in self.load_range if name == "load" else (getattr(self, name),):
                check_value(name, value, allowed)

    @property
    def load_range(self) -> tuple[float, float]:
        """Smallest and largest load [kg]."""
        if isinstance(self.load, int | float):
            return float(self.load), float(self.load)
        return _pair(self.load)

    def loaded_rig(self) -> Rig:
        """The rig, checked to be one that an environment can drive.

        Raises:
            InputError: if it has not two muscles, or as `pamsim.load_rig`.
        """
        rig = self.rig if isinstance(self.rig, Rig) else load_rig(self.rig)
        if len(rig.muscles) != 2 or rig.model.nv != 1:
            raise InputError(
                f"rig {rig.name!r} has {len(rig.muscles)} muscles and {rig.model.nv} degrees of"
                " freedom; the environments drive one joint with two muscles"
            )
        return rig


def arm_settings(options: dict[str, Any]) -> ArmSettings:
    """Options of an environment, checked.

    Raises:
        InputError: for an unknown one, with the nearest name.
        ParameterError: for a number out of range.
    """
    known = ArmSettings.__dataclass_fields__
    for name in options:
        if name not in known:
            raise InputError(f"no option {name!r} of the environment; {nearest(name, known)}")
    return ArmSettings(**options)


def _pair(load: Any) -> tuple[float, float]:
    try:
        low, high = load
        return float(low), float(high)
    except (TypeError, ValueError):
        raise InputError(f"load {load!r}: give a mass in kg, or the ends of a range") from None
