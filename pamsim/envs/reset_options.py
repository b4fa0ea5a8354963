"""What `reset` may be asked for by ``options``, in place of what an episode draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, check_value
from pamsim.engine.rig import Rig

PRESSURE = FieldSpec(unit="Pa", low=0.0, high=2e6, low_open=False, doc="gauge, at the start")
LOAD = FieldSpec(unit="kg", low=0.0, high=1e3, low_open=False, doc="on the rig")
_POSITION = FieldSpec(unit="rad or m", low=-1e3, high=1e3, low_open=False, doc="of a joint")

NAMES = ("load", "parameters", "start_pressure", "target")


@dataclass(frozen=True, kw_only=True)
class ResetOptions:
    """What is fixed of an episode.

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


def start_pressures(given: float | Mapping[str, float], rig: Rig, usual: float) -> list[float]:
    """Pressure of each muscle from one for all, or from those of some.

    Args:
        given: [Pa], or muscle -> [Pa].
        rig: whose muscles.
        usual: of muscles that are not named [Pa].

    Raises:
        InputError: for an unknown muscle, or a pressure above the supply's.
        ParameterError: for one out of range.
    """
    own = dict(given) if isinstance(given, Mapping) else dict.fromkeys(rig.muscles, given)
    for name, value in own.items():
        if name not in rig.muscles:
            raise InputError(f"start_pressure: no muscle {name!r}; {nearest(name, rig.muscles)}")
        check_value("start_pressure", value, PRESSURE)
        if value > rig.supply_pressure:
            raise InputError(
                f"start_pressure {value / 1e3:g} kPa is above the supply's"
                f" {rig.supply_pressure / 1e3:g} kPa"
            )
    return [float(own.get(name, usual)) for name in rig.muscles]


def reset_options(given: Mapping[str, Any] | None, rig: Rig, usual: float) -> ResetOptions:
    """Options of `reset`, checked.

    Args:
        given: by the caller; None for none.
        rig: of the environment.
        usual: start pressure of its muscles [Pa].

    Raises:
        InputError: for an unknown option, muscle or joint.
        ParameterError: for a number out of range.
    """
    asked = dict(given or {})
    for name in asked:
        if name not in NAMES:
            raise InputError(f"no option {name!r} of reset; {nearest(name, NAMES)}")
    load = asked.get("load")
    if load is not None:
        load = check_value("load", load, LOAD)
    target = dict(asked.get("target") or {})
    for joint, value in target.items():
        if joint not in rig.joints:
            raise InputError(f"target: no joint {joint!r}; {nearest(joint, rig.joints)}")
        check_value(f"target {joint}", value, _POSITION)
    return ResetOptions(
        start_pressure=tuple(start_pressures(asked.get("start_pressure", usual), rig, usual)),
        load=load,
        target=target,
        parameters=dict(asked.get("parameters") or {}),
    )
