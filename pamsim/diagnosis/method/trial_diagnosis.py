"""Diagnose recordings: noise floor, base fit, where, screening, refits, effect sets, verdict."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.noise_floor import NoiseFloor, floor_beside, noise_floor
from pamsim.comparison.trial_residuals import TrialLayout, TrialSimulator
from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.absent_limits import AbsentLimit, absent_limits, supported, widest
from pamsim.diagnosis.method.evidence import (
    Share,
    compare_trials,
    losses,
    perfect_losses,
    share_of_trials,
)
from pamsim.diagnosis.method.held_out_remainder import has_remainder
from pamsim.diagnosis.method.lack_of_fit import LackOfFit, lack_of_fit
from pamsim.diagnosis.method.next_experiment import NextExperiment, SimulateMenu, next_experiment
from pamsim.diagnosis.method.nuisance_by_protocol import NuisanceByProtocol, nuisance_by_protocol
from pamsim.diagnosis.method.refit import Fitter, Refit, Remembered
from pamsim.diagnosis.method.rivals import Similarity, reject_rivals, tied_with
from pamsim.diagnosis.method.screen import Screened, screen, signature_similarity
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.diagnosis.method.trial_search import PAIRS, SHORTLIST, TRIPLES, TrialSearch
from pamsim.diagnosis.method.trial_variation import TrialVariation, trial_variation
from pamsim.diagnosis.method.verdict import Evidence, Verdict, decide
from pamsim.diagnosis.method.verdict_thresholds import (
    GAP_LOSS,
    GAP_P_VALUE,
    LACK_OF_FIT_LOSS,
    LACK_OF_FIT_SHORT,
    LARGE_REMAINDER_LOSS,
    LEFT_FOR_RARE,
    PARTNER_SHARE,
    REMAINDER_LOSS,
    UNPROVEN_LOSS,
    UNREPEATED_GAP,
)
from pamsim.diagnosis.method.where import (
    Cell,
    Regressors,
    ResidualMap,
    cells,
    systematic,
    trial_maps,
)
from pamsim.inference.free_parameter import FreeParameter

_LAST = 4
"""Steps after the search: the best models in fine steps, limits of absent effects."""


@dataclass(frozen=True, kw_only=True)
class Conclusion:
    """The verdict on recordings and what it rests on.

    Attributes:
        verdict: see `Verdict`.
        best: model with the claimed effects; None if none may be claimed.
        nearest: the best model, or else the one that explains most of what is missing; None if no
            model predicts better than the base.
        tied: other models that predict as well.
        explained: share of the base model's excess over the noise that the nearest model removes.
        remainder: excess that it leaves; of the base model where there is none.
        left_for_certain: the part of it that is significant; 0 if none is.
        lack: what repeats share that the best model, or without one the base model, does not
            predict.
    """

    verdict: Verdict
    best: TrialModel | None
    nearest: TrialModel | None
    tied: tuple[TrialModel, ...]
    explained: Share
    remainder: float
    left_for_certain: float
    lack: LackOfFit


@dataclass(frozen=True, kw_only=True)
class TrialDiagnosis:
    """The result of a diagnosis of recordings.

    Attributes:
        conclusion: the verdict.
        layout: of the trials.
        floor: of the noise.
        base: fit of the base model.
        base_loss: held-out trial -> its loss.
        perfect_loss: held-out trial -> loss of a perfect model.
        cells: excess per channel and protocol of the base model's fit, the largest first.
        maps: residual over quantities, the most significant first.
        cells_after, maps_after: the same of what the nearest model leaves; empty without one.
        nuisance_by_protocol: nuisance parameters per protocol, the least homogeneous first.
        screened: what the data can show of every effect, in all of its forms.
        models: every model with effects that was fitted.
        tried: single effects that the held-out trials have judged.
        absent: how large the effects that are not claimed could be.
        next_experiment: what would separate tied effects; None if nothing is tied.
        evaluations: parameter sets simulated.
    """

    conclusion: Conclusion
    layout: TrialLayout
    floor: NoiseFloor
    base: Refit
    base_loss: Mapping[str, float]
    perfect_loss: Mapping[str, float]
    cells: tuple[Cell, ...]
    maps: tuple[ResidualMap, ...]
    cells_after: tuple[Cell, ...]
    maps_after: tuple[ResidualMap, ...]
    nuisance_by_protocol: tuple[NuisanceByProtocol, ...]
    screened: tuple[Screened, ...]
    models: tuple[TrialModel, ...]
    tried: int
    absent: tuple[AbsentLimit, ...]
    next_experiment: NextExperiment | None
    evaluations: int


def diagnose_trials(
    simulator: TrialSimulator,
    nuisance: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    regressors: Callable[[Mapping[str, float]], Regressors],
    *,
    commands: Mapping[str, FloatArray] | None = None,
    menu: SimulateMenu | None = None,
    seed: int = 0,
    remembered: Remembered | None = None,
    progress: Progress | None = None,
) -> TrialDiagnosis:
    """Find where a simulator and recordings disagree and name the missing effect.

    Args:
        simulator: of all trials.
        nuisance: parameters that are refitted with every effect, which must do better.
        candidates: effects that may be missing.
        regressors: values of a fit to the quantities over which its residuals are mapped; they
            must not hold the noise of the measurement.
        commands: trial -> (n, m), for the noise floor of inputs recorded once.
        menu: simulator of further experiments, from which the next one is chosen.
        seed: random seed of the sign flips.
        remembered: fits of an interrupted run; new ones are added.
        progress: called as each model is fitted; how many there will be is an upper estimate.

    Raises:
        InputError: if the base model's simulation breaks down, or nothing is held out.
    """
    sets = [growth.most for growth in (PAIRS, TRIPLES)]
    steps = Steps(progress, 2 + SHORTLIST + sum(sets) + _LAST)
    steps.begin("base model")
    fitter, base = fitted_base(simulator, nuisance, commands, remembered)
    candidates = [c.beside(base.values) for c in candidates]
    floor, layout = fitter.floor, simulator.layout
    base_loss = losses(layout, base.residual, floor, held_out=True)
    every = [*layout.trials(held_out=False), *layout.trials(held_out=True)]
    where = cells(layout, base.residual, floor, every)
    maps = trial_maps(layout, base.residual, floor, regressors(base.values), seed=seed)
    steps.begin("screening")
    screened = screen(fitter, base, [c for c in candidates if not c.rare])
    perfect = perfect_losses(layout, floor)
    variation = trial_variation(fitter, base, screened)
    search = TrialSearch(fitter, base, base_loss, perfect, screened, variation, steps)
    models = search.singles()

    def leaves_something(usual: TrialModel | None) -> bool:
        left_by = base if usual is None else usual.fit
        lack = lack_of_fit(fitter, left_by, screened, seed=seed)
        if lack.p_value < LEFT_FOR_RARE or not lack.testable:
            return True
        return usual is not None and has_remainder(
            usual.left, lack, layout, left_by.residual, floor, variation, least=REMAINDER_LOSS
        )

    present = [m for m in models if m.all_present()]
    first_best = min(present, key=lambda m: m.fit.cost, default=None)
    some_left = leaves_something(first_best)
    if some_left and first_best is not None:
        # A loose fit may have ended where its effect still had something to explain.
        polished = search.polished(first_best)
        models[models.index(first_best)] = polished
        some_left = leaves_something(polished)
    if some_left:
        steps.begin("screening of rare effects")
        rare = screen(fitter, base, [c for c in candidates if c.rare])
        screened = (*screened, *rare)
        models += search.rare_singles(rare)
    # The shortlist was made without the held-out trials: they judge what stands on it alone. Parts
    # of one trial share what made the list.
    tried = max(len({s.candidate.name for s in screened} if layout.origin else models), 1)
    accepted = sorted((m for m in models if m.accepted(tried)), key=lambda m: m.mean_loss)
    first = accepted[:1]
    for stage, growth in enumerate((PAIRS, TRIPLES)):
        steps.expect(_LAST + (sum(sets[stage:]) if accepted else 0))
        if layout.origin and accepted:
            growth = replace(growth, least_gain=accepted[0].least_gain)
        accepted = search.grown(accepted, growth)
        models += [m for m in accepted if beyond_form(first[0], m)]
    by_label = {s.candidate.label: s for s in screened}
    certain = where[0].p_value < GAP_P_VALUE and where[0].excess > GAP_LOSS
    # Parts of one trial share what varies from trial to trial: a map of it is no gap.
    gap_mapped = certain and systematic(maps) and not layout.origin

    def concluded() -> Conclusion:
        return conclude(
            layout,
            floor,
            base,
            base_loss,
            models,
            tried,
            lambda a, b: signature_similarity(by_label[a], by_label[b]),
            lambda fit: lack_of_fit(fitter, fit, screened, seed=seed),
            gap_mapped=gap_mapped,
            usual_families={c.family for c in candidates if not c.rare},
            rivals=search.rivals,
            variation=variation,
        )

    conclusion = concluded()
    steps.expect(0 if conclusion.best is None else 2 + len(conclusion.tied[:2]))
    if conclusion.best is not None:
        for close in (conclusion.best, *conclusion.tied[:2]):
            group = search.rivals if any(close is m for m in search.rivals) else models
            group[group.index(close)] = search.polished(close)
        conclusion = concluded()
    best, nearest = conclusion.best, conclusion.nearest
    claimed = () if best is None else best.names
    floor = floor_beside(floor, layout, (base if nearest is None else nearest.fit).residual)
    steps.begin("limits of absent effects")
    unclaimed = [s for s in screened if s.candidate.usual and s.candidate.name not in claimed]
    standing = [] if best is None else [best, *conclusion.tied]
    better = [m for m in models if best is not None and m.mean_loss < best.mean_loss]
    form_error = search.form_error if standing else 0.0
    limits = widest(
        [
            absent_limits(fitter, unclaimed, fit, nuisance, form_error=form_error)
            for fit in [m.fit for m in standing] or [base]
        ]
    )
    return TrialDiagnosis(
        conclusion=conclusion,
        layout=layout,
        floor=floor,
        base=base,
        base_loss=base_loss,
        perfect_loss=perfect_losses(layout, floor),
        cells=where,
        maps=maps,
        cells_after=() if nearest is None else cells(layout, nearest.fit.residual, floor, every),
        maps_after=()
        if nearest is None
        else trial_maps(
            layout, nearest.fit.residual, floor, regressors(nearest.fit.values), seed=seed
        ),
        nuisance_by_protocol=nuisance_by_protocol(fitter, base),
        screened=screened,
        models=tuple(models),
        tried=tried,
        absent=supported(
            limits,
            conclusion.verdict,
            {s.candidate.name: s.candidate.family for s in screened},
            [m.names for m in (*standing, *better)],
        ),
        next_experiment=None
        if menu is None or best is None
        else next_experiment(best, conclusion.tied, fitter, menu),
        evaluations=simulator.evaluations,
    )


def fitted_base(
    simulator: TrialSimulator,
    nuisance: Sequence[FreeParameter],
    commands: Mapping[str, FloatArray] | None = None,
    remembered: Remembered | None = None,
) -> tuple[Fitter, Refit]:
    """Fit the nuisance parameters of the model without effects.

    Args:
        simulator: of all trials.
        nuisance: parameters.
        commands: trial -> (n, m), for the noise floor of inputs recorded once.
        remembered: fits of an interrupted run; new ones are added.

    Returns:
        The fitter, which holds the noise floor and the Jacobian there, and the fit.

    Raises:
        InputError: if the simulation breaks down, or nothing is held out.
    """
    start = {p.name: p.start for p in nuisance}
    first = simulator.anchor(start)
    if first is None:
        raise InputError(
            "the base model's simulation breaks down on these trials; check the rig's parameters"
            " and the recording's units"
        )
    layout = simulator.layout
    if not layout.trials(held_out=True) or not layout.trials(held_out=False):
        raise InputError("nothing to judge by: some trials must be held out, and some not")
    fitter = Fitter(simulator, noise_floor(layout, first, commands), remembered)
    base = fitter.fit(nuisance, [start])
    anchored = simulator.anchor(base.values)
    base = base if anchored is None else replace(base, residual=anchored)
    fitter.keep_jacobian(base)
    return fitter, base


def beyond_form(single: TrialModel, larger: TrialModel) -> bool:
    """Whether the further effects of a model do more than mend the formula of the first.

    What the best single effect leaves may be the error of its formula, which some other effect
    always takes the edge off: further effects must remove most of it.

    Args:
        single: the best model with one effect.
        larger: with several.
    """
    return single.mean_loss - larger.mean_loss > PARTNER_SHARE * single.left.gain


def explained_by(model: TrialModel, base_loss: Mapping[str, float], layout: TrialLayout) -> Share:
    """Share of what the base model misses that a model removes.

    Args:
        model: with effects.
        base_loss: held-out trial -> loss of the base model.
        layout: of the trials.
    """
    perfect = {trial: loss - model.excess[trial] for trial, loss in model.loss.items()}
    return share_of_trials(base_loss, model.loss, perfect, layout.protocol_of)


def conclude(
    layout: TrialLayout,
    floor: NoiseFloor,
    base: Refit,
    base_loss: Mapping[str, float],
    models: Sequence[TrialModel],
    tried: int,
    similarity: Similarity,
    lack_of_fit: Callable[[Refit], LackOfFit],
    *,
    gap_mapped: bool,
    usual_families: Collection[str] = (),
    rivals: Sequence[TrialModel] = (),
    variation: TrialVariation | None = None,
) -> Conclusion:
    """Choose the best model and its rivals, and weigh the evidence.

    Args:
        layout: of the trials.
        floor: of the noise.
        base: fit of the base model.
        base_loss: held-out trial -> its loss.
        models: with effects, fitted; sets of effects only if each effect is needed.
        tried: single effects that were judged by the held-out trials.
        similarity: of the signatures of two effects.
        lack_of_fit: what a fitted model leaves that repeats share.
        gap_mapped: whether residual maps show a gap, whatever these models achieve.
        usual_families: of the effects that are tried in any case: a rare kind of one of them is
            no rare cause.
        rivals: see `TrialSearch`.
        variation: from trial to trial; None where it is not known.
    """
    accepted = [m for m in models if m.accepted(tried)]
    if not accepted:
        closest = min(models, key=lambda m: m.mean_loss).fit if models else base
        perfect = perfect_losses(layout, floor_beside(floor, layout, closest.residual))
        excess = compare_trials(base_loss, perfect, layout.protocol_of)
        noise, least = 1.0, GAP_LOSS
        if layout.origin:
            noise, least = float(np.mean(list(perfect.values()))), UNREPEATED_GAP
        over = excess.gain / noise
        proven = excess.p_value < GAP_P_VALUE and over > least
        # Losses know a gap no better than the noise floor is known; what repeats share needs none.
        lack = lack_of_fit(base)
        shared = lack.significant and lack.size > GAP_LOSS
        evidence = Evidence(
            claimed=False,
            gap=gap_mapped or proven or shared,
            suspected=over > UNPROVEN_LOSS,
        )
        verdict = decide(evidence)
        better = [m for m in models if m.improvement.gain > 0.0 and verdict is not Verdict.NO_GAP]
        nearest = min(better, key=lambda m: m.mean_loss, default=None)
        return Conclusion(
            verdict=verdict,
            best=None,
            nearest=nearest,
            tied=(),
            explained=Share(value=0.0, interval95=None)
            if nearest is None
            else explained_by(nearest, base_loss, layout),
            remainder=over,
            left_for_certain=over if verdict is Verdict.UNEXPLAINED else 0.0,
            lack=lack,
        )
    most = max(len(m.candidates) for m in accepted)
    best = min((m for m in accepted if len(m.candidates) == most), key=lambda m: m.mean_loss)
    others = [m for m in models if len(m.candidates) == most]
    own = lack_of_fit(best.fit)
    wrong_by = own.size if own.significant else 0.0
    tied = tied_with(best, others, layout, similarity, wrong_by=wrong_by)
    best, tied, lack = reject_rivals(best, tied, lack_of_fit)
    left = best.left
    least = best.least_gain if layout.origin else REMAINDER_LOSS
    remainder = has_remainder(left, lack, layout, best.fit.residual, floor, variation, least=least)
    shared = lack.p_value < LACK_OF_FIT_SHORT and lack.size > LACK_OF_FIT_LOSS
    explained = explained_by(best, base_loss, layout)
    large_remainder = lack.significant or (remainder and left.gain > LARGE_REMAINDER_LOSS)
    if large_remainder:
        # Two other effects that leave less may be what is there.
        tied = (*tied, *(m for m in rivals if len(m.candidates) == most + 1))
    evidence = Evidence(
        claimed=True,
        gap=True,
        explained=explained.value,
        effects=most,
        remainder=remainder or shared,
        large_remainder=large_remainder,
        untested=not lack.testable,
        strained=best.strained(),
        rare=any(c.rare and c.family not in usual_families for c in best.candidates),
        tied=bool(tied),
    )
    return Conclusion(
        verdict=decide(evidence),
        best=best,
        nearest=best,
        tied=tied,
        explained=explained,
        remainder=left.gain,
        left_for_certain=max(
            left.gain if remainder else 0.0, lack.size if lack.significant else 0.0
        ),
        lack=lack,
    )
