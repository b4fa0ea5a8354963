"""The parameters of a rig: their values, ranges and sources."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from pamsim.core.encoding import INLINE, json_property
from pamsim.core.parameters import FieldSpec, Sourced, specs
from pamsim.engine.mjcf_fields import native_field, native_names, native_value
from pamsim.engine.parameter_names import ParameterName, muscles_with, sensor_spec
from pamsim.engine.rig import Rig
from pamsim.recordings.sensors import MeasurementChain


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
        spec, stated = sensor_spec(part, rig.joints.values()), rig.file.sensor.get(part)
        value = float(getattr(rig.sensor or MeasurementChain(), part))
    else:
        muscle = muscles_with(parsed, rig.muscles, rig.file.native)[0]
        numbers = getattr(rig.muscles[muscle], group)
        value, spec = float(getattr(numbers, part)), dict(specs(type(numbers)))[part]
        shared, own = rig.file.muscle.get(group, {}), rig.file.overrides[muscle].get(group, {})
        entry = own.get(part) or shared.get(part)
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
    native = (name for name in native_names(rig.model) if not name.startswith(rods))
    names += [name for name in native if name != rig.load_mass]
    yield from (rig_parameter(rig, name) for name in names)


def each_muscle(rig: Rig, values: Mapping[str, float]) -> dict[str, float]:
    """Values of parameters [SI], where muscles differ in one by a name for each.

    `Rig.with_parameters` would make them equal. By what the first muscle's number is multiplied,
    those of the others are; to what is 0 there, as much is added in all.
    """
    shared: dict[str, float] = {}
    own: dict[str, float] = {}
    for name, value in values.items():
        parsed = ParameterName.parse(name)
        if parsed.owner != "muscle" or parsed.muscle or parsed.operator:
            own[name] = value
            continue
        found = {
            muscle: float(getattr(getattr(rig.muscles[muscle], parsed.group), parsed.field))
            for muscle in muscles_with(parsed, rig.muscles, rig.file.native)
        }
        first = next(iter(found.values()))
        if all(one == first for one in found.values()):
            shared[name] = value
        else:
            shared |= {
                f"{muscle}:{name}": one * (value / first) if first else one + value
                for muscle, one in found.items()
            }
    return shared | own
