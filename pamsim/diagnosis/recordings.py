"""Diagnose a rig by recordings of it over time, link by link."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.compared_signal import shown_unit
from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.experiments import experiment_of
from pamsim.comparison.likely_mistakes import likely_mistakes
from pamsim.comparison.measurements import CalibrationData
from pamsim.diagnosis.about_the_rig import about_the_drive
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis, diagnose_links
from pamsim.diagnosis.by_link.entries import (
    chain_values,
    effect_entries,
    far_from_stated,
    link_entries,
    nuisance_entries,
    suspect_entries,
)
from pamsim.diagnosis.by_link.judged_units import held_out_split
from pamsim.diagnosis.by_link.learned_entry import learned_entries
from pamsim.diagnosis.by_link.limits import nothing_material
from pamsim.diagnosis.by_link.next_experiment import next_experiment
from pamsim.diagnosis.by_link.result import LinkReport, Run
from pamsim.diagnosis.by_link.whole_chain import (
    WholeChain,
    misses_more,
    slow_errors,
    whole_chain,
)
from pamsim.diagnosis.fitted_rig import Repair, repair
from pamsim.diagnosis.options import AS_USUAL, Options, refuse_zero, usual_nuisance
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig

_NO_SHAPE = (
    "a curve was learned of what has no name, but with it the whole chain misses more (RMS): it is"
    " left out"
)
_MISSES_MORE = (
    "with the effects found the whole chain misses more than without (RMS): they explain quick"
    " errors, and slow ones grow; do not use the repaired rig before something is done about these"
)


def diagnose_recordings(data: CalibrationData, rig: Rig, options: Options = AS_USUAL) -> LinkReport:
    """Find what a rig's model is missing in each link of its chain.

    See `pamsim.diagnosis.by_link.diagnose_links.diagnose_links` for how often inputs must be
    repeated.

    Raises:
        InputError: for what cannot be used, or if the simulation breaks down.
    """
    began = time.perf_counter()
    data = data.of_rig(rig)
    held_out, warnings = held_out_split(data, options.hold_out, options.limits)
    refuse_zero({name: rig_parameter(rig, name).value for name in options.nuisance})
    nuisance = options.nuisance or usual_nuisance(rig)
    tried, skipped = _tried(rig, options, nuisance)
    found = diagnose_links(
        rig,
        data.trials,
        tried,
        held_out=held_out,
        nuisance=nuisance,
        limits=options.limits,
        learn=options.learn,
        seed=options.seed,
        threads=options.threads,
        progress=options.progress,
    )
    repaired, chain = _in_whole_chain(rig, data, found, held_out, options.threads)
    if found.shape is not None and misses_more(chain.gap):
        found = replace(found, shape=None, notes=(*found.notes, _NO_SHAPE))
        repaired, chain = _in_whole_chain(rig, data, found, held_out, options.threads)
    noise = {
        channel: gap.floor / shown_unit(channel)[1]
        for channel, gap in chain.gap.items()
        if gap.floor is not None
    }
    refitted = nuisance_entries(rig, found, nuisance)
    return LinkReport(
        rig=rig.name,
        links=link_entries(found),
        effects=effect_entries(rig, found),
        suspected=suspect_entries(rig, found),
        learned=learned_entries(rig, found.shape),
        gap=chain.gap,
        nuisance=refitted,
        next_experiment=next_experiment(rig, found, noise, threads=options.threads),
        warnings=(
            *likely_mistakes(rig, data.trials, chain.as_it_is, threads=options.threads),
            *data.notes,
            *warnings,
            *found.notes,
            *(slow_errors(chain.gap) if nothing_material(found.unexplained.values()) else ()),
            *((_MISSES_MORE,) if misses_more(chain.gap) else ()),
            *far_from_stated(refitted),
            *about_the_drive(data),
            *above_supply(rig.muscles, map(experiment_of, data.trials)),
        ),
        alpha=found.limits.alpha,
        material=found.limits.material,
        run=Run(
            data=data.sources,
            held_out=held_out,
            effects_tried=len({one.name for one in tried}),
            skipped=skipped,
            seed=options.seed,
            seconds=time.perf_counter() - began,
        ),
        comparisons=chain.comparisons,
        repair=None if repaired is None else _repair(rig, found, repaired, data.sources),
    )


def _tried(
    rig: Rig, options: Options, nuisance: Sequence[str]
) -> tuple[tuple[Candidate, ...], Mapping[str, str]]:
    """Effects that may be missing, and why others are not tried."""
    every, skipped = candidates(rig, options.effects, options.without)
    tried: list[Candidate] = []
    for one in every:
        shared = sorted({p.name for p in one.parameters} & set(nuisance))
        if shared:
            skipped[one.name] = (
                f"{', '.join(shared)} is a nuisance parameter, refitted with every effect"
            )
        else:
            tried.append(one)
    return tuple(tried), skipped


def _in_whole_chain(
    rig: Rig,
    data: CalibrationData,
    found: LinkDiagnosis,
    held_out: Collection[str],
    threads: int | None,
) -> tuple[dict[str, float] | None, WholeChain]:
    """Values of the repaired rig, and the whole chain with and without them."""
    repaired, before = _repaired(found), chain_values(found, found.base)
    return repaired, whole_chain(rig, data, before, repaired, held_out=held_out, threads=threads)


def _repaired(found: LinkDiagnosis) -> dict[str, float] | None:
    """Values of the repaired rig, with what was learned [SI]; None if nothing was found."""
    if found.shape is not None:
        return {**chain_values(found, found.shape.model), **found.shape.values}
    return chain_values(found, found.model) if found.effects else None


def _repair(
    rig: Rig, found: LinkDiagnosis, values: Mapping[str, float], sources: Sequence[str]
) -> Repair:
    learned = {} if found.shape is None else dict.fromkeys(found.shape.values, "learned, no name")
    named = {p.name: one.effect.name for one in found.effects for p in one.effect.parameters}
    return repair(
        rig,
        values,
        {name: size.interval95 for name, size in found.sizes.items() if name in values},
        {**named, **learned},
        ", ".join(Path(source).name or source for source in sources),
    )
