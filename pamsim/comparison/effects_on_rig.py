"""The effects of the catalog on a given rig: ranges, probes and starts of their parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pamsim.comparison.candidate import Candidate, Probe, inside
from pamsim.core.errors import InputError
from pamsim.effects.catalog import FORMS, TRIAL_EFFECTS, effect
from pamsim.effects.effect import JOINT, SECOND_MUSCLE, TILTED, Effect, EffectParameter
from pamsim.engine.native import is_native
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import RigParameter, rig_parameter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.signals.sensors import MeasurementChain


def rig_name(rig: Rig, name: str) -> str:
    """Name of a parameter on a rig, its placeholders (see `pamsim.effects.effect`) filled in.

    Raises:
        InputError: if the rig has no such part.
    """
    name = name.replace(JOINT, rig.only_joint)
    if TILTED in name:
        tilted = [n.split(".")[1] for n in rig.file.native if n.endswith(".tilt")]
        if not tilted:
            raise InputError(
                f"{rig.name}: no body's tilt is stated; add body.NAME.tilt under [native]"
            )
        name = name.replace(TILTED, tilted[0])
    if SECOND_MUSCLE in name:
        if len(rig.muscles) < 2:
            raise InputError(f"{rig.name} has a single muscle")
        name = name.replace(SECOND_MUSCLE, list(rig.muscles)[1])
    return name


def rig_effect(rig: Rig, name: str) -> Effect:
    """Look an effect up, also on one muscle of a rig: ``rest_length:muscle_1``.

    Raises:
        InputError: if there is none of that name or form, or it does not act on muscles.
    """
    plain, _, muscle = name.partition(":")
    if muscle not in rig.muscles:
        return effect(name)
    common = effect(plain)
    parameters: list[EffectParameter] = []
    for parameter in common.parameters:
        own = parameter.name.rpartition(":")[2]
        if is_native(own) or own.startswith(f"{MeasurementChain.group}."):
            raise InputError(f"{plain} does not act on a muscle: {own} is a number of the rig")
        parameters.append(replace(parameter, name=f"{muscle}:{own}"))
    return replace(common, form=muscle, parameters=tuple(parameters))


def _on_rig(rig: Rig, parameter: EffectParameter) -> tuple[EffectParameter, RigParameter]:
    """A parameter of an effect with its range on a rig, and the rig's own."""
    own = rig_parameter(rig, rig_name(rig, parameter.name))
    if parameter.unit and own.spec.unit != parameter.unit:
        raise InputError(
            f"{own.name} of this rig's force law is in {own.spec.unit}, not {parameter.unit}"
        )
    if parameter.scaled_by:
        parameter = parameter.scaled(rig_parameter(rig, parameter.scaled_by).value)
    return parameter, own


def at_size(rig: Rig, effect: Effect, size: float) -> dict[str, float]:
    """Rig parameters of an effect at a size.

    Args:
        rig: without it, or with; its own values are where it starts from.
        effect: which.
        size: in units of its typical size; 0 is neutral.

    Raises:
        InputError: if the rig does not have what the effect acts on.
    """
    values: dict[str, float] = {}
    for parameter, own in (_on_rig(rig, p) for p in effect.parameters):
        value = parameter.at(size, own.value)
        values[own.name] = min(max(value, own.spec.low), own.spec.high)
    return values


def candidate(rig: Rig, effect: Effect) -> Candidate:
    """An effect as a candidate for what a rig's model is missing.

    Raises:
        InputError: if the rig does not have what the effect acts on.
    """
    parts = [_on_rig(rig, p) for p in effect.parameters]
    free = tuple(_free(p, r) for p, r in parts)
    neutral = {
        r.name: r.value if p.neutral is None or p.relative else p.neutral
        for p, r in parts
        if not p.shape
    }
    shapes = [r.name for p, r in parts if p.shape]
    variants: list[dict[str, float]] = [{}]
    variants += [{r.name: value} for p, r in parts if p.shape for value in p.starts]
    probes: list[Probe] = []
    for number, size in enumerate(effect.probes):
        # Other shapes are tried at one size only: the shape shows at any size.
        for variant in variants if number == 0 else variants[:1]:
            values = inside(free, {**at_size(rig, effect, size), **variant})
            shape = tuple(values[name] for name in shapes)
            probes.append(Probe(size=size, values=values, shape=shape))
    return Candidate(effect=effect, parameters=free, neutral=neutral, probes=tuple(probes))


def candidates(rig: Rig, names: Sequence[str] = ()) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """The effects that can be tried on a rig.

    Args:
        rig: its model.
        names: of effects, as `rig_effect` takes them, without a form for all forms; if left out,
            all that recordings are searched for.

    Returns:
        The effects in all of their forms that the rig can have, the usual form of each first, and
        why others cannot be tried.
    """
    tried: dict[str, Candidate] = {}
    skipped: dict[str, str] = {}
    for name in names or TRIAL_EFFECTS:
        labels = [f"{name}:{e.form}" for e in FORMS[name]] if len(FORMS.get(name, ())) > 1 else []
        for label in labels or [name]:
            try:
                one = candidate(rig, rig_effect(rig, label))
            except InputError as error:
                skipped.setdefault(name, str(error))
                continue
            usual = all(other.name != one.name for other in tried.values())
            # Of a further form the shape counts, which shows at one size.
            probes = [p for p in one.probes if usual or p.size == one.effect.probes[0]]
            tried.setdefault(
                one.label,
                replace(one, usual=usual, asked_for=bool(names), probes=tuple(probes)),
            )
    found = {one.name for one in tried.values()}
    return tuple(tried.values()), {n: why for n, why in skipped.items() if n not in found}


def _free(parameter: EffectParameter, own: RigParameter) -> FreeParameter:
    low, high = sorted(parameter.bounds(own.value))
    low, high = max(low, own.spec.low), min(high, own.spec.high)
    if own.spec.low_open and low <= own.spec.low:
        low = own.spec.low + 1e-6 * (high - own.spec.low)
    start = min(max(parameter.at(1.0, own.value), low), high)
    return FreeParameter(
        name=own.name, unit=own.spec.unit, start=start, low=low, high=high, scale="linear"
    )
