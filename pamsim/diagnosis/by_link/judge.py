"""Judgement of effects on trials that no fit has seen: is each there, and how deep its name goes.

A model with all effects that a search has found is compared with itself without one of them, and
with a rival in that one's place, each fitted to the same trials. Which predicts the held-out trials
better is decided by flips of the signs of whole trials (`pamsim.inference.model_comparison`).

A name is as deep as it holds: place, family, effect, form (`Effect.levels`). A level is certain if
every rival that differs in it predicts worse. Where more than noise is left in an effect's links,
or no repeats show whether it is, no formula that was tried is exact for all that is known: its name
is then that of the nearest, and not certain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.core.computation import Steps
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.held_out import HeldOut, mean_loss
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import Signature, promises, seen_in
from pamsim.diagnosis.by_link.remainder import Remainder, remainders
from pamsim.diagnosis.by_link.search import MATERIAL_SHARE, Searched, best_fits, without
from pamsim.inference.model_comparison import compare_with_reference

LEVELS = ("place", "family", "name", "form")
_OF_FORMULA = ("name", "form")

ALPHA = 0.05
"""Probability that an effect that is not there is said to be, and that a level is said to be
certain that is not."""

_SWAPS = 3  # effects that are exchanged for rivals at most, before judgement
_RIVALS = 3  # effects that are fitted in the place of one
_RIVAL_WORTH = 0.2
"""Share of an effect's promise from which another is its rival: one that promises less is far from
taking its place, even if a fit triples it."""


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Another effect in the place of one.

    Attributes:
        effect: which.
        model: fitted with it.
        excess: by how much it predicts worse, mean over the held-out trials [noise variance].
        p_value: of one that predicts as well.
        by_trial: excess in every held-out trial, (u,).
    """

    effect: Candidate
    model: LinkModel
    excess: float
    p_value: float
    by_trial: FloatArray


@dataclass(frozen=True, kw_only=True)
class Judged:
    """An effect of a model.

    Attributes:
        effect: which.
        links: in which it is seen.
        gain: fall of the mean square of these links' whitened rows in the held-out trials, beside
            the model without it [noise variance].
        before: mean square of what the rig without any effect leaves there, noise taken off by
            what repeats share [noise variance].
        p_value: of an effect that is not there.
        rivals: that were fitted in its place, the best first.
        exact: whether repeats show that nothing but noise is left in its links.
    """

    effect: Candidate
    links: frozenset[Link]
    gain: float
    before: float
    p_value: float
    rivals: tuple[Rival, ...]
    exact: bool

    @property
    def share(self) -> float:
        """Share of what the rig leaves in these links that this effect alone takes away."""
        return min(max(self.gain / self.before, 0.0), 1.0) if self.before > 0.0 else 0.0

    def certain(self, alpha: float = ALPHA) -> dict[str, bool]:
        """Which levels of the name hold."""
        own = _levels(self.effect)
        tied = [_levels(r.effect) for r in self.rivals if r.p_value > alpha or r.excess <= 0.0]
        there = self.p_value <= alpha and self.gain > 0.0
        return {
            level: there
            and all(other[: i + 1] == own[: i + 1] for other in tied)
            and (self.exact or level not in _OF_FORMULA)
            for i, level in enumerate(LEVELS)
        }

    def level(self, alpha: float = ALPHA) -> str:
        """The deepest level that holds; empty if not even the place does."""
        certain = self.certain(alpha)
        return next((level for level in reversed(LEVELS) if certain[level]), "")


def _levels(effect: Candidate) -> tuple[str, ...]:
    link, place, family, name, form = effect.effect.levels
    return f"{link} {place}", family, name, form


