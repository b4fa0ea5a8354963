"""Names of a rig's parameters, and the muscles that have them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, specs
from pamsim.engine.mjcf_fields import is_native
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import has_parameter
from pamsim.recordings.sensors import MeasurementChain


@dataclass(frozen=True)
class ParameterName:
    """A parameter's name, taken apart; whether a rig has such a parameter is not looked up."""

    text: str
    owner: Literal["native", "sensor", "muscle"]  # native: ``element.name.field`` of the MJCF
    muscle: str  # of ``muscle:group.field``; empty for all
    group: str
    field: str
    operator: str  # of ``hysteresis.operator.field``, the hysteresis that it chooses; or empty

    @classmethod
    def parse(cls, text: str) -> ParameterName:
        """Take a name apart."""
        native = is_native(text)
        muscle, _, parameter = ("", "", text) if native else text.rpartition(":")
        group, _, part = parameter.partition(".")
        owner = "sensor" if text.startswith(f"{MeasurementChain.group}.") else "muscle"
        operator = ""
        if group == Hysteresis.group and part.count(".") == 1:
            operator, _, part = part.partition(".")
        return cls(text, "native" if native else owner, muscle, group, part, operator)

    @property
    def parameter(self) -> str:
        """``group.field``, or the native name."""
        return f"{self.group}.{self.field}"

    @property
    def without_operator(self) -> str:
        """The name in a rig that has the operator already."""
        return f"{self.muscle}:{self.parameter}" if self.muscle else self.parameter


def sensor_specs(joints: Iterable[str]) -> dict[str, FieldSpec]:
    """Fields of the measurement chain of a rig whose joints have these kinds -> unit and range.

    What is in radians is in metres where every joint slides: the same numbers apply to any joint.
    """
    fields = dict(specs(MeasurementChain))
    if "angle" in joints:
        return fields
    return {name: replace(one, unit=one.unit.replace("rad", "m")) for name, one in fields.items()}


def sensor_spec(field: str, joints: Iterable[str], where: str = "") -> FieldSpec:
    """Unit and range of one of `sensor_specs`; ``where`` states it, for errors.

    Raises:
        InputError: if there is no such field, with the nearest one.
    """
    fields = sensor_specs(joints)
    if field not in fields:
        what = f"{where}: unknown sensor." if where else "no parameter sensor."
        raise InputError(f"{what}{field}; {nearest(field, fields)}")
    return fields[field]


def muscles_with(
    name: ParameterName, muscles: Mapping[str, Muscle], native: Iterable[str]
) -> list[str]:
    """The muscle that a parameter is of, or all that have it: bellows have no braid.

    Native names that the rig states are what a mistyped name may have meant as well.

    Raises:
        InputError: if there is no such muscle or parameter, with the nearest one.
    """
    if name.muscle and name.muscle not in muscles:
        raise InputError(f"no muscle {name.muscle!r}; {nearest(name.muscle, muscles)}")
    asked = [name.muscle] if name.muscle else list(muscles)
    found = [one for one in asked if has_parameter(muscles[one], name.parameter)]
    if not found:
        groups = {type(group) for one in asked for group in muscles[one].groups}
        known = [f"{group.group}.{part}" for group in groups for part, _ in specs(group)]
        near = nearest(name.text, [*known, *native])
        raise InputError(f"no parameter {name.text!r}; {near}")
    return found
