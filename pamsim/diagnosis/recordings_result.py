"""The result of a diagnosis of recordings, in the units of the rig's file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.method.absent_limits import AbsentLimit
from pamsim.diagnosis.method.evidence import compare_trials
from pamsim.diagnosis.method.gap import ChannelGap, Level, Residuals, gaps
from pamsim.diagnosis.method.loop_areas import PRESSURE, DrivenCycle, Signals, loop_areas
from pamsim.diagnosis.method.next_experiment import NextExperiment
from pamsim.diagnosis.method.regimes import Regime
from pamsim.diagnosis.method.screen import Screened, signature_similarity
from pamsim.diagnosis.method.spectrum_split import SpectrumSplit, spectrum_splits
from pamsim.diagnosis.method.thresholds import FEWEST_REPEATS
from pamsim.diagnosis.method.trial_diagnosis import TrialDiagnosis
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.where import Cell, ResidualMap
from pamsim.diagnosis.repaired_rig import repair
from pamsim.diagnosis.result import (
    AbsentEntry,
    Details,
    Diagnosis,
    Estimate,
    FoundEffect,
    GapEntry,
    MapEntry,
    NextStep,
    NuisanceEntry,
    Place,
    Region,
    Resemblance,
    RmsLevel,
    TriedModel,
)
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter

SIGNIFICANT_MAP = 0.05
"""p-value up to which a map shows where a channel misses."""

_QUANTITIES = {
    "common_pressure": ("kPa", 1.0 / PA_PER_KPA),
    "pressure_difference": ("kPa", 1.0 / PA_PER_KPA),
    "angle": ("deg", DEG_PER_RAD),
    "speed": ("deg/s", DEG_PER_RAD),
    "direction": ("1", 1.0),
}
"""Unit in which a map's quantity is written, and the factor on SI; seconds if left out."""


