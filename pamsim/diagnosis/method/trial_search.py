"""Search for sets of effects in recordings: grow one effect at a time, then remove what is idle.

An effect may have several forms: formulas of the same physics. The form is chosen on the fitted
trials and is a detail of the effect; whether the effect is claimed is judged on the held-out ones.
Forms come before partners: a second effect must do better than another form of the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.core.computation import Steps
from pamsim.diagnosis.method.evidence import compare_models
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import (
    Screened,
    forms_beside,
    leading,
    promised_pairs,
    screen_again,
    shortlist,
)
from pamsim.diagnosis.method.trial_model import TrialModel, fit_effects, polished
from pamsim.diagnosis.method.trial_variation import TrialVariation
from pamsim.diagnosis.method.verdict_thresholds import (
    FORM_ERROR,
    FORM_GAIN,
    LEAST_GAIN,
    PARTNER_SHARE,
    SIGNIFICANCE,
    TIE_SHARE,
)

SHORTLIST = 8
"""Most effects that are refitted for the gain that their signatures promise."""

_PROMISED, _PROMISED_RIVAL = 0.1, 0.3
"""Shares of the best promised gain that an effect must reach to be refitted: before and after a
model has closed the gap."""

_PROMISED_KIND = 0.3
"""Share of what a further effect promises from which another kind of its family is tried too."""

_OPEN = 0.1
"""The gap counts as open while another effect promises this share of what the best one explains."""

_LEEWAY = 1.5
"""Factor on a promised gain, which is only of first order."""

_FORMS = 3
"""Most further forms of one effect that are refitted."""

_FORM_LEEWAY = 6.0
"""`_LEEWAY` for another form, whose shape a fit changes far more than a signature at one place
shows: LuGre friction took four times what it had promised."""


@dataclass(frozen=True, kw_only=True)
class Growth:
    """How one more effect is added.

    Attributes:
        beam: number of models that are grown, the best first.
        others: number of effects tried beside each.
        joint: number of pairs tried that contain none of these models' effects.
        significance: share of false claims allowed over all that is tried.
        least_gain: fall of the held-out loss that the further effect must bring.
    """

    beam: int
    others: int
    significance: float
    joint: int = 0
    least_gain: float = 2.0 * LEAST_GAIN

    @property
    def most(self) -> int:
        """Models that are fitted at most."""
        return self.beam * self.others + self.joint


PAIRS = Growth(beam=2, others=4, joint=2, significance=0.01)
TRIPLES = Growth(beam=1, others=3, significance=0.001)


@dataclass(frozen=True, kw_only=True)
class _Job:
    """A larger model to be fitted.

    Attributes:
        candidates: its effects.
        starts: values of their parameters to begin from [SI].
        parents: smaller models that it must predict better than, beside the best.
    """

    candidates: Sequence[Candidate]
    starts: Sequence[Mapping[str, float]]
    parents: Sequence[TrialModel] = ()


class TrialSearch:
    """Search among sets of effects.

    Args:
        fitter: of the trials.
        base: fit of the base model.
        base_loss: its loss on the held-out trials.
        perfect: that of a perfect model.
        screened: effects in all of their forms, with their signatures; without the rare ones.
        variation: from trial to trial; None where it is not known.
        steps: each effect that is fitted is one.

    Attributes:
        rivals: models with more effects than the best, of other causes, which predict better, but
            not by as much as its formula may be off.
        form_error: loss that the formula of an effect may leave.
    """

    def __init__(
        self,
        fitter: Fitter,
        base: Refit,
        base_loss: Mapping[str, float],
        perfect: Mapping[str, float],
        screened: Sequence[Screened],
        variation: TrialVariation | None,
        steps: Steps,
    ) -> None:
        self._fitter = fitter
        self._base = base
        self._base_loss = base_loss
        missed = float(np.mean(list(base_loss.values())) - np.mean(list(perfect.values())))
        self.form_error = FORM_ERROR * max(missed, 0.0)
        self.rivals: list[TrialModel] = []
        self._screened = screened
        self._variation = variation
        self._steps = steps
        self._known: dict[frozenset[str], TrialModel | None] = {}
        self._polished: dict[frozenset[str], TrialModel] = {}

    def rare_singles(self, rare: Sequence[Screened]) -> list[TrialModel]:
        """The same of those rare effects that may be rivals; all may be partners from then on."""
        most = max((s.gain for s in self._screened), default=0.0)
        self._screened = (*self._screened, *rare)
        rivals = [s for s in rare if s.gain >= _PROMISED_RIVAL * most]
        return self.singles(rivals) if rivals else []

    def singles(self, screened: Sequence[Screened] = ()) -> list[TrialModel]:
        """Refits of single effects in their best forms, the most promising first.

        A promise is of first order, so the second is tried whatever the first achieves; further
        down the list only what may still be a rival, or while the gap is open.

        Args:
            screened: effects to try; all that are known if left out.
        """
        _, misfit = self._fitter.unexplained(self._base)
        models: list[TrialModel] = []
        best = max((self._base.cost - m.fit.cost for m in self._models()), default=0.0)
        closed = False
        own = leading(screened or self._screened)
        chosen = shortlist(own, SHORTLIST, 0.5 * LEAST_GAIN, _PROMISED)
        for place, effect in enumerate(chosen):
            rival = effect.gain >= _PROMISED_RIVAL * max(best, own[0].gain)
            if closed and place > 1 and not rival:
                continue
            worth = self._base.cost - _PROMISED_RIVAL * best if best > 0.0 else np.inf
            model = self._fitted([effect.candidate], effect.starts(misfit), worth)
            if model is None:
                continue
            models.append(model)
            gain = self._base.cost - model.fit.cost
            if gain > best:
                best, closed = gain, self._promised_beside(model) < _OPEN * gain
        ranked = sorted(models, key=lambda m: m.fit.cost)
        settled = [self.in_best_form(m) for m in ranked[:1]]
        for model in ranked[1:]:
            rival = self._base.cost - model.fit.cost >= TIE_SHARE * best
            settled.append(self.in_best_form(model, settled[0].fit.cost) if rival else model)
        return settled

    def in_best_form(self, model: TrialModel, least: float = np.inf) -> TrialModel:
        """A model with each of its effects in the form that fits best.

        Forms are refitted that may explain more than the model does, as their signatures promise.
        One whose size stays unknown, as a rate that ends near 0, is no better.

        Args:
            model: whose effects stay.
            least: cost of the best model; forms that could not get there are left out.
        """
        _, misfit = self._fitter.unexplained(self._base)
        for name in model.names:
            space, left = self._fitter.unexplained(model.fit)
            forms = forms_beside(self._screened, model.labels, name, space, left)
            for gain, form in forms[:_FORMS]:
                most = _FORM_LEEWAY * gain
                if most < FORM_GAIN or model.fit.cost - most > least:
                    continue
                candidates = [form.candidate if c.name == name else c for c in model.candidates]
                others = {
                    p.name: model.fit.values[p.name]
                    for c in candidates
                    if c.name != name
                    for p in c.parameters
                }
                starts = [{**others, **start} for start in form.starts(misfit)]
                worth = model.fit.cost - FORM_GAIN
                known = self._known.get(_key(candidates))
                other = known or self._fitted(candidates, starts, worth)
                if other is None or (model.size_known() and not other.size_known()):
                    continue
                if other.fit.cost < model.fit.cost - FORM_GAIN:
                    # Loose fits differ by where they ended, coarse steps by what they get wrong.
                    model, other = self.polished(model), self.polished(other)
                    if other.fit.cost < model.fit.cost - FORM_GAIN:
                        model = other
        return model

    def polished(self, model: TrialModel) -> TrialModel:
        """The model fitted to convergence in fine time steps, known from then on."""
        key = _key(model.candidates)
        self._steps.begin(" + ".join(model.names) + " in fine steps")
        if model is not self._polished.get(key):
            model = polished(self._fitter, self._base_loss, model, self._variation)
            self._known[key] = self._polished[key] = model
        return model

    def grown(self, accepted: Sequence[TrialModel], growth: Growth) -> list[TrialModel]:
        """Models with one more effect that predict better than their parent and the best so far.

        What is gained must be more than an error of the first effect's formula may leave. Where
        more than that is left, half of it is enough, but for a rare cause.

        Args:
            accepted: models whose effects may be claimed, the best first.
            growth: how.

        Returns:
            The accepted ones that need all of their effects, the best first.
        """
        if not accepted:
            return []
        left = accepted[0].left.gain
        formula = self.form_error
        enough = formula if left <= formula else min(formula, PARTNER_SHARE * left)
        growth = replace(growth, least_gain=max(growth.least_gain, enough))
        layout = self._fitter.simulator.layout
        least = min(m.fit.cost for m in accepted)
        parents = accepted[: growth.beam]
        jobs = [job for parent in parents for job in self._jobs(parent, growth, least)]
        jobs += self._joint_jobs(parents, growth, least)
        judged: list[tuple[TrialModel, bool]] = []
        for job in jobs:
            worth = least - growth.least_gain
            known = self._known.get(_key(job.candidates))
            model = known or self._fitted(job.candidates, job.starts, worth)
            if model is None or not model.size_known():
                continue
            over = [compare_models(m.loss, model.loss, layout) for m in (accepted[0], *job.parents)]
            p_value = max(c.p_value for c in over)
            needed = growth.least_gain
            if self._of_rare_cause(model):
                needed = max(needed, self.form_error)
            if all(c.gain > needed for c in over):
                judged.append((model, p_value * len(jobs) < growth.significance))
            elif p_value < SIGNIFICANCE and not model.families & accepted[0].families:
                self.rivals.append(model)
        # One that is certain shows that another effect is needed. Which one is decided by losses:
        # what predicts better may be less certain, as its gain differs more between inputs.
        least_certain = min((m.mean_loss for m, certain in judged if certain), default=-np.inf)
        larger = {
            frozenset(m.names): m for m, certain in judged if certain or m.mean_loss < least_certain
        }
        ranked = sorted(larger.values(), key=lambda m: m.mean_loss)
        ranked = [self.in_best_form(m) if m in ranked[: growth.beam] else m for m in ranked]
        return [m for m in ranked if len(self.reduced(m, growth).names) == len(m.names)]

    def reduced(self, model: TrialModel, growth: Growth) -> TrialModel:
        """Remove every effect without which the held-out trials are predicted as well.

        Args:
            model: with two effects or more.
            growth: how it was grown; its thresholds apply to what stays.
        """
        layout = self._fitter.simulator.layout
        screened = {s.candidate.name for s in self._screened}
        for name in model.names:
            if len(model.candidates) == 1:
                break
            kept = [c for c in model.candidates if c.name != name]
            if _key(kept) not in self._known:
                start = {p.name: model.fit.values[p.name] for c in kept for p in c.parameters}
                self._fitted(kept, [start])
            smaller = self._best({c.name for c in kept})
            if smaller is None or name not in screened:
                continue
            step = compare_models(smaller.loss, model.loss, layout)
            if step.p_value < growth.significance and step.gain > growth.least_gain:
                continue
            model = smaller
        return model

    def _of_rare_cause(self, model: TrialModel) -> bool:
        """Whether one of its effects is rare, and no kind of a usual cause."""
        usual = {s.candidate.family for s in self._screened if not s.candidate.rare}
        return any(c.rare and c.family not in usual for c in model.candidates)

    def _models(self) -> list[TrialModel]:
        """All that were fitted."""
        return [model for model in self._known.values() if model is not None]

    def _best(self, names: set[str]) -> TrialModel | None:
        """The known model with these effects, in whichever forms fit best."""
        known = [model for model in self._models() if set(model.names) == names]
        return min(known, key=lambda m: m.fit.cost, default=None)

    def _promised_beside(self, model: TrialModel) -> float:
        """Largest fall of the mean loss that an effect promises beside those of a model."""
        space, misfit = self._fitter.unexplained(model.fit)
        others = [s for s in leading(self._screened) if s.candidate.name not in model.names]
        return max((s.gain for s in screen_again(others, space, misfit)), default=0.0)

    def _jobs(self, parent: TrialModel, growth: Growth, least: float) -> list[_Job]:
        """Effects that promise most beside a model's own, and where their fits begin.

        Effects that could not get below the least cost so far by the required gain are skipped.
        """
        space, misfit = self._fitter.unexplained(parent.fit)
        freed = {p.name for p in parent.fit.parameters}
        others = [
            s
            for s in self._screened
            if s.candidate.name not in parent.names
            and not freed & {p.name for p in s.candidate.parameters}
        ]
        promised = leading(screen_again(others, space, misfit))
        promising = [
            s
            for s in promised
            if s.gain >= growth.least_gain
            and parent.fit.cost - _LEEWAY * s.gain < least - growth.least_gain
        ]
        # Of one cause all kinds: which of them predicts best is not seen in a signature.
        families = {s.candidate.family for s in promising[:1]}
        promising += [
            s
            for s in promised
            if s not in promising
            and s.candidate.family in families
            and s.gain >= _PROMISED_KIND * promising[0].gain
        ]
        return [
            _Job(
                candidates=(*parent.candidates, s.candidate),
                starts=[{**parent.fit.values, **start} for start in s.starts(misfit)],
                parents=(parent,),
            )
            for s in promising[: growth.others]
        ]

    def _joint_jobs(
        self, parents: Sequence[TrialModel], growth: Growth, least: float
    ) -> list[_Job]:
        """Pairs of which neither effect alone may be a parent, as their signatures promise.

        A third effect, which explains little of what either does, may predict better than both
        while it is alone: an air leak and a small reservoir look like a wrong flow of the valve.
        """
        if not growth.joint:
            return []
        _, misfit = self._fitter.unexplained(self._base)
        grown = [set(parent.names) for parent in parents]
        pairs = [
            pair
            for pair in promised_pairs(self._screened, misfit)
            if not any(names & {s.candidate.name for s in pair.effects} for names in grown)
            and self._base.cost - _LEEWAY * pair.gain < least - growth.least_gain
        ]
        return [
            _Job(candidates=[s.candidate for s in pair.effects], starts=[{**pair.start}])
            for pair in pairs[: growth.joint]
        ]

    def _fitted(
        self,
        candidates: Sequence[Candidate],
        starts: Sequence[Mapping[str, float]],
        worth: float = np.inf,
    ) -> TrialModel | None:
        """The model with these effects, known from then on. See `Fitter.fit` for the last."""
        self._steps.begin(" + ".join(sorted(c.label for c in candidates)))
        self._known[_key(candidates)] = fit_effects(
            self._fitter,
            self._base,
            self._base_loss,
            candidates,
            starts,
            variation=self._variation,
            worth=worth,
        )
        return self._known[_key(candidates)]


def _key(candidates: Sequence[Candidate]) -> frozenset[str]:
    """Effects and their forms, in any order."""
    return frozenset(c.label for c in candidates)
