"""Judgement of effects on data that no fit has seen: which are there, and what is as good.

A model with all effects that a search has found is compared with itself without one of them, and
with a rival in that one's place, each fitted to the same data. What is unseen, and how the
comparison is decided, depends on the data: `pamsim.diagnosis.by_link.held_out` of trials,
`pamsim.diagnosis.by_link.left_out` of rows. What follows for a name is stated in
`pamsim.diagnosis.by_link.judged`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.judged import (
    BESIDE_OTHERS,
    EXPLAINED,
    NAMED,
    SERIES,
    Instead,
    Judged,
    Rival,
    beside_unknown,
    taken_in,
)
from pamsim.diagnosis.by_link.left_out import LeftOut
from pamsim.diagnosis.by_link.limits import Difference, Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import (
    left_beside,
    of_families,
    promises,
    shares_by_link,
)
from pamsim.diagnosis.by_link.search import CONTENDS, Searched, Tried

_RIVALS = 3  # effects that are fitted in the place of one


@dataclass(frozen=True)
class Case:
    """What stays the same through a judgement."""

    tried: Tried
    unseen: HeldOut | LeftOut
    # Mean square that the rig without effects leaves in every link [noise variance]
    before: Mapping[Link, float]

    @property
    def fitter(self) -> LinkFitter:
        """Of the rows that are fitted."""
        return self.tried.fitter


@dataclass(frozen=True)
class Needed:
    """An effect that a model needs: where, the model refitted without it, and what it gains."""

    effect: Candidate
    links: frozenset[Link]
    rest: LinkModel
    before: float
    found: Difference
    by_link: Mapping[Link, float]  # fall of the mean square of each link [noise variance]

    def leaves_more(self, left: Mapping[Link, Remainder]) -> bool:
        """Whether more than noise is left for certain in a link of it."""
        return any(left[link].counts for link in self.links)


def judge(searched: Searched, unseen: HeldOut | LeftOut) -> tuple[LinkModel, tuple[Judged, ...]]:
    """Judge every effect of a model; what is not there is taken out.

    A rival that fits better than an effect, and predicts no worse, takes its place, and all are
    judged again. Where an effect leaves more than noise, so may two effects that do so together,
    such as a lag of two sensors in the place of one of the command. The effects that are left are
    in the order of their gain.
    """
    case = Case(searched.tried, unseen, unseen.beyond_noise(searched.base))
    model, seen = searched.model, set[frozenset[str]]()
    while True:
        model, rests = needed_effects(case, model)
        seen.add(model.labels)
        if not rests:
            return searched.base, ()
        left = unseen.remainders(model)
        unexplained = _unexplained(case, model, left)
        judged: list[Judged] = []
        for one in rests:
            # One of a series is not certain, whatever its rivals: fits of them would take minutes.
            alone = one.found.gain >= BESIDE_OTHERS * gain_of_others(one, rests)
            fits = rival_fits(case, model, one, left) if alone else []
            rivals = [compared(case, fit, model, one) for fit in fits]
            pairs = [
                compared(case, fit, model, one)
                for fit in pairs_of_effects(case, model, fits, one, left)
            ]
            preferred = [
                rival.model
                for rival in (*rivals, *pairs)
                if rival.preferred_to(model) and rival.model.labels not in seen
            ]
            if preferred:
                best = min(preferred, key=lambda other: other.criterion)
                model = case.fitter.everywhere(best)
                break
            judged.append(_judged(case, model, one, rests, rivals, left, unexplained))
        else:
            found = beside_unknown(judged)
            of = {one.effect.name: one for one in rests}
            return model, tuple(
                one
                if one.level()
                else replace(one, instead=number_instead(case, model, of[one.effect.name]))
                for one in found
            )


def claimed(searched: Searched, model: LinkModel, effects: Collection[Judged]) -> LinkModel:
    """A model without the effects of which not even the place is certain: those explain nothing.

    Without any that is certain it is the search's base: parameters that were refitted beside an
    effect would lead to another minimum.
    """
    if not any(one.level() for one in effects):
        return searched.base
    for one in effects:
        if not one.level():
            model = searched.tried.without(model, one.effect) or model
    return searched.tried.fitter.everywhere(model)


def _unexplained(case: Case, model: LinkModel, left: Mapping[Link, Remainder]) -> dict[Link, float]:
    """Mean square that is left in each link for certain and that no formula of its families takes.

    The share that they take is that of the fitted rows. What is left there is known to a standard
    error, which is added to what is left with and without these formulas: where little is left,
    little is known of its cause. All is left of a link that no fitted trial measures.
    """
    fitter = case.fitter
    formulas = of_families(model, case.tried.known)
    with_them, without_them = (
        np.clip(fitter.by_link(left_beside(model, forms) ** 2) - fitter.counts, 0.0, None)
        + np.sqrt(2.0 * np.maximum(fitter.counts, 1.0))
        for forms in (formulas, None)
    )
    shares = np.clip(with_them / without_them, 0.0, 1.0).tolist()
    return {
        link: share * left[link].certain
        for link, share in zip(fitter.simulator.links, shares, strict=True)
    }


def _judged(
    case: Case,
    model: LinkModel,
    one: Needed,
    needed: Collection[Needed],
    rivals: Collection[Rival],
    left: Mapping[Link, Remainder],
    unexplained: Mapping[Link, float],
) -> Judged:
    shares = shares_by_link(case.fitter, case.tried.known, one.effect.name)
    of_link = dict(zip(case.fitter.simulator.links, shares.tolist(), strict=True))
    # In their order, not a set's, which changes from run to run: so do the last bits of sums.
    links = [link for link in case.fitter.simulator.links if link in one.links]
    weights = np.array([of_link[link] for link in links])
    missed = {link: remainder.certain for link, remainder in left.items()}
    small = {link: remainder.uncounted for link, remainder in left.items()}
    # As the gain, which is the mean over these links of what is weighted so.
    scale = weights.sum() / (weights.size * float(weights @ weights))
    beside = [other for other in needed if other is not one and other.links & one.links]
    inexact = [taken_in(one.links, n.by_link) for n in beside if n.leaves_more(left)]
    all_missed, not_taken, uncounted = (
        scale * float(weights @ [of[link] for link in links]) for of in (missed, unexplained, small)
    )
    return Judged(
        effect=one.effect,
        links=one.links,
        gain=one.found.gain,
        before=one.before,
        p_value=one.found.p_value,
        rivals=tuple(sorted(rivals, key=lambda rival: rival.worse.gain)),
        exact=all(left[link].excluded for link in one.links),
        named=all(left[link].known for link in one.links)
        and one.found.gain >= NAMED * (one.found.gain + all_missed),
        left=not_taken,
        uncounted=uncounted,
        error=(1.0 - EXPLAINED) * max(inexact, default=0.0),
        others=gain_of_others(one, needed),
        missed=all_missed,
        at_end=one.effect.at_end(model.values),
        by_link=one.by_link,
        limits=one.found.limits,
    )


def gain_of_others(one: Needed, needed: Collection[Needed]) -> float:
    """What all others take away in those links of an effect where so many may be a series."""
    crowded = {link for link in one.links if sum(link in n.links for n in needed) >= SERIES}
    return sum(n.found.gain for n in needed if n is not one and n.links & crowded)


def needed_effects(case: Case, model: LinkModel) -> tuple[LinkModel, list[Needed]]:
    """A model without the effects that it predicts as well without, the least needed first."""
    fitter, unseen = case.fitter, case.unseen
    while True:
        needed: list[Needed] = []
        idle: list[Needed] = []
        own = unseen.losses(model)
        for effect in model.effects:
            rest = case.tried.without(model, effect)
            if rest is None:
                continue
            links = case.tried.seen_in(effect.name)
            before = float(np.mean([size for link, size in case.before.items() if link in links]))
            more = unseen.losses(rest)
            falls = {k: float(np.mean(more[k]) - np.mean(own[k])) for k in own.keys() & links}
            one = Needed(effect, links, rest, before, unseen.better(model, rest, links), falls)
            (needed if one.found.certain else idle).append(one)
        if not idle:
            return model, needed
        model = fitter.everywhere(min(idle, key=lambda one: one.found.gain).rest)


def number_instead(case: Case, model: LinkModel, one: Needed) -> Instead | None:
    """The nuisance parameter that explains most of an effect when it is free, if one does.

    A dead volume that is larger fills as a narrower valve does. What the effect takes away is small
    then only because that number is free, and only measuring it decides between the two.
    """
    fitter = case.fitter
    moved = {
        name: abs(one.rest.values[name] - value) / abs(fitter.nuisance[name])
        for name, value in model.values.items()
        if name in fitter.nuisance and fitter.simulator.acts_in([name]) <= one.links
    }
    if not moved:
        return None
    held = {**one.rest.values, **{name: model.values[name] for name in moved}}
    (residual,) = fitter.simulate([held], [one.links], one.rest)
    if residual is None:
        return None
    rows = fitter.whiten(residual)
    alone, beside = float(rows @ rows) - model.cost, one.rest.cost - model.cost
    if alone <= 0.0 or beside > 0.5 * alone:
        return None
    name = max(moved, key=moved.__getitem__)
    return Instead(
        parameter=name,
        stated=fitter.nuisance[name],
        value=one.rest.values[name],
        share=1.0 - max(beside, 0.0) / alone,
    )


def compared(case: Case, fit: LinkModel, model: LinkModel, one: Needed) -> Rival:
    """A fit with something else in the place of an effect, and how much worse it predicts."""
    worse = case.unseen.worse(fit, model, one.rest, one.links)
    return Rival(effect=fit.effects[-1], model=fit, worse=worse)


def pairs_of_effects(
    case: Case,
    model: LinkModel,
    rivals: Collection[LinkModel],
    one: Needed,
    left: Mapping[Link, Remainder],
) -> list[LinkModel]:
    """Rivals with the further effect that promises most beside them, if they may fit as well.

    None where an effect leaves noise alone, and of rows that are too few to hold some out.
    """
    if not case.fitter.units.judged.blocks or not one.leaves_more(left):
        return []
    found: list[LinkModel] = []
    for rival in rivals:
        _, promised = promises(rival, case.tried.known)
        others = [
            p
            for p in promised
            if p.effect.name != one.effect.name and case.tried.seen_in(p.effect.name) & one.links
        ]
        least = CONTENDS * (rival.cost - model.cost)
        found += case.tried.best_fits(rival, others, most=1, forms=1, least=least, links=one.links)
    return found


def rival_fits(
    case: Case, model: LinkModel, one: Needed, left: Mapping[Link, Remainder]
) -> list[LinkModel]:
    """Fits with another effect in the place of one, in its best form: nearest kinds first.

    Where an effect leaves more than noise its whole family is fitted, in all forms: promises are
    of first order, and that of a form which fits far from the rig as it is may be small.
    """
    effect = one.effect
    _, found = promises(one.rest, case.tried.known)
    own = max((p.gain for p in found if p.effect.name == effect.name), default=0.0)
    others = [
        p
        for p in found
        if p.effect.name not in model.names - {effect.name}
        and p.effect.label != effect.label
        and case.tried.seen_in(p.effect.name) & one.links
    ]
    family = [p for p in others if p.effect.family == effect.family]
    least = CONTENDS * own
    wide = one.leaves_more(left)
    many, enough = (len(others), 0.0) if wide else (1, least)
    kinds = (
        ([p for p in others if p.effect.name == effect.name], 1, many, enough),
        ([p for p in family if p.effect.name != effect.name], many, many, enough),
        ([p for p in others if p.effect.family != effect.family], _RIVALS, len(others), least),
    )
    return [
        fit
        for some, most, forms, promised in kinds
        for fit in case.tried.best_fits(
            one.rest, some, most=most, forms=forms, least=promised, links=one.links
        )
    ]
