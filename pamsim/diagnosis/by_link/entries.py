"""What a diagnosis by link has found, in the units of the rig's file."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pamsim.comparison.chain_runs import in_link, plain
from pamsim.comparison.links import JOINT, MUSCLE, PARTS, VALVES, Link
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.units import COMMON, FloatArray, to_si
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.effect_entry import (
    EffectEntry,
    InsteadEntry,
    RivalEntry,
    SizeEntry,
    SuspectEntry,
)
from pamsim.diagnosis.by_link.judged import Instead, Judged
from pamsim.diagnosis.by_link.limits import nothing_material
from pamsim.diagnosis.by_link.link_fit import PRIOR, LinkModel
from pamsim.diagnosis.by_link.result import LinkEntry, NuisanceEntry
from pamsim.diagnosis.by_link.sizes import Size
from pamsim.diagnosis.fitted_rig import stated
from pamsim.diagnosis.physical_size import Fitted, physical_sizes
from pamsim.effects.effect import LINK_OF_GROUP, LINKS
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.projection import as_columns, orthonormal, project_out

_FAR = 2.0  # standard deviations of `PRIOR`, beyond which one value in twenty lies

_PARTS = {"air": (VALVES,), "transmission": (JOINT,), "joint": (JOINT,), "sensor": PARTS}
"""Link that a group of parameters acts in -> parts of the chain; other groups are of muscles."""


def link_entries(found: LinkDiagnosis) -> tuple[LinkEntry, ...]:
    """The gap of every link, before and after."""
    return tuple(
        LinkEntry(
            link=link.name,
            signals=link.ends,
            before=found.before[link],
            after=found.after[link],
            left=left.excess,
            p_value=left.p_value,
            more_left=None if left.undecided else left.counts,
        )
        for link in found.links
        for left in [found.unexplained[link]]
    )


def effect_entries(rig: Rig | None, found: LinkDiagnosis) -> tuple[EffectEntry, ...]:
    """Every effect with its size and rivals, the largest gain first; of a loop without a rig."""
    names = [p.name for effect in found.model.effects for p in effect.parameters]
    fitted = Fitted(
        values=chain_values(found, found.model),
        intervals={name: size.interval95 for name, size in found.sizes.items()},
        parameters=names,
        jacobian=_beside_nuisance(found.model, names),
    )
    return tuple(_effect(rig, found, fitted, one) for one in found.effects)


def suspect_entries(rig: Rig | None, found: LinkDiagnosis) -> tuple[SuspectEntry, ...]:
    """Effects that may be there where something is left, none of them certain."""
    if nothing_material(found.unexplained.values()):
        return ()
    return tuple(
        SuspectEntry(
            effect=one.label,
            missing=one.effect.missing,
            sizes={p.name: _size(rig, p, found.sizes[p.name]) for p in one.parameters},
        )
        for one in found.suspected
    )


def nuisance_entries(
    rig: Rig, found: LinkDiagnosis, names: Collection[str]
) -> tuple[NuisanceEntry, ...]:
    """Parameters that were refitted, in each link and for the whole rig."""
    whole = chain_values(found, found.model)
    return tuple(
        NuisanceEntry(
            parameter=name,
            unit=readable_unit(own),
            stated=readable(own, own.value),
            by_link={
                link.name: readable(own, value)
                for link, value in link_values(found, found.model, name).items()
            },
            whole=readable(own, whole.get(name, own.value)),
        )
        for name, own in ((name, stated(rig, name)) for name in names)
    )


def far_from_stated(nuisance: Collection[NuisanceEntry]) -> tuple[str, ...]:
    """Sentences about refitted parameters that ended farther off than a rig is likely to be.

    A dead volume of twice its size fills like a narrow valve: such a value may hide an effect.
    """
    return tuple(
        f"{one.parameter} was refitted to {one.whole / one.stated:.2g} times what the rig states:"
        " measure it and state it, or leave it out of the nuisance parameters to see which effect"
        " takes its place"
        for one in nuisance
        if abs(one.whole - one.stated) > _FAR * PRIOR * abs(one.stated) > 0.0
    )


def _effect(rig: Rig | None, found: LinkDiagnosis, fitted: Fitted, one: Judged) -> EffectEntry:
    effect = one.effect.effect
    sizes = {p.name: _size(rig, p, found.sizes[p.name]) for p in one.effect.parameters}
    return EffectEntry(
        effect=effect.label,
        name=effect.name,
        form=effect.form,
        place=effect.place or LINKS[effect.link],
        family=effect.family,
        level=one.level(),
        certain=one.certain(),
        exact=one.exact,
        left=_left(found, one.links),
        links=tuple(link.name for link in found.links if link in one.links),
        share=one.share,
        p_value=one.p_value,
        missing=effect.missing,
        sizes=sizes,
        physical={} if rig is None else physical_sizes(rig, fitted, one.effect),
        rivals=tuple(
            RivalEntry(
                effect=rival.effect.label,
                family=rival.effect.family,
                missing=rival.effect.effect.missing,
                worse=rival.worse.gain,
                p_value=rival.worse.p_value,
                ties=rival.ties(),
            )
            for rival in one.rivals
        ),
        instead=None if rig is None or one.instead is None else _instead(rig, one.instead),
        upstream=one.upstream,
        measured_by=tuple(
            bound.name
            for bound, parameter in zip(one.effect.parameters, effect.parameters, strict=True)
            if not parameter.shape
        ),
    )


def _instead(rig: Rig, known: Instead) -> InsteadEntry:
    name = plain(known.parameter)
    own = stated(rig, name)
    return InsteadEntry(
        parameter=name,
        unit=readable_unit(own),
        stated=readable(own, known.stated),
        value=readable(own, known.value),
        share=known.share,
    )


def _size(rig: Rig | None, parameter: FreeParameter, known: Size) -> SizeEntry:
    """In the unit of the rig's file; without a rig, in one that people use."""
    if rig is None:
        unit = COMMON.get(parameter.unit, parameter.unit)
    else:
        unit = readable_unit(rig_parameter(rig, parameter.name))
    value, low, high = (
        to_si(number, parameter.unit, unit, where=parameter.name)
        for number in (known.value, *known.interval95)
    )
    return SizeEntry(
        value=value,
        interval95=(low, high),
        unit=unit,
        value_si=known.value,
        interval95_si=known.interval95,
        unit_si=parameter.unit,
    )


