"""Which parameters of a rig a calibration frees, within which range, from which knowledge."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pamsim.comparison.effects_on_rig import candidate, rig_effect
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import Sourced
from pamsim.core.units import parse_quantity, to_si
from pamsim.effects.effect import AT
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import RigParameter, rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.estimate import NORMAL95
from pamsim.inference.free_parameter import FreeParameter, Prior, Scale

FACTOR = 5.0
"""Where nothing states a range, a positive number may change by this factor either way, and one of
either sign by this many times its size or the half-width of its stated 95 % interval."""

_WIDE = 2.0  # from this ratio of its ends on, a range of positive numbers is searched in proportion

MOST_BY_DEFAULT = 8  # more would take long, and few data show as many

Bounds = tuple[float | str, float | str]
"""Lower and upper end of a range: numbers [SI], or texts with a unit."""

# How hard the muscles pull and push back, how wide the loops are, how fast the air flows each way,
# what damps the joint: what a recording of valves, angle and pressures shows of most rigs.
_MOVING = (
    "force.scale",
    "passive.stiffness",
    "passive.locking",
    "hysteresis.force_per_pressure",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
)
_FIRST = (
    "force.scale",
    "passive.stiffness",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
    "chamber.dead_volume",
)
_LENGTH = "mounting.length_at_zero"
_FRICTION = "frictionloss"
# Without forces measured, the size of all forces together shows at rest by the load alone.
_AT_REST = ("passive.stiffness", "passive.locking")


@dataclass(frozen=True, kw_only=True)
class FreedParameter:
    """One number that the fit moves, and every parameter of the rig that takes it."""

    names: tuple[str, ...]  # parameters that take it, the one it is named after first
    free: FreeParameter  # its range, scale, start and prior, for the search
    before: RigParameter  # the rig's parameter it is named after
    range_source: str  # where its range comes from

    @property
    def name(self) -> str:
        """Name of the parameter it is named after."""
        return self.names[0]

    @property
    def written_unit(self) -> str:
        """Unit the rig's file has it in; SI if the file does not state it."""
        return self.before.stated.unit if self.before.stated else self.before.spec.unit

    def written(self, value: float) -> float:
        """A value [SI] in the unit of the rig's file."""
        return to_si(value, self.before.spec.unit, self.written_unit, where=self.name)


def rig_values(freed: Sequence[FreedParameter], values: Sequence[float]) -> dict[str, float]:
    """Values (p,) of freed parameters under the names of the rig's parameters [SI]."""
    pairs = zip(freed, values, strict=True)
    return {name: float(value) for one, value in pairs for name in one.names}


def default_names(rig: Rig, *, moving: bool) -> tuple[str, ...]:
    """Parameters to free where the user names none, `MOST_BY_DEFAULT` at most.

    Those that such data show of most rigs, as far as the rig's file states them and they are not 0;
    then what the file calls identified, for it was open before. Data are ``moving`` if there are
    recordings; angles at rest show neither flows nor damping.

    Raises:
        InputError: if the rig states none of them.
    """
    stated = _stated(rig)
    joints = [f"joint.{joint}.damping" for joint in rig.joints]
    usual = (*_MOVING, *joints) if moving else _AT_REST
    open_before = [
        name
        for name, entry in stated.items()
        if isinstance(entry, Sourced)
        and entry.source.startswith("identified")
        and (moving or not (name.startswith("valve.") or name.endswith(".damping")))
    ]
    chosen = [
        name
        for name in dict.fromkeys((*usual, *open_before))
        if name in stated and rig_parameter(rig, name).value != 0.0
    ]
    if not chosen:
        raise InputError(
            f"rig {rig.name!r} states none of the parameters that are freed by default"
            f" ({', '.join(usual)}); name some with `free`"
        )
    return tuple(chosen[:MOST_BY_DEFAULT])


def first_names(rig: Rig) -> tuple[str, ...]:
    """Parameters to free where a rig's file may be far off: what is seldom measured apart.

    How long each muscle is mounted, how hard muscles pull and push back, what damps and brakes each
    joint, and how the air flows into which volume, as far as the rig's file states them.
    """
    stated = _stated(rig)
    each = [f"{m}:{_LENGTH}" for m in _braided(rig)]  # those of bellows lie between their pins
    lengths = each if len(rig.muscles) > 1 else [_LENGTH] * len(each)
    known = [name for name in _FIRST if name in stated]
    damping = [f"joint.{joint}.damping" for joint in rig.joints]
    usual = [name for name in (*known, *damping) if rig_parameter(rig, name).value != 0.0]
    return (*lengths, *usual, *(f"joint.{joint}.{_FRICTION}" for joint in rig.joints))


def _braided(rig: Rig) -> list[str]:
    return [name for name, muscle in rig.muscles.items() if muscle.braid is not None]


def _stated(rig: Rig) -> dict[str, Sourced | str]:
    """What a rig's file states of all muscles and of its MJCF."""
    groups = rig.file.muscle.items()
    shared = {f"{group}.{k}": v for group, part in groups for k, v in part.items()}
    return {**shared, **rig.file.native}


