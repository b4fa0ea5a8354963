"""The effects of the catalog on a given rig: ranges, probes and starts of their parameters."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pamsim.comparison.candidate import Candidate, Probe, inside
from pamsim.core.catalog import installed
from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, refuse_unknown
from pamsim.effects.catalog import FORMS, TRIAL_EFFECTS, look_up
from pamsim.effects.effect import AT, JOINT, SECOND_MUSCLE, TILTED, Effect, EffectParameter
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import RigParameter, rig_parameter
from pamsim.engine.rig import Rig, load_rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.recordings.rig_file import EFFECTS
from pamsim.recordings.sensors import MeasurementChain


def rig_name(rig: Rig, name: str) -> str:
    """Name of a parameter on a rig, its placeholders (see `pamsim.effects.effect`) filled in.

    Raises:
        InputError: if the rig has no such part, or several.
    """
    if JOINT in name:
        if len(rig.joints) > 1:
            each = " or ".join(f"'EFFECT{AT}{joint}'" for joint in rig.joints)
            raise InputError(f"rig {rig.name!r} has several joints: write {each}")
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
            raise InputError(f"rig {rig.name!r} has a single muscle; this effect needs two")
        name = name.replace(SECOND_MUSCLE, list(rig.muscles)[1])
    return name


def forms(rig: Rig | None) -> dict[str, tuple[Effect, ...]]:
    """Name -> its forms: the package's effects, those of installed packages, and a rig's own.

    A form that is added to an effect of the package is tried after the package's.

    Raises:
        InputError: if an installed package offers something else, or a form exists twice.
    """
    known = dict(FORMS)
    own = [] if rig is None else [(e, str(rig.file.folder / EFFECTS)) for e in rig.file.own.effects]
    for one, where in (*installed("pamsim.effects"), *own):
        if not isinstance(one, Effect):
            raise InputError(f"{where}: {one!r} is no pamsim.effects.effect.Effect")
        others = known.get(one.name, ())
        if one.form in [other.form for other in others]:
            raise InputError(
                f"{where}: the effect {one.label!r} exists already; rename it, or give its form"
                " another name"
            )
        known[one.name] = (*others, one)
    return known


def rig_effect(rig: Rig, name: str) -> Effect:
    """Look an effect up, also at one joint or muscle of a rig: ``air_leak at biceps``.

    Raises:
        InputError: if there is none of that name or form, the rig has no such joint or muscle, or
            the effect does not act there.
    """
    common, _, place = name.partition(AT)
    found = look_up(common, forms(rig))
    if not place:
        return found
    what = f"{name}: rig {rig.name!r} has no such joint or muscle"
    refuse_unknown(place, [*rig.joints, *rig.muscles], what)
    return _at(rig, found, place)


def _at(rig: Rig, found: Effect, place: str) -> Effect:
    """An effect at one joint or muscle of a rig."""
    parameters: list[EffectParameter] = []
    at_joint = place in rig.joints
    for parameter in found.parameters:
        own = parameter.name.rpartition(":")[2]
        of_muscle = ParameterName.parse(own).owner == "muscle"
        if not (JOINT in own if at_joint else of_muscle):
            what = "joint" if at_joint else "muscle"
            raise InputError(f"{found.name} does not act on a {what}: it changes {own}")
        name = own.replace(JOINT, place) if at_joint else f"{place}:{own}"
        parameters.append(replace(parameter, name=name))
    if len({parameter.name for parameter in parameters}) < len(parameters):
        raise InputError(f"{found.label} acts on two muscles together, not on one")
    return replace(found, place=place, parameters=tuple(parameters))


def places(rig: Rig, found: Effect) -> tuple[str, ...]:
    """Joints or muscles of a rig at each of which an effect is a cause of its own.

    The only name is empty where the rig has a single place for the effect, or the effect acts on
    all of them together.
    """
    names = " ".join(parameter.name for parameter in found.parameters)
    if JOINT in names and len(rig.joints) > 1:
        return tuple(rig.joints)
    if SECOND_MUSCLE in names and len(rig.muscles) > 2:
        return tuple(rig.muscles)
    return ("",)


def _on_rig(rig: Rig, parameter: EffectParameter) -> tuple[EffectParameter, RigParameter]:
    """A parameter of an effect with its range on a rig, and the rig's own."""
    own = rig_parameter(rig, rig_name(rig, parameter.name))
    if parameter.unit and own.spec.unit != parameter.unit:
        raise InputError(
            f"{own.name} of this rig's force law is in {own.spec.unit}, not {parameter.unit}"
        )
    if parameter.scaled_by:
        muscle = ParameterName.parse(own.name).muscle
        scale = f"{muscle}:{parameter.scaled_by}" if muscle else parameter.scaled_by
        parameter = parameter.scaled(rig_parameter(rig, scale).value)
    elif parameter.on_slide != 1.0 and rig.joints[own.name.split(".")[1]] == "position":
        parameter = parameter.scaled(parameter.on_slide)
    return parameter, own


