"""Which effects a model needs: those without which it predicts unseen data worse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.core.computation import Steps
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.promise import seen_in
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.search import Searched, without
from pamsim.diagnosis.by_link.unseen import Difference, Unseen


@dataclass(frozen=True)
class Case:
    """What stays the same through a judgement.

    Attributes:
        fitter: of the fitted data.
        searched: the model and all signatures.
        unseen: what is judged by.
        before: mean square that the rig without effects leaves in every link [noise variance].
        alpha: level.
        steps: each fit is one.
    """

    fitter: LinkFitter
    searched: Searched
    unseen: Unseen
    before: Mapping[Link, float]
    alpha: float
    steps: Steps

    def seen_in(self, effect: Candidate) -> frozenset[Link]:
        """Links in which an effect is seen."""
        return seen_in(self.fitter, self.searched.known, effect.name)


@dataclass(frozen=True)
class Needed:
    """An effect that a model needs: where, the model refitted without it, and what it gains."""

    effect: Candidate
    links: frozenset[Link]
    rest: LinkModel
    before: float
    found: Difference

    def leaves_more(self, left: Mapping[Link, Remainder], alpha: float) -> bool:
        """Whether more than noise is left for certain in a link of it."""
        return any(left[link].counts(alpha) for link in self.links)


def needed_effects(case: Case, model: LinkModel) -> tuple[LinkModel, list[Needed]]:
    """A model without the effects that it predicts as well without, the least needed first."""
    fitter, unseen = case.fitter, case.unseen
    while True:
        needed: list[Needed] = []
        idle: list[Needed] = []
        for effect in model.effects:
            rest = without(fitter, model, effect, case.searched.known)
            if rest is None:
                continue
            links = case.seen_in(effect)
            before = float(np.mean([case.before[link] for link in links]))
            one = Needed(effect, links, rest, before, unseen.better(model, rest, links))
            there = one.found.p_value <= case.alpha and one.found.gain > 0.0
            (needed if there else idle).append(one)
        if not idle:
            return model, needed
        model = fitter.everywhere(min(idle, key=lambda one: one.found.gain).rest)
