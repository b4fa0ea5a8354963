"""What a diagnosis by link has found, in the units of the rig's file."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pamsim.comparison.chain_runs import plain
from pamsim.comparison.links import Link
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.units import COMMON, FloatArray, to_si
from pamsim.diagnosis.by_link.chain_values import chain_values, link_values
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.effect_entry import (
    EffectEntry,
    InsteadEntry,
    RivalEntry,
    SizeEntry,
    SuspectEntry,
)
from pamsim.diagnosis.by_link.judged import Instead, Judged
from pamsim.diagnosis.by_link.link_fit import PRIOR
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.remainder import nothing_material
from pamsim.diagnosis.by_link.result import LinkEntry, NuisanceEntry
from pamsim.diagnosis.by_link.sizes import Size
from pamsim.diagnosis.fitted_rig import stated
from pamsim.diagnosis.physical_size import Fitted, physical_sizes
from pamsim.effects.effect import LINKS
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.projection import as_columns, orthonormal, project_out

_FAR = 2.0  # standard deviations of `PRIOR`, beyond which one value in twenty lies


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