def at_size(rig: Rig, effect: Effect, size: float) -> dict[str, float]:
    """Rig parameters of an effect at a size, in units of its typical one; 0 is neutral.

    The rig's own values are where it starts from.

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
    if effect.crossed:
        axes = [[(r.name, value) for value in (p.typical, *p.starts)] for p, r in parts if p.shape]
        variants = [dict(shape) for shape in itertools.product(*axes)]
    else:
        variants += [{r.name: value} for p, r in parts if p.shape for value in p.starts]
    probes: list[Probe] = []
    for number, size in enumerate(effect.probes):
        # Other shapes are tried at one size only: the shape shows at any size.
        for variant in variants if number == 0 else variants[:1]:
            values = inside(free, {**_away(rig, effect, size, neutral), **variant})
            shape = tuple(values[name] for name in shapes)
            probes.append(Probe(size=size, values=values, shape=shape))
    return Candidate(effect=effect, parameters=free, neutral=neutral, probes=tuple(probes))


def _away(rig: Rig, effect: Effect, size: float, neutral: Mapping[str, float]) -> dict[str, float]:
    """An effect at a size, or at its negative where the rig lies at the end of the range."""
    there, back = (at_size(rig, effect, sign * size) for sign in (1.0, -1.0))
    first = next(iter(neutral))
    moved, otherwise = (abs(values[first] - neutral[first]) for values in (there, back))
    return back if moved < 0.5 * otherwise else there


def candidates(
    rig: Rig, names: Sequence[str] = (), without: Sequence[str] = ()
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """The effects that can be tried on a rig, the usual form of each first, and why others are not.

    They are ``names`` of effects, as `rig_effect` takes them, without a form for all forms; if left
    out, all that recordings are searched for. Effects ``without`` which are left out in all forms.

    Raises:
        InputError: for a name that is not known, or if nothing is left to try.
    """
    tried: dict[str, Candidate] = {}
    skipped: dict[str, str] = {}
    known = forms(rig)
    own = [name for name in known if name not in FORMS and known[name][0].in_trials]
    for name in without:
        look_up(name, known)
        if name not in known:
            raise InputError(
                f"`without` leaves out whole effects, not one form or place of them: {name!r}; give"
                f" {name.partition(AT)[0].partition(':')[0]!r}"
            )
    chosen = [name for name in names or (*TRIAL_EFFECTS, *own) if name not in without]
    if not chosen:
        raise InputError("`without` leaves no effect to try; name fewer, or others in `effects`")
    for name in chosen:
        look_up(name, known)
        for label in _labels(rig, name, known):
            try:
                one = candidate(rig, rig_effect(rig, label))
            except InputError as error:
                # What else there is helps who wrote a name, not who reads a list.
                skipped.setdefault(name, re.sub(r"; (known:|did you mean).*", "", str(error)))
                continue
            usual = all(other.name != one.name for other in tried.values())
            # Of a further form the shape counts, which shows at one size.
            probes = [p for p in one.probes if usual or p.size == one.effect.probes[0]]
            tried.setdefault(
                one.label,
                replace(one, usual=usual, probes=tuple(probes)),
            )
    found = {name for one in tried.values() for name in (one.name, one.effect.name)}
    left_out = dict.fromkeys(without, "left out on request")
    return tuple(tried.values()), {
        **{n: why for n, why in skipped.items() if n not in found},
        **left_out,
    }


def _labels(rig: Rig, name: str, known: Mapping[str, tuple[Effect, ...]]) -> list[str]:
    """An effect in each of its forms and at each of its places, as `rig_effect` takes them."""
    plain, _, place = name.partition(AT)
    own_forms = known.get(plain) or (look_up(plain, known),)
    bound = [
        replace(f, place=own) for f in own_forms for own in ([place] if place else places(rig, f))
    ]
    return [one.label for one in bound]


def _free(parameter: EffectParameter, own: RigParameter) -> FreeParameter:
    low, high = sorted(parameter.bounds(own.value))
    low, high = max(low, own.spec.low), min(high, own.spec.high)
    if own.spec.low_open and low <= own.spec.low:
        low = own.spec.low + 1e-6 * (high - own.spec.low)
    start = min(max(parameter.at(1.0, own.value), low), high)
    return FreeParameter(
        name=own.name, unit=own.spec.unit, start=start, low=low, high=high, scale="linear"
    )


@dataclass(frozen=True, kw_only=True)
class MovableEffects:
    """Effects that change how a rig moves, in their usual form; errors of sensors do not."""

    rig: Rig  # as it is
    effects: Mapping[str, Effect]  # name, with its place if there are several -> effect
    sizes: Mapping[str, float]  # name -> what the rig has of it, in units of its typical size

    def at(self, sizes: Mapping[str, float]) -> Rig:
        """The rig with effects at other sizes, name -> size; 0 is without."""
        values: dict[str, float] = {}
        for name, size in sizes.items():
            if size != self.sizes[name]:
                values |= at_size(self.rig, self.effects[name], size)
        return self.rig.with_parameters(values)


def movable_effects(rig: Rig, names: Sequence[str] = ()) -> MovableEffects:
    """Effects of a rig that can be moved while it is simulated.

    Names are as `rig_effect` takes them, all if left out; InputError for one that is not known.
    """
    effects: dict[str, Effect] = {}
    sizes: dict[str, float] = {}
    for one in candidates(rig, names)[0]:
        name, typical = next(iter(at_size(rig, one.effect, 1.0).items()))
        if name.startswith(f"{MeasurementChain.group}.") or not one.usual:
            continue
        neutral = at_size(rig, one.effect, 0.0)[name]
        effects[one.name] = one.effect
        has = rig_parameter(rig, name).value - neutral
        sizes[one.name] = has / (typical - neutral) if has else 0.0
    return MovableEffects(rig=rig, effects=effects, sizes=sizes)


def effect_cards(
    name: str | None = None, rig: str | os.PathLike[str] | None = None
) -> dict[str, Any]:
    """Describe all effects, or the one of a name.

    Of a ``rig``, the name of a shipped one or a rig folder, its own effects are listed as well.

    Returns:
        JSON-safe mapping ``effects``: name, form, link, family, what a model without it is missing,
        equation, parameters, look-alikes and the experiment that separates them; with a rig also
        the joints or muscles that it is tried at, and why it cannot be tried.

    Raises:
        InputError: for an unknown name, with the nearest, or an unknown rig.
    """
    loaded = None if rig is None else load_rig(rig)
    known = forms(loaded)
    chosen = known.values() if name is None else [known[look_up(name, known).name]]
    cards = [_card(one, loaded) for each in chosen for one in each]
    return to_dict({"schema": "pamsim-effects/1", "effects": cards})


def _card(one: Effect, rig: Rig | None) -> dict[str, Any]:
    card: dict[str, Any] = {
        "name": one.name,
        "form": one.form,
        "link": one.link,
        "family": one.family,
        "missing": one.missing,
        "equation": one.equation,
        "parameters": [parameter.name for parameter in one.parameters],
        "look_alikes": one.look_alikes,
        "separating": one.separating,
    }
    if rig is None:
        return card
    try:
        candidate(rig, one)
    except InputError as error:
        return {**card, "places": [], "not_tried": str(error)}
    return {**card, "places": [p for p in places(rig, one) if p], "not_tried": None}
