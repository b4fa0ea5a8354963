"""How a parameter of a rig is named, and which muscles have it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
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
    """A parameter's name, taken apart.

    Attributes:
        text: the whole name.
        owner: ``native`` for ``element.name.field`` of the MJCF, ``sensor`` for ``sensor.field``,
            else ``muscle``.
        muscle: the one that it is of, in ``muscle:group.field``; empty for all.
        group: of a parameter of muscles or sensors.
        field: of the group.
        operator: hysteresis operator that it chooses, in ``hysteresis.operator.field``, or empty.
    """

    text: str
    owner: Literal["native", "sensor", "muscle"]
    muscle: str
    group: str
    field: str
    operator: str

    @classmethod
    def parse(cls, text: str) -> ParameterName:
        """Take a name apart; whether a rig has such a parameter is not looked up."""
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


def sensor_spec(field: str, where: str = "") -> FieldSpec:
    """Unit and range of a field of the measurement chain; ``where`` states it, for errors.

    Raises:
        InputError: if there is no such field, with the nearest one.
    """
    fields = dict(specs(MeasurementChain))
    if field not in fields:
        what = f"{where}: unknown sensor." if where else "no parameter sensor."
        raise InputError(f"{what}{field}; {nearest(field, fields)}")
    return fields[field]


def muscles_with(
    name: ParameterName, muscles: Mapping[str, Muscle], native: Iterable[str]
) -> list[tuple[int, str]]:
    """Number and name of the muscle that a parameter is of, or of all that have it.

    A parameter without a muscle passes over those without it: bellows beside muscles have no braid.
    The native parameters that the rig states are near names, for errors.

    Raises:
        InputError: if there is no such muscle or parameter, with the nearest one.
    """
    only = name.muscle
    if only and only not in muscles:
        raise InputError(f"no muscle {only!r}; {nearest(only, muscles)}")
    asked = [(at, one) for at, one in enumerate(muscles) if only in ("", one)]
    found = [one for one in asked if has_parameter(muscles[one[1]], name.parameter)]
    if not found:
        groups = {type(group) for _, one in asked for group in muscles[one].groups}
        known = [f"{group.group}.{part}" for group in groups for part, _ in specs(group)]
        near = nearest(name.text, [*known, *native])
        raise InputError(f"no parameter {name.text!r}; {near}")
    return found