def freed_parameters(
    rig: Rig,
    wanted: Sequence[str],
    *,
    bounds: Mapping[str, Bounds] | None = None,
    prior: bool = False,
) -> tuple[FreedParameter, ...]:
    """Look the parameters to free up and give each its range.

    Args:
        rig: to calibrate.
        wanted: names as `Rig.with_parameters` has them; ``a=b`` makes one number of both. The fit
            of a number that muscles differ in, or that was several, starts at the first of them.
        bounds: name -> (low, high), each a number [SI] or a text such as ``5 cm^3``, which is in
            the unit of the rig's file if it carries none. Otherwise the range is what the file
            states, and without that `FACTOR` around the value.
        prior: take the 95 % intervals of the rig's file as prior knowledge.

    Raises:
        InputError: for an unknown or doubled name, bounds of a parameter that is not free, a range
            that cannot be read or found, or one number of two units.
        ParameterError: for a range that is empty or leaves the present value out.
    """
    given = dict(bounds or {})
    freed: list[FreedParameter] = []
    for group in wanted:
        names = tuple(name.strip() for name in group.split("="))
        parameters = [rig_parameter(rig, name) for name in names]
        units = {parameter.spec.unit for parameter in parameters}
        if len(units) > 1:
            raise InputError(f"`free` {group}: one number cannot be both {' and '.join(units)}")
        for name, other in itertools.product(names, (n for one in freed for n in one.names)):
            if name == other or other.endswith(f":{name}") or name.endswith(f":{other}"):
                raise InputError(
                    f"`free` {name}: {other} is free already, which sets the same number"
                )
        limits = [given.pop(name) for name in names if name in given]
        if len(limits) > 1:
            raise InputError(f"`bounds` of {group}: one number has one range; give it once")
        freed.append(_freed(rig, names, parameters, limits[0] if limits else None, prior))
    if given:
        known = [name for parameter in freed for name in parameter.names]
        unknown = next(iter(given))
        raise InputError(f"`bounds` of {unknown}: it is not free; {nearest(unknown, known)}")
    return tuple(freed)


def _freed(
    rig: Rig,
    names: tuple[str, ...],
    parameters: Sequence[RigParameter],
    limits: Bounds | None,
    prior: bool,
) -> FreedParameter:
    first, spec = parameters[0], parameters[0].spec
    low, high, source = _range(rig, first, limits)
    low = max(low, *(parameter.spec.low for parameter in parameters))
    high = min(high, *(parameter.spec.high for parameter in parameters))
    in_proportion = low > 0.0 and high > _WIDE * low
    scale: Scale = "log" if in_proportion else "linear"
    free = FreeParameter(
        name=first.name,
        unit=spec.unit,
        start=first.value,
        low=low,
        high=high,
        scale=scale,
        prior=_prior(first) if prior else None,
    )
    return FreedParameter(names=names, free=free, before=first, range_source=source)


def _range(rig: Rig, parameter: RigParameter, limits: Bounds | None) -> tuple[float, float, str]:
    spec, stated, value = parameter.spec, parameter.stated, parameter.value
    unit = stated.unit if stated else spec.unit
    if limits is not None:
        where = f"`bounds` of {parameter.name}"
        if len(limits) != 2:
            raise InputError(f"{where}: {len(limits)} numbers; give a low and a high one")
        low, high = (
            parse_quantity(end, unit, spec.unit, where=where) if isinstance(end, str) else end
            for end in limits
        )
        return low, high, "given"
    if stated and stated.bounds:
        low, high = (to_si(end, unit, spec.unit, where=stated.where) for end in stated.bounds)
        return low, high, "bounds of params.toml"
    if (range_ := _of_effect(rig, parameter)) is not None:
        return range_
    if value == 0.0:
        if ParameterName.parse(parameter.name).owner == "native":
            raise InputError(
                f"{parameter.name} is 0 in the rig, from which no range can be guessed; give"
                f" one with `bounds` [{spec.unit}]"
            )
        return spec.low, spec.high, "whole allowed range, because it is 0"
    if spec.low >= 0.0:
        return value / FACTOR, value * FACTOR, f"a factor {FACTOR:g} either way"
    known = parameter.interval95
    reach = FACTOR * max(abs(value), 0.5 * (known[1] - known[0]) if known else 0.0)
    return (
        value - reach,
        value + reach,
        f"{FACTOR:g} times its value or its stated uncertainty, added and subtracted",
    )


def _of_effect(rig: Rig, parameter: RigParameter) -> tuple[float, float, str] | None:
    """Range of a parameter whose value does not show it, as of the effect that changes it."""
    name, braided = ParameterName.parse(parameter.name), _braided(rig)
    if name.parameter == _LENGTH and (name.muscle in braided if name.muscle else braided):
        effect, place = "rest_length", name.muscle
    elif parameter.value == 0.0 and name.parameter.endswith(f".{_FRICTION}"):
        effect, joint = "coulomb_friction", parameter.name.split(".")[1]
        place = joint if len(rig.joints) > 1 else ""
    else:
        return None
    (free,) = candidate(rig, rig_effect(rig, effect + (place and f"{AT}{place}"))).parameters
    return free.low, free.high, f"range of the effect {effect}"


def _prior(parameter: RigParameter) -> Prior | None:
    known = parameter.interval95
    if known is None or parameter.stated is None:
        return None
    return Prior(
        mean=parameter.value,
        standard_deviation=(known[1] - known[0]) / (2.0 * NORMAL95),
        source=f"95 % interval in params.toml ({parameter.stated.source})",
    )
