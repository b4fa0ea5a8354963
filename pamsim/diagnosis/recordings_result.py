"""The result of a diagnosis of recordings, in the units of the rig's file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.held_out_split import HeldOutSplit
from pamsim.diagnosis.method.evidence import Improvement, compare_models
from pamsim.diagnosis.method.gap import ChannelGap, Level, Residuals, gaps
from pamsim.diagnosis.method.next_experiment import NextExperiment
from pamsim.diagnosis.method.recorded_loops import Signals
from pamsim.diagnosis.method.rivals import shared_names
from pamsim.diagnosis.method.trial_diagnosis import TrialDiagnosis
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.where import Cell
from pamsim.diagnosis.physical_size import physical_sizes
from pamsim.diagnosis.recordings_details import recordings_details
from pamsim.diagnosis.repaired_rig import repair
from pamsim.diagnosis.result import (
    Diagnosis,
    FoundEffect,
    GapEntry,
    NextStep,
    NuisanceEntry,
    Resemblance,
    RmsLevel,
    TriedModel,
)
from pamsim.diagnosis.rig_estimates import absent_entry, estimates
from pamsim.diagnosis.where_entries import cell_places, map_entry
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig

_OPEN = (Verdict.AMBIGUOUS, Verdict.UNEXPLAINED, Verdict.NOT_IDENTIFIABLE)
"""Verdicts that leave it open what is missing, so that a further experiment should tell."""

HELD_OUT = "trials that no fit has seen"
HELD_OUT_PARTS = "parts of trials that no fit has seen"


def result_of(
    rig: Rig,
    data: CalibrationData,
    method: TrialDiagnosis,
    *,
    split: HeldOutSplit,
    given: Sequence[Cell],
    before: Signals,
    after: Signals,
    skipped: Mapping[str, str],
    warnings: tuple[str, ...],
    seed: int,
    rollouts: int,
    seconds: float,
) -> Diagnosis:
    """Write the method's result in the units of the rig's file.

    Args:
        rig: without effects.
        data: the recordings.
        method: result of the method.
        split: what was held out.
        given: excess of angle and forces with the arm driven by the measured pressures.
        before: trial -> channel -> (n,) simulated by the refitted base model [SI].
        after: the same by the best model; empty without one.
        skipped: effect -> why it was not tried.
        warnings: what a reader should know.
        seed: random seed.
        rollouts: simulations.
        seconds: wall time.
    """
    conclusion = method.conclusion
    best, verdict = conclusion.best, conclusion.verdict
    claimed = best if verdict.claims else None
    after = after if verdict.repairs else {}
    protocol_of = {trial.name: trial.protocol for trial in data.trials}
    off = _residuals(data, method, before), _residuals(data, method, after)
    judged = off
    if split.parts is not None:
        protocol_of = {name: protocol_of[trial] for name, trial in split.parts.origin.items()}
        judged = split.parts.signals(off[0]), split.parts.signals(off[1])
    gap = gaps(*judged, method.floor, protocol_of, split.names, repeated=split.parts is None)
    models = [best, *conclusion.tied] if best is not None and verdict.repairs else []
    nearest = conclusion.nearest
    origin = ", ".join(Path(source).name or source for source in data.sources)
    return Diagnosis(
        kind="recordings",
        rig=rig.name,
        data=data.sources,
        verdict=verdict,
        effects=() if claimed is None else _effects(rig, method, claimed),
        certain=shared_names([m.names for m in models]),
        resembles=_resemblance(method),
        alternatives=tuple(
            _alternative(rig, method, model) for model in models if model is not claimed
        ),
        where=cell_places(method.cells, method.maps),
        maps=tuple(map_entry(m, "noise SD", 1.0) for m in method.maps),
        maps_after=tuple(map_entry(m, "noise SD", 1.0) for m in method.maps_after),
        gap={g.channel: _gap_entry(g) for g in gap},
        absent={limit.effect: absent_entry(rig, limit) for limit in method.absent},
        warnings=warnings,
        next_experiment=_next_step(method.next_experiment, verdict, nearest),
        explained=conclusion.explained.value,
        explained_interval95=conclusion.explained.interval95,
        inconclusive=_inconclusive(method) if verdict is Verdict.NOT_IDENTIFIABLE else None,
        effects_tried=len({s.candidate.name for s in method.screened}),
        tried=_tried(method),
        nuisance=_nuisance(rig, method),
        held_out=split.names,
        held_out_method=HELD_OUT if split.parts is None else HELD_OUT_PARTS,
        skipped=dict(skipped),
        details=recordings_details(rig, data.trials, method, given, before, after, off),
        seed=seed,
        rollouts=rollouts,
        parameter_sets=method.evaluations,
        seconds=seconds,
        method=method,
        comparisons=_comparisons(data, method, split, before, after),
        repair=None
        if claimed is None
        else repair(
            rig,
            claimed.fit.values,
            claimed.intervals,
            {p.name: c.name for c in claimed.candidates for p in c.parameters},
            origin,
        ),
    )


def _residuals(data: CalibrationData, method: TrialDiagnosis, predicted: Signals) -> Residuals:
    """Simulated minus measured."""
    return {
        trial.name: {
            channel: predicted[trial.name][channel] - measured
            for channel, measured in trial.measured.items()
            if channel in method.floor.sd
        }
        for trial in data.trials
        if trial.name in predicted
    }


def _comparisons(
    data: CalibrationData,
    method: TrialDiagnosis,
    split: HeldOutSplit,
    before: Signals,
    after: Signals,
) -> tuple[Comparison, ...]:
    """Every compared channel of every trial beside what the models make of it."""
    judged = set(split.names)
    if split.parts is not None:
        judged = {split.parts.origin[name] for name in judged}
    return tuple(
        Comparison(
            trial=trial.name,
            protocol=trial.protocol,
            channel=channel,
            held_out=trial.name in judged,
            time=trial.time,
            measured=measured,
            before=before[trial.name][channel],
            after=after[trial.name][channel] if after else None,
        )
        for trial in data.trials
        for channel, measured in trial.measured.items()
        if channel in method.floor.sd
    )


def _effects(rig: Rig, method: TrialDiagnosis, best: TrialModel) -> tuple[FoundEffect, ...]:
    """The claimed effects, each with what it explains beyond the others."""
    effects: list[FoundEffect] = []
    for candidate in best.candidates:
        step = best.improvement
        if len(best.candidates) > 1:
            rest = {name for name in best.names if name != candidate.name}
            parents = [m for m in method.models if set(m.names) == rest]
            step = compare_models(parents[0].loss, best.loss, method.layout) if parents else None
        share = None
        if step is not None and best.improvement.gain > 0.0:
            share = method.conclusion.explained.value * step.gain / best.improvement.gain
        effects.append(
            FoundEffect(
                members={candidate.name: candidate.effect.missing},
                family=candidate.family,
                form=candidate.effect.form or None,
                parameters=estimates(rig, best, [p.name for p in candidate.parameters]),
                physical=physical_sizes(
                    rig, best, [candidate], form_error=_form_error(method, step)
                ),
                explained=share,
                p_value=None if step is None else _corrected(method, step),
            )
        )
    return tuple(effects)


def _alternative(rig: Rig, method: TrialDiagnosis, model: TrialModel) -> FoundEffect:
    best = method.conclusion.best
    assert best is not None
    behind = compare_models(model.loss, best.loss, method.layout)
    errors = None
    if model is best:
        errors = 0.0
    elif behind.error > 0.0 and math.isfinite(behind.error):
        errors = behind.standard_errors
    return FoundEffect(
        members={c.name: c.effect.missing for c in model.candidates},
        family=model.family,
        parameters=estimates(rig, model, [p.name for c in model.candidates for p in c.parameters]),
        physical=physical_sizes(
            rig, model, model.candidates, form_error=_form_error(method, model.improvement)
        ),
        explained=_share(method, model),
        p_value=_corrected(method, model.improvement),
        loss_difference=behind.gain,
        standard_errors_behind=errors,
    )


def _form_error(method: TrialDiagnosis, step: Improvement | None) -> float:
    """By how much the formula may falsify a size, as a share of it [-], in 95 % of cases.

    Taken as twice the amplitude of what the model may leave over that of what the effect explains:
    what a formula leaves is what no size of it could take, and the size that fits best is off by
    about as much, either way. Repeats that do not show a remainder limit it. At most 1: beyond, the
    size is not known to within itself.
    """
    left = max(method.conclusion.left_for_certain, method.conclusion.lack.at_most)
    if left <= 0.0:
        return 0.0
    if step is None or step.gain <= 0.0:
        return 1.0
    return min(2.0 * math.sqrt(left / step.gain), 1.0)


def _corrected(method: TrialDiagnosis, improvement: Improvement) -> float:
    """p-value with the Bonferroni correction for all effects that were tried."""
    return min(improvement.p_value * method.tried, 1.0)


def _share(method: TrialDiagnosis, model: TrialModel) -> float | None:
    """Share of the base model's gap that a model explains, as the best model's is counted."""
    best = method.conclusion.best
    if best is None or best.improvement.gain <= 0.0:
        return None
    share = method.conclusion.explained.value * model.improvement.gain / best.improvement.gain
    return min(max(share, 0.0), 1.0)


def _resemblance(method: TrialDiagnosis) -> Resemblance | None:
    """The model that explains most, or else the effect whose signature is nearest to the misfit."""
    if method.conclusion.verdict is Verdict.NO_GAP:
        return None
    similarity = {s.candidate.label: s.similarity for s in method.screened}
    nearest = method.conclusion.nearest
    if nearest is not None:
        return Resemblance(
            name="+".join(nearest.names),
            family=nearest.family,
            explained=method.conclusion.explained.value,
            explained_interval95=method.conclusion.explained.interval95,
            p_value=_corrected(method, nearest.improvement),
            similarity=similarity.get(nearest.labels[0]) if len(nearest.names) == 1 else None,
            leaves=cell_places(method.cells_after, method.maps_after)[0],
        )
    seen = [s for s in method.screened if s.similarity > 0.0]
    if not seen:
        return None
    near = max(seen, key=lambda s: s.similarity)
    return Resemblance(
        name=near.candidate.name,
        family=near.candidate.family,
        explained=near.similarity**2,
        p_value=None,
        similarity=near.similarity,
    )


def _gap_entry(gap: ChannelGap) -> GapEntry:
    unit, scale = shown_unit(gap.channel)

    def level(own: Level) -> RmsLevel:
        return RmsLevel.scaled(own.value, scale, own.interval95)

    return GapEntry(
        unit=unit,
        floor=level(gap.floor),
        before=level(gap.before),
        after=None if gap.after is None else level(gap.after),
    )


def _next_step(
    chosen: NextExperiment | None, verdict: Verdict, nearest: TrialModel | None
) -> NextStep | None:
    if chosen is not None:
        return NextStep(
            protocol=chosen.protocol,
            advice=chosen.advice,
            shows=MENU[chosen.protocol].shows,
            between=chosen.between,
            before=chosen.before,
            after=chosen.after,
            menu=chosen.menu,
        )
    if verdict in _OPEN and nearest is not None:
        return NextStep(protocol=None, advice=nearest.candidates[0].effect.separating)
    return None


def _inconclusive(method: TrialDiagnosis) -> str:
    """Why recordings carry no verdict."""
    return (
        "on held-out trials the simulation exceeds the noise variance by a factor of"
        f" {1.0 + method.conclusion.remainder:.2g}, and too few trials repeat each other to prove"
        " it; record every input three times or more"
    )


def _tried(method: TrialDiagnosis) -> tuple[TriedModel, ...]:
    """Every model that was fitted, the best first."""
    return tuple(
        TriedModel(
            effects=model.names,
            held_out=model.mean_loss,
            unit="noise variance",
            gain=model.improvement.gain,
            gain_error=model.improvement.error,
            p_value=_corrected(method, model.improvement),
            accepted=model.accepted(method.tried),
            at_bound=model.fit.at_bound,
            size_known=model.size_known(),
        )
        for model in sorted(method.models, key=lambda m: m.mean_loss)
    )


def _nuisance(rig: Rig, method: TrialDiagnosis) -> tuple[NuisanceEntry, ...]:
    """Nuisance parameters in the rig, and as the base and the best model were fitted."""
    best = method.conclusion.best
    entries: list[NuisanceEntry] = []
    for name, value in method.base.values.items():
        parameter = rig_parameter(rig, name)
        repaired = None if best is None else best.fit.values.get(name)
        known = None if best is None else best.intervals.get(name)
        entries.append(
            NuisanceEntry(
                parameter=name,
                unit=readable_unit(parameter),
                before=readable(parameter, parameter.value),
                refitted=readable(parameter, value),
                with_effects=None if repaired is None else readable(parameter, repaired),
                interval95=readable_interval(parameter, known),
                at_bound=name in (method.base if best is None else best.fit).at_bound,
            )
        )
    return tuple(entries)
