"""One parameter of a loaded rig by its name: value, allowed range, and its entry in the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, Sourced, specs
from pamsim.core.units import to_si
from pamsim.engine.native import is_native, native_field, native_names, native_value
from pamsim.engine.rig import Rig, operator_field
from pamsim.physics.record import has_parameter, slot
from pamsim.recordings.sensors import MeasurementChain


@dataclass(frozen=True, kw_only=True)
class RigParameter:
    """A parameter as `Rig.with_parameters` names it.

    Attributes:
        name: ``group.field``, ``muscle:group.field``, ``hysteresis.operator.field``,
            ``sensor.field`` or a native name.
        value: of the first muscle it belongs to, or of the MJCF field [SI].
        spec: its unit and range.
        stated: its entry in ``params.toml``, or None where the value is a default or the MJCF's.
    """

    name: str
    value: float
    spec: FieldSpec
    stated: Sourced | None

    @property
    def interval95(self) -> tuple[float, float] | None:
        """The 95 % interval that ``params.toml`` states [SI], or None."""
        if self.stated is None or self.stated.interval95 is None:
            return None
        low, high = (
            to_si(end, self.stated.unit, self.spec.unit, where=self.stated.where)
            for end in self.stated.interval95
        )
        return low, high


def rig_parameter(rig: Rig, name: str) -> RigParameter:
    """Find a parameter of a rig.

    Raises:
        InputError: if the rig has none of that name, with the nearest one.
    """
    if is_native(name):
        return RigParameter(
            name=name,
            value=native_value(rig.model, name),
            spec=native_field(rig.model, name),
            stated=rig.file.native.get(name),
        )
    law, plain = operator_field(name)
    if law:
        return replace(rig_parameter(rig.with_operator(law), plain), name=name)
    group, _, field = name.partition(".")
    if group == MeasurementChain.group:
        fields = dict(specs(MeasurementChain))
        if field not in fields:
            raise InputError(f"no parameter {name!r}; {nearest(field, fields)}")
        return RigParameter(
            name=name,
            value=float(getattr(rig.sensor or MeasurementChain(), field)),
            spec=fields[field],
            stated=rig.file.sensor.get(field),
        )
    only, _, parameter = name.rpartition(":")
    if only and only not in rig.muscles:
        raise InputError(f"no muscle {only!r}; {nearest(only, rig.muscles)}")
    index, muscle = _owner(rig, only, parameter)
    group, _, field = parameter.partition(".")
    groups = rig.muscles[muscle].groups
    fields = next((dict(specs(type(one))) for one in groups if one.group == group), {})
    if field not in fields:
        known = [f"{one.group}.{field}" for one in groups for field, _ in specs(type(one))]
        raise InputError(f"no parameter {name!r}; {nearest(name, [*known, *rig.file.native])}")
    place = slot(parameter, rig.muscles[muscle])
    shared = rig.file.muscle.get(group, {}).get(field)
    own = rig.file.overrides[muscle].get(group, {}).get(field) if only else None
    stated = own or shared
    return RigParameter(
        name=name,
        value=float(rig.model.actuator_user[index, place]),
        spec=fields[field],
        stated=stated if isinstance(stated, Sourced) else None,
    )


def rig_parameters(rig: Rig) -> Iterator[RigParameter]:
    """Yield every parameter of a rig: of its muscles, its measurement chain and its MJCF.

    A number that is the same in all muscles that have it is named once, ``group.field``; another
    one is named for each, ``muscle:group.field``.
    """
    owners: dict[str, list[RigParameter]] = {}
    for muscle, groups in ((name, one.groups) for name, one in rig.muscles.items()):
        for group in groups:
            for field, _ in specs(type(group)):
                name = f"{group.group}.{field}"
                owners.setdefault(name, []).append(rig_parameter(rig, f"{muscle}:{name}"))
    for name, found in owners.items():
        same = all(one.value == found[0].value for one in found)
        yield from [replace(found[0], name=name)] if same else found
    names = [f"{MeasurementChain.group}.{field}" for field, _ in specs(MeasurementChain)]
    rods = tuple(f"tendon.{rod}." for rod in rig.file.rods)  # not in the MJCF
    names += [name for name in native_names(rig.model) if not name.startswith(rods)]
    yield from (rig_parameter(rig, name) for name in names)


def _owner(rig: Rig, only: str, parameter: str) -> tuple[int, str]:
    """Number and name of the first muscle that has a parameter; of the first of all if none has."""
    places = [(i, name) for i, name in enumerate(rig.muscles) if only in ("", name)]
    having = (place for place in places if has_parameter(rig.muscles[place[1]], parameter))
    return next(having, places[0])