def _left(found: LinkDiagnosis, links: Collection[Link]) -> float:
    """Share of the gap in some links that is left there."""
    own = [link for link in found.links if link in links]
    gap = sum(found.before[link] - 1.0 for link in own)
    left = sum(max(found.remainders[link].excess, 0.0) for link in own)
    return min(left / gap, 1.0) if gap > 0.0 else 0.0


def _beside_nuisance(model: LinkModel, names: Collection[str]) -> FloatArray:
    """Sensitivities to some parameters, (n, p), less what the others can do."""
    known, none = model.sensitivities, np.zeros_like(model.rows)
    others = as_columns([known[name] for name in known if name not in names], none.size)
    own = as_columns([known.get(name, none) for name in names], none.size)
    return project_out(orthonormal(others), own)


def chain_values(found: LinkDiagnosis, model: LinkModel) -> dict[str, float]:
    """Values of the rig's parameters in a model of a diagnosis, with its effects or others [SI].

    Where the diagnosis has refitted its model in the whole chain, these are its values. Else a
    nuisance parameter has the value of the link that its part of the chain lies in. In others it
    has little influence, and makes up for what is missing there. Of several such links it has the
    mean, weighted by how well each shows it: by the sum of squares of its sensitivities.
    """
    if model is found.model and found.whole is not None:
        return {plain(name): value for name, value in found.whole.values.items()}
    values = {name: value for name, value in model.values.items() if plain(name) == name}
    nuisance = dict.fromkeys(plain(name) for name in model.values if plain(name) != name)
    for name in nuisance:
        link = LINK_OF_GROUP.get(ParameterName.parse(name).group, "muscle")
        parts = _PARTS.get(link, (MUSCLE,))
        known = link_values(found, model, name)
        own = [one for one in known if set(parts) & set(one.parts)] or list(known)
        weights = [_shown(_fitted_in(found, model, one), in_link(name, one)) for one in own]
        each = [known[one] for one in own]
        values[name] = float(np.average(each, weights=weights if any(weights) else None))
    return values


def link_values(found: LinkDiagnosis, model: LinkModel, name: str) -> dict[Link, float]:
    """Values of a nuisance parameter in the links of a model that it acts in [SI]."""
    return {
        link: _fitted_in(found, model, link).values[in_link(name, link)]
        for link in found.links
        if in_link(name, link) in model.values
    }


def _fitted_in(found: LinkDiagnosis, model: LinkModel, link: Link) -> LinkModel:
    """The model, or another one where that has left a link as the rig states it."""
    shape = found.shape
    if shape is not None and model is shape.model:
        return model if link in shape.links else shape.rest
    return model if any(link in one.links for one in found.effects) else found.base


def _shown(model: LinkModel, name: str) -> float:
    column = model.sensitivities.get(name)
    return 0.0 if column is None else float(column @ column)
