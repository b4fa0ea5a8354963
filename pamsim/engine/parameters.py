"""The parameters of a rig: their names, the muscles that have them, values and sources."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from pamsim.core.encoding import INLINE, json_property
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, Sourced, specs
from pamsim.engine.mjcf_fields import is_native, native_field, native_names, native_value
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.record import has_parameter
from pamsim.recordings.sensors import MeasurementChain

if TYPE_CHECKING:
    from pamsim.engine.rig import Rig


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


def muscles_with(name: ParameterName, rig: Rig) -> list[str]:
    """The muscle that a parameter is of, or all that have it: bellows have no braid.

    Raises:
        InputError: if there is no such muscle or parameter, with the nearest one.
    """
    if name.muscle and name.muscle not in rig.muscles:
        raise InputError(f"no muscle {name.muscle!r}; {nearest(name.muscle, rig.muscles)}")
    asked = [name.muscle] if name.muscle else list(rig.muscles)
    found = [one for one in asked if has_parameter(rig.muscles[one], name.parameter)]
    if not found:
        groups = {type(group) for one in asked for group in rig.muscles[one].groups}
        known = [f"{group.group}.{part}" for group in groups for part, _ in specs(group)]
        near = nearest(name.text, [*known, *rig.file.native])
        raise InputError(f"no parameter {name.text!r}; {near}")
    return found


@dataclass(frozen=True, kw_only=True)
class RigParameter:
    """A parameter as `Rig.with_parameters` names it.

    Attributes:
        name: ``group.field``, ``muscle:group.field``, ``hysteresis.operator.field``,
            ``sensor.field`` or a native name.
        value: of the first muscle it belongs to, or of the MJCF field [SI].
        spec: its unit and range.
        source: what ``params.toml`` states, else ``default`` or the name of the MJCF.
        stated: its entry in ``params.toml``, or None where the value is a default or the MJCF's.
    """

    name: str
    value: float
    spec: FieldSpec = field(metadata=INLINE)
    source: str
    stated: Sourced | None

    @json_property
    def range(self) -> str:
        """The allowed range, such as ``(0, 1] m``."""
        return self.spec.range_text()

    @property
    def interval95(self) -> tuple[float, float] | None:
        """The 95 % interval that ``params.toml`` states [SI], or None."""
        if self.stated is None or self.stated.interval95 is None:
            return None
        low, high = (replace(self.stated, value=end) for end in self.stated.interval95)
        return low.si(self.spec.unit), high.si(self.spec.unit)


def rig_parameter(rig: Rig, name: str) -> RigParameter:
    """Find a parameter of a rig.

    Raises:
        InputError: if the rig has none of that name, with the nearest one.
    """
    parsed = ParameterName.parse(name)
    group, part, stated, source = parsed.group, parsed.field, None, "default"
    if parsed.operator:
        other = rig.with_operator(parsed.operator)
        return replace(rig_parameter(other, parsed.without_operator), name=name)
    if parsed.owner == "native":
        value, spec = native_value(rig.model, name), native_field(rig.model, name)
        stated, source = rig.file.native.get(name), rig.file.mjcf.name
    elif parsed.owner == "sensor":
        spec, stated = sensor_spec(part), rig.file.sensor.get(part)
        value = float(getattr(rig.sensor or MeasurementChain(), part))
    else:
        muscle = muscles_with(parsed, rig)[0]
        numbers = getattr(rig.muscles[muscle], group)
        value, spec = float(getattr(numbers, part)), dict(specs(type(numbers)))[part]
        shared, own = rig.file.muscle.get(group, {}), rig.file.overrides[muscle].get(group, {})
        entry = (own if parsed.muscle else {}).get(part) or shared.get(part)
        stated = entry if isinstance(entry, Sourced) else None
    source = stated.source if stated else source
    return RigParameter(name=name, value=value, spec=spec, source=source, stated=stated)


def rig_parameters(rig: Rig) -> Iterator[RigParameter]:
    """Yield every parameter of a rig: of its muscles, its measurement chain and its MJCF.

    A number that is the same in all muscles that have it is named once, ``group.field``; another
    one is named for each, ``muscle:group.field``.
    """
    owners: dict[str, list[RigParameter]] = {}
    for muscle, one in rig.muscles.items():
        for group in one.groups:
            for part, _ in specs(type(group)):
                name = f"{group.group}.{part}"
                owners.setdefault(name, []).append(rig_parameter(rig, f"{muscle}:{name}"))
    for name, found in owners.items():
        same = all(one.value == found[0].value for one in found)
        yield from [replace(found[0], name=name)] if same else found
    names = [f"{MeasurementChain.group}.{part}" for part, _ in specs(MeasurementChain)]
    rods = tuple(f"tendon.{rod}." for rod in rig.file.rods)  # not in the MJCF
    names += [name for name in native_names(rig.model) if not name.startswith(rods)]
    yield from (rig_parameter(rig, name) for name in names)