def result_of(
    rig: Rig,
    data: CalibrationData,
    method: TrialDiagnosis,
    *,
    held_out: tuple[str, ...],
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
        held_out: names of the trials judged by.
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
    gap = gaps(*off, method.floor, protocol_of, held_out)
    models = [] if best is None else [best, *conclusion.tied]
    origin = ", ".join(Path(source).name or source for source in data.sources)
    return Diagnosis(
        kind="recordings",
        rig=rig.name,
        data=data.sources,
        verdict=verdict,
        effects=() if claimed is None else _effects(rig, method, claimed, protocol_of),
        certain=shared_names([m.names for m in models]) if verdict.repairs else (),
        resembles=_resemblance(method, protocol_of),
        alternatives=tuple(
            _alternative(rig, method, model, protocol_of)
            for model in models
            if model is not claimed
        ),
        where=_places(method.cells, method.maps),
        maps=tuple(_map_entry(m) for m in method.maps),
        gap={g.channel: _gap_entry(g) for g in gap},
        absent={limit.effect: absent_entry(rig, limit) for limit in method.absent},
        warnings=warnings,
        next_experiment=_next_step(method.next_experiment, verdict, best),
        explained=conclusion.explained,
        inconclusive=_inconclusive(method) if verdict is Verdict.NOT_IDENTIFIABLE else None,
        effects_tried=len(method.screened),
        tried=_tried(method),
        nuisance=_nuisance(rig, method),
        held_out=held_out,
        held_out_method="trials that no fit has seen",
        skipped=dict(skipped),
        details=Details(
            remainder=conclusion.remainder,
            lack_of_fit=None
            if conclusion.lack is None
            else {**asdict(conclusion.lack), "significant": conclusion.lack.significant},
            noise_floor=_noise_floor(method),
            where_with_measured_pressures=_places(given, ()),
            nuisance_by_protocol=tuple(_regime(rig, regime) for regime in method.regimes),
            loop_areas=_loop_areas(loop_areas(data.trials, before, after)),
            spectrum=_spectrum(*(spectrum_splits(data.trials, part) for part in off)),
            screened=_screened(method.screened),
        ),
        seed=seed,
        rollouts=rollouts,
        parameter_sets=method.evaluations,
        seconds=seconds,
        method=method,
        comparisons=_comparisons(data, method, held_out, before, after),
        repair=None if claimed is None else repair(rig, claimed, origin),
    )


def shared_names(models: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Effects that are in every one of some models."""
    if not models:
        return ()
    return tuple(name for name in models[0] if all(name in names for names in models))


def estimate(
    rig: Rig, name: str, value: float, interval95: tuple[float, float] | None, *, at_bound: bool
) -> Estimate:
    """A fitted parameter of a rig.

    Args:
        rig: without effects.
        name: of the parameter.
        value: [SI].
        interval95: [SI].
        at_bound: whether the fit ended at a limit.
    """
    parameter = rig_parameter(rig, name)
    ends = None if interval95 is None else [readable(parameter, end) for end in interval95]
    return Estimate(
        value=readable(parameter, value),
        unit=readable_unit(parameter),
        interval95=None if ends is None else (ends[0], ends[1]),
        value_si=float(value),
        unit_si=parameter.spec.unit,
        interval95_si=interval95,
        before=readable(parameter, parameter.value),
        at_bound=at_bound,
    )


def absent_entry(rig: Rig, absent: AbsentLimit) -> AbsentEntry:
    """How large an absent effect could be, as a distance in the unit of the rig's file."""
    parameter = rig_parameter(rig, absent.parameter)
    known = absent.visible and math.isfinite(absent.limit)
    # A distance: what the unit's zero is does not matter.
    distance = readable(parameter, absent.limit) - readable(parameter, 0.0) if known else None
    return AbsentEntry(
        parameter=absent.parameter,
        limit=distance,
        unit=readable_unit(parameter),
        limit_si=absent.limit if known else None,
        typical_sizes=absent.size,
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
    held_out: Sequence[str],
    before: Signals,
    after: Signals,
) -> tuple[Comparison, ...]:
    """Every compared channel of every trial beside what the models make of it."""
    return tuple(
        Comparison(
            trial=trial.name,
            protocol=trial.protocol,
            channel=channel,
            held_out=trial.name in held_out,
            time=trial.time,
            measured=measured,
            before=before[trial.name][channel],
            after=after[trial.name][channel] if after else None,
        )
        for trial in data.trials
        for channel, measured in trial.measured.items()
        if channel in method.floor.sd
    )


def _estimates(rig: Rig, model: TrialModel, names: Sequence[str]) -> dict[str, Estimate]:
    return {
        name: estimate(
            rig,
            name,
            model.fit.values[name],
            model.intervals.get(name),
            at_bound=name in model.fit.at_bound,
        )
        for name in names
    }


def _effects(
    rig: Rig, method: TrialDiagnosis, best: TrialModel, protocol_of: Mapping[str, str]
) -> tuple[FoundEffect, ...]:
    """The claimed effects, each with what it explains beyond the others."""
    effects: list[FoundEffect] = []
    for candidate in best.candidates:
        step = best.improvement
        if len(best.candidates) > 1:
            rest = {name for name in best.names if name != candidate.name}
            parents = [m for m in method.models if set(m.names) == rest]
            step = compare_trials(parents[0].loss, best.loss, protocol_of) if parents else None
        share = None
        if step is not None and best.improvement.gain > 0.0:
            share = method.conclusion.explained * step.gain / best.improvement.gain
        effects.append(
            FoundEffect(
                members={candidate.name: candidate.effect.missing},
                family=candidate.family,
                parameters=_estimates(rig, best, [p.name for p in candidate.parameters]),
                explained=share,
                p_value=None if step is None else min(step.p_value * method.tried, 1.0),
            )
        )
    return tuple(effects)


def _alternative(
    rig: Rig, method: TrialDiagnosis, model: TrialModel, protocol_of: Mapping[str, str]
) -> FoundEffect:
    best = method.conclusion.best
    assert best is not None
    behind = compare_trials(model.loss, best.loss, protocol_of)
    known = behind.error > 0.0 and math.isfinite(behind.error)
    return FoundEffect(
        members={c.name: c.effect.missing for c in model.candidates},
        family="+".join(dict.fromkeys(c.family for c in model.candidates)),
        parameters=_estimates(rig, model, [p.name for c in model.candidates for p in c.parameters]),
        explained=_share(method, model),
        p_value=min(model.improvement.p_value * method.tried, 1.0),
        loss_difference=behind.gain,
        standard_errors_behind=0.0
        if model is best
        else behind.gain / behind.error
        if known
        else None,
    )


def _share(method: TrialDiagnosis, model: TrialModel) -> float | None:
    """Share of the base model's gap that a model explains, as the best model's is counted."""
    best = method.conclusion.best
    if best is None or best.improvement.gain <= 0.0:
        return None
    share = method.conclusion.explained * model.improvement.gain / best.improvement.gain
    return max(share, 0.0)


def _resemblance(method: TrialDiagnosis, protocol_of: Mapping[str, str]) -> Resemblance | None:
    """The best model, or else the effect whose signature is most similar to the misfit."""
    if method.conclusion.verdict is Verdict.NO_GAP:
        return None
    similarity = {s.candidate.name: s.similarity for s in method.screened}
    best = method.conclusion.best
    if best is not None:
        return Resemblance(
            name="+".join(best.names),
            family="+".join(dict.fromkeys(c.family for c in best.candidates)),
            explained=method.conclusion.explained,
            p_value=min(best.improvement.p_value * method.tried, 1.0),
            similarity=similarity.get(best.names[0]) if len(best.names) == 1 else None,
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


def _quantity(name: str) -> tuple[str, float]:
    return _QUANTITIES.get(name, ("s", 1.0))


def _places(cells: Sequence[Cell], maps: Sequence[ResidualMap]) -> tuple[Place, ...]:
    """Channels and protocols, each with the region of the channel's most significant map."""
    regions: dict[str, Region] = {}
    for residual_map in maps:
        if residual_map.p_value <= SIGNIFICANT_MAP and residual_map.channel not in regions:
            unit, scale = _quantity(residual_map.quantity)
            low, high = residual_map.region
            regions[residual_map.channel] = Region(
                quantity=residual_map.quantity,
                low=low * scale,
                high=high * scale,
                unit=unit,
                p_value=residual_map.p_value,
            )
    return tuple(
        Place(
            channel=cell.channel,
            protocol=cell.protocol,
            excess=cell.excess,
            p_value=cell.p_value,
            region=regions.get(cell.channel),
        )
        for cell in cells
    )


def _map_entry(residual_map: ResidualMap) -> MapEntry:
    unit, scale = _quantity(residual_map.quantity)
    return MapEntry(
        channel=residual_map.channel,
        quantity=residual_map.quantity,
        unit=unit,
        edges=residual_map.edges * scale,
        mean=residual_map.mean,
        mean_unit="noise SD",
        p_value=residual_map.p_value,
    )


def _gap_entry(gap: ChannelGap) -> GapEntry:
    unit, scale = shown_unit(gap.channel)

    def level(own: Level) -> RmsLevel:
        ends = own.interval95
        return RmsLevel(
            value=own.value * scale,
            interval95=None if ends is None else (ends[0] * scale, ends[1] * scale),
            value_si=own.value,
        )

    return GapEntry(
        unit=unit,
        floor=level(gap.floor),
        before=level(gap.before),
        after=None if gap.after is None else level(gap.after),
    )


def _next_step(
    chosen: NextExperiment | None, verdict: Verdict, best: TrialModel | None
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
    if verdict is Verdict.AMBIGUOUS and best is not None:
        return NextStep(protocol=None, advice=best.candidates[0].effect.separating)
    return None


def _inconclusive(method: TrialDiagnosis) -> str:
    """Why recordings carry no verdict."""
    if method.floor.repeats < FEWEST_REPEATS:
        return (
            "a protocol has no repeats, so that noise and a gap cannot be separated; record every"
            " input three times or more"
        )
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
            p_value=min(model.improvement.p_value * method.tried, 1.0),
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
                interval95=None
                if known is None
                else (readable(parameter, known[0]), readable(parameter, known[1])),
                at_bound=name in method.base.at_bound,
            )
        )
    return tuple(entries)


def _noise_floor(method: TrialDiagnosis) -> dict[str, Any]:
    channels: dict[str, Any] = {}
    for channel, sd in method.floor.sd.items():
        unit, scale = shown_unit(channel)
        channels[channel] = {"sd": sd * scale, "unit": unit, "sd_si": sd}
    return {
        "channels": channels,
        "repeats": method.floor.repeats,
        "assumed": method.floor.assumed,
    }


def _screened(screened: Sequence[Screened]) -> tuple[dict[str, Any], ...]:
    """What the data can show of every effect, before any is fitted."""
    entries: list[dict[str, Any]] = []
    for effect in screened:
        signatures = [trace.signature for trace in effect.traces]
        typical = min(signatures, key=lambda s: abs(s.size - 1.0), default=None)
        others = [(signature_similarity(effect, o), o) for o in screened if o is not effect]
        similarity, near = max(others, key=lambda pair: pair[0], default=(0.0, None))
        entries.append(
            {
                "effect": effect.candidate.name,
                "family": effect.candidate.family,
                "visible": effect.visible,
                "visibility": None if typical is None else typical.visible,
                "explained_by_nuisance": None if typical is None else typical.explained_by_nuisance,
                "similarity": effect.similarity,
                "promised_gain": effect.gain,
                "most_similar": None if near is None else near.candidate.name,
                "similarity_to_it": None if near is None else similarity,
            }
        )
    return tuple(entries)


def _loop_areas(cycles: Sequence[DrivenCycle]) -> tuple[dict[str, Any], ...]:
    """Areas as means over the repeats of a protocol, with the spread of the measured ones."""
    groups: dict[tuple[str, str, int], list[DrivenCycle]] = {}
    for cycle in cycles:
        groups.setdefault((cycle.drive, cycle.protocol, cycle.cycle), []).append(cycle)
    entries: list[dict[str, Any]] = []
    for (drive, protocol, number), members in groups.items():
        scale = DEG_PER_RAD / (PA_PER_KPA if drive == PRESSURE else 1.0)
        areas = [member.measured * scale for member in members]
        repaired = [m.after * scale for m in members if m.after is not None]
        entries.append(
            {
                "drive": f"{drive}_difference",
                "protocol": protocol,
                "cycle": number,
                "repeats": len(members),
                "amplitude_deg": np.mean([m.amplitude for m in members]) * DEG_PER_RAD,
                "common_pressure_kpa": np.mean([m.common_pressure for m in members]) / PA_PER_KPA,
                "period_s": np.mean([m.period for m in members]),
                "unit": "kPa*deg" if drive == PRESSURE else "N*deg",
                "measured": np.mean(areas),
                "spread": np.std(areas, ddof=1) if len(areas) > 1 else None,
                "before": np.mean([m.before for m in members]) * scale,
                "after": np.mean(repaired) if repaired else None,
            }
        )
    return tuple(entries)


def _spectrum(
    before: Sequence[SpectrumSplit], after: Sequence[SpectrumSplit]
) -> tuple[dict[str, Any], ...]:
    """Residuals of periodic protocols by spectral lines, before and after."""
    repaired = {(split.protocol, split.channel): split for split in after}

    def levels(split: SpectrumSplit | None, scale: float) -> dict[str, Any] | None:
        if split is None:
            return None
        values = {
            name: getattr(split, name) for name in ("mean", "excited", "even", "odd", "noise")
        }
        return {name: None if v is None else v * scale for name, v in values.items()}

    entries: list[dict[str, Any]] = []
    for split in before:
        unit, scale = shown_unit(split.channel)
        entries.append(
            {
                "protocol": split.protocol,
                "channel": split.channel,
                "unit": unit,
                "period_s": split.period,
                "segments": split.segments,
                "before": levels(split, scale),
                "after": levels(repaired.get((split.protocol, split.channel)), scale),
            }
        )
    return tuple(entries)


def _regime(rig: Rig, regime: Regime) -> dict[str, Any]:
    """A nuisance parameter fitted to each protocol by itself, in the unit of the rig's file."""
    parameter = rig_parameter(rig, regime.parameter)
    return {
        "parameter": regime.parameter,
        "unit": readable_unit(parameter),
        "p_value": regime.p_value,
        "values": {
            protocol: {
                "value": readable(parameter, value),
                "interval95": [readable(parameter, low), readable(parameter, high)],
            }
            for protocol, (value, low, high) in regime.values.items()
        },
    }