def judge(
    fitter: LinkFitter,
    searched: Searched,
    held_out: HeldOut,
    *,
    alpha: float = ALPHA,
    seed: int = 0,
    steps: Steps,
) -> tuple[LinkModel, tuple[Judged, ...]]:
    """Judge every effect of a model; what is not there is taken out.

    Args:
        fitter: of the fitted trials.
        searched: the model and all signatures.
        held_out: the other trials.
        alpha: see `ALPHA`.
        seed: random seed of the sign flips, where they are drawn.
        steps: each fit is one.

    Returns:
        The model that is left, and its effects in the order of their gain.
    """
    known = searched.known
    before = {link: one.excess for link, one in remainders(held_out, searched.base).items()}
    model, swaps = searched.model, 0
    while True:
        model, rests = _needed(fitter, model, known, held_out, before, alpha, seed)
        if not rests:
            return searched.base, ()
        losses, left = held_out.losses(model), remainders(held_out, model, seed=seed)
        judged = [
            _beside_rivals(
                fitter, model, one, known, held_out, losses, before, left, alpha, seed, steps
            )
            for one in rests
        ]
        better = [r.model for one in judged for r in one.rivals if r.model.cost < model.cost]
        if not better or swaps == _SWAPS:
            return model, tuple(sorted(judged, key=lambda one: -one.gain))
        swaps += 1
        model = fitter.everywhere(min(better, key=lambda other: other.cost))


@dataclass(frozen=True)
class _Needed:
    """An effect that a model needs: the model refitted without it, and what the effect gains."""

    effect: Candidate
    rest: LinkModel
    gain: float
    p_value: float


def _needed(
    fitter: LinkFitter,
    model: LinkModel,
    known: Sequence[Signature],
    held_out: HeldOut,
    before: Mapping[Link, float],
    alpha: float,
    seed: int,
) -> tuple[LinkModel, list[_Needed]]:
    """A model without the effects that it predicts as well without, the least needed first."""
    while True:
        losses = held_out.losses(model)
        needed: list[_Needed] = []
        idle: list[_Needed] = []
        for effect in model.effects:
            rest = without(fitter, model, effect, known)
            if rest is None:
                continue
            links = seen_in(fitter, known, effect.name)
            own = mean_loss(losses, links)
            found = compare_with_reference(
                mean_loss(held_out.losses(rest), links), own[:, np.newaxis], seed=seed
            )
            one = _Needed(effect, rest, float(found.gain[0]), float(found.p_value[0]))
            excess = float(np.mean([before[link] for link in links]))
            there = one.p_value <= alpha and one.gain >= MATERIAL_SHARE * excess
            (needed if there else idle).append(one)
        if not idle:
            return model, needed
        model = fitter.everywhere(min(idle, key=lambda one: one.gain).rest)


def _beside_rivals(
    fitter: LinkFitter,
    model: LinkModel,
    one: _Needed,
    known: Sequence[Signature],
    held_out: HeldOut,
    losses: Mapping[Link, FloatArray],
    before: Mapping[Link, float],
    left: Mapping[Link, Remainder],
    alpha: float,
    seed: int,
    steps: Steps,
) -> Judged:
    effect, rest = one.effect, one.rest
    links = seen_in(fitter, known, effect.name)
    _, found = promises(rest, known)
    own = max((p.gain for p in found if p.effect.name == effect.name), default=0.0)
    taken = model.names - {effect.name}
    others = [
        p
        for p in found
        if p.effect.name not in taken
        and p.effect.label != effect.label
        and seen_in(fitter, known, p.effect.name) & links
    ]
    # Nearest first: another form, another kind of the family, other families.
    forms = [p for p in others if p.effect.name == effect.name]
    family = [p for p in others if p.effect.family == effect.family]
    kinds = (
        (forms, 1),
        ([p for p in family if p.effect.name != effect.name], 1),
        ([p for p in others if p.effect.family != effect.family], _RIVALS),
    )
    fits = [
        fit
        for some, most in kinds
        for fit in best_fits(
            fitter,
            rest,
            some,
            known,
            most=most,
            forms=1,
            least=_RIVAL_WORTH * own,
            links=links,
            steps=steps,
        )
    ]
    rivals: list[Rival] = []
    mine = mean_loss(losses, links)
    for fit in fits:
        theirs = mean_loss(held_out.losses(fit), links)
        worse = compare_with_reference(theirs, mine[:, np.newaxis], seed=seed)
        rivals.append(
            Rival(
                effect=fit.effects[-1],
                model=fit,
                excess=float(worse.gain[0]),
                p_value=float(worse.p_value[0]),
                by_trial=theirs - mine,
            )
        )
    return Judged(
        effect=effect,
        links=links,
        gain=one.gain,
        before=float(np.mean([before[link] for link in links])),
        p_value=one.p_value,
        rivals=tuple(sorted(rivals, key=lambda rival: rival.excess)),
        exact=all(left[link].excluded(alpha) for link in links),
    )
