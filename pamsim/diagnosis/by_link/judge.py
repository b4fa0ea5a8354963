"""Judgement of effects on data that no fit has seen: is each there, and how deep its name goes.

A model with all effects that a search has found is compared with itself without one of them, and
with a rival in that one's place, each fitted to the same data. What is unseen, and how the
comparison is decided, depends on the data: `pamsim.diagnosis.by_link.held_out` of trials,
`pamsim.diagnosis.by_link.left_out` of rows.

A name is as deep as it holds: place, family, effect, form (`Effect.levels`). A level is certain if
every rival that differs in it predicts worse. Where more than noise is left in an effect's links,
or no repeats show whether it is, no formula that was tried is exact for all that is known: its name
is then that of the nearest, and not certain. Place and family are, as long as the effect takes away
far more than is left (`EXPLAINED`). Beside other effects in its links it need not be so much: what
is left there may be an error of their formulas (`BESIDE_OTHERS`). What other formulas of the
families that were found would take away as well is not counted as left: it speaks for these
families.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.core.computation import Steps
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import (
    left_beside,
    of_families,
    promises,
    seen_in,
    shares_by_link,
)
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.search import CONTENDS, Searched, best_fits, without
from pamsim.inference.hannan_quinn import TIE

LEVELS = ("place", "family", "name", "form")
_OF_FORMULA = ("name", "form")

ALPHA = 0.05
"""Probability that an effect that is not there is said to be, and that a level is said to be
certain that is not."""

EXPLAINED = 0.9
"""Share of what an effect takes away and what is then left for certain, from which its place and
family may be certain. Of training cases in which anything was left the right family took away 0.9
and more in 17 of 29; the nearest of another, where the right one was not tried, in 3 of 28."""

BESIDE_OTHERS = 2.0
"""Multiple of what is left that an effect must take away beside others with which it explains
`EXPLAINED` of its links: a formula's error of a tenth of a larger effect's amplitude leaves as much
as a small effect does. In training cases none of 7 that took away so much had the wrong family; of
3 that took away less, one had."""

_RIVALS = 3  # effects that are fitted in the place of one


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Another effect in the place of one.

    Attributes:
        effect: which.
        model: fitted with it.
        excess: by how much it predicts worse, mean over the held-out trials [noise variance].
        p_value: of one that predicts as well.
        by_trial: excess in every held-out trial, or row left out, (u,).
    """

    effect: Candidate
    model: LinkModel
    excess: float
    p_value: float
    by_trial: FloatArray

    def ties(self, alpha: float = ALPHA) -> bool:
        """Whether it may be the cause instead."""
        return self.p_value > alpha or self.excess <= 0.0

    def preferred_to(self, model: LinkModel) -> bool:
        """Whether it takes the effect's place in a model.

        A better fit alone may be to something else in the same links, and lose the effect.
        """
        return self.model.criterion <= model.criterion - TIE and self.excess <= 0.0


@dataclass(frozen=True, kw_only=True)
class Judged:
    """An effect of a model.

    Attributes:
        effect: which.
        links: in which it is seen.
        gain: fall of the mean square of these links' whitened rows in the held-out trials, beside
            the model without it [noise variance].
        before: mean square of what the rig without any effect leaves there, noise taken off: of
            repeats what they share [noise variance].
        p_value: of an effect that is not there.
        rivals: that were fitted in its place, the best first.
        exact: whether repeats show that nothing but noise is left in its links.
        left: mean square that is left there for certain, and that no other formula of the families
            that were found takes away: of each link as far as the effect is seen in it, on the
            scale of the gain [noise variance].
    """

    effect: Candidate
    links: frozenset[Link]
    gain: float
    before: float
    p_value: float
    rivals: tuple[Rival, ...]
    exact: bool
    left: float = 0.0

    @property
    def share(self) -> float:
        """Share of what the rig leaves in these links that this effect alone takes away."""
        return min(max(self.gain / self.before, 0.0), 1.0) if self.before > 0.0 else 0.0

    def certain(self, alpha: float = ALPHA) -> dict[str, bool]:
        """Which levels of the name hold."""
        own = _levels(self.effect)
        tied = [_levels(rival.effect) for rival in self.rivals if rival.ties(alpha)]
        there = self.p_value <= alpha and self.gain > 0.0
        return {
            level: there
            and all(other[: i + 1] == own[: i + 1] for other in tied)
            and self._explains()
            and (self.exact or level not in _OF_FORMULA)
            for i, level in enumerate(LEVELS)
        }

    def _explains(self) -> bool:
        """Whether so little is left that it can be the error of a formula."""
        if self.gain >= EXPLAINED * (self.gain + self.left):
            return True
        together = self.before - self.left >= EXPLAINED * self.before
        return self.gain >= BESIDE_OTHERS * self.left and together

    def level(self, alpha: float = ALPHA) -> str:
        """The deepest level that holds; empty if not even the place does."""
        certain = self.certain(alpha)
        return next((level for level in reversed(LEVELS) if certain[level]), "")


def _levels(effect: Candidate) -> tuple[str, ...]:
    link, place, family, name, form = effect.effect.levels
    return f"{link} {place}", family, name, form


@dataclass(frozen=True, kw_only=True)
class Difference:
    """By how much one model predicts unseen data better than another.

    Attributes:
        gain: mean difference of their losses [noise variance].
        p_value: of none.
        by_unit: differences of which the gain is the mean, (u,).
    """

    gain: float
    p_value: float
    by_unit: FloatArray


class Unseen(Protocol):
    """Data that no fit has seen."""

    def beyond_noise(self, model: LinkModel) -> Mapping[Link, float]:
        """What a model leaves in every link beyond the noise, a mean square [noise variance]."""
        ...

    def better(self, model: LinkModel, rest: LinkModel, links: Collection[Link]) -> Difference:
        """How much better a model predicts some links than the same without one effect."""
        ...

    def worse(
        self, rival: LinkModel, model: LinkModel, rest: LinkModel, links: Collection[Link]
    ) -> Difference:
        """How much worse a rival predicts some links; ``rest`` is without either effect."""
        ...

    def remainders(self, model: LinkModel) -> Mapping[Link, Remainder]:
        """What a model leaves in every link that is no noise."""
        ...


def judge(
    fitter: LinkFitter,
    searched: Searched,
    unseen: Unseen,
    *,
    alpha: float = ALPHA,
    steps: Steps,
) -> tuple[LinkModel, tuple[Judged, ...]]:
    """Judge every effect of a model; what is not there is taken out.

    A rival that fits better than an effect, and predicts no worse, takes its place, and all are
    judged again.

    Args:
        fitter: of the fitted data.
        searched: the model and all signatures.
        unseen: what the model is judged by.
        alpha: see `ALPHA`.
        steps: each fit is one.

    Returns:
        The model that is left, and its effects in the order of their gain.
    """
    case = _Case(fitter, searched, unseen, unseen.beyond_noise(searched.base), alpha, steps)
    model = searched.model
    while True:
        model, rests = _needed(case, model)
        if not rests:
            return searched.base, ()
        left = unseen.remainders(model)
        unexplained = _unexplained(case, model, left)
        judged: list[Judged] = []
        for one in rests:
            rivals = _rivals(case, model, one)
            preferred = [rival.model for rival in rivals if rival.preferred_to(model)]
            if preferred:
                best = min(preferred, key=lambda other: other.criterion)
                model = fitter.everywhere(best)
                break
            judged.append(_judged(case, one, rivals, left, unexplained))
        else:
            return model, tuple(sorted(judged, key=lambda one: -one.gain))


@dataclass(frozen=True)
class _Case:
    """What stays the same through a judgement, see `judge`."""

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
class _Needed:
    """An effect that a model needs: where, the model refitted without it, and what it gains."""

    effect: Candidate
    links: frozenset[Link]
    rest: LinkModel
    before: float
    found: Difference


def _needed(case: _Case, model: LinkModel) -> tuple[LinkModel, list[_Needed]]:
    """A model without the effects that it predicts as well without, the least needed first."""
    fitter, unseen = case.fitter, case.unseen
    while True:
        needed: list[_Needed] = []
        idle: list[_Needed] = []
        for effect in model.effects:
            rest = without(fitter, model, effect, case.searched.known)
            if rest is None:
                continue
            links = case.seen_in(effect)
            before = float(np.mean([case.before[link] for link in links]))
            one = _Needed(effect, links, rest, before, unseen.better(model, rest, links))
            there = one.found.p_value <= case.alpha and one.found.gain > 0.0
            (needed if there else idle).append(one)
        if not idle:
            return model, needed
        model = fitter.everywhere(min(idle, key=lambda one: one.found.gain).rest)


def _unexplained(
    case: _Case, model: LinkModel, left: Mapping[Link, Remainder]
) -> dict[Link, float]:
    """Mean square that is left in each link for certain and that no formula of its families takes.

    The share that they take is that of the fitted rows. What is left there is known to a standard
    error, which is added to what is left with and without these formulas: where little is left,
    little is known of its cause.
    """
    fitter = case.fitter
    formulas = of_families(model, case.searched.known)
    with_them, without_them = (
        np.clip(fitter.by_link(left_beside(model, forms) ** 2) - fitter.counts, 0.0, None)
        + np.sqrt(2.0 * fitter.counts)
        for forms in (formulas, None)
    )
    shares = np.clip(with_them / without_them, 0.0, 1.0).tolist()
    return {
        link: share * left[link].excess if left[link].counts(case.alpha) else 0.0
        for link, share in zip(fitter.simulator.links, shares, strict=True)
    }


def _judged(
    case: _Case,
    one: _Needed,
    rivals: Collection[Rival],
    left: Mapping[Link, Remainder],
    unexplained: Mapping[Link, float],
) -> Judged:
    shares = shares_by_link(case.fitter, case.searched.known, one.effect.name)
    of_link = dict(zip(case.fitter.simulator.links, shares.tolist(), strict=True))
    weights = np.array([of_link[link] for link in one.links])
    beside = np.array([unexplained[link] for link in one.links])
    # As the gain, which is the mean over these links of what is weighted so.
    scale = weights.sum() / (weights.size * float(weights @ weights))
    return Judged(
        effect=one.effect,
        links=one.links,
        gain=one.found.gain,
        before=one.before,
        p_value=one.found.p_value,
        rivals=tuple(sorted(rivals, key=lambda rival: rival.excess)),
        exact=all(left[link].excluded(case.alpha) for link in one.links),
        left=scale * float(weights @ beside),
    )


def _rivals(case: _Case, model: LinkModel, one: _Needed) -> list[Rival]:
    """Other effects in the place of one, and how much worse they predict."""
    found: list[Rival] = []
    for fit in _rival_fits(case, model, one):
        worse = case.unseen.worse(fit, model, one.rest, one.links)
        found.append(
            Rival(
                effect=fit.effects[-1],
                model=fit,
                excess=worse.gain,
                p_value=worse.p_value,
                by_trial=worse.by_unit,
            )
        )
    return found


def _rival_fits(case: _Case, model: LinkModel, one: _Needed) -> list[LinkModel]:
    """Fits with another effect in the place of one: the best forms, nearest kinds first."""
    effect = one.effect
    _, found = promises(one.rest, case.searched.known)
    own = max((p.gain for p in found if p.effect.name == effect.name), default=0.0)
    others = [
        p
        for p in found
        if p.effect.name not in model.names - {effect.name}
        and p.effect.label != effect.label
        and case.seen_in(p.effect) & one.links
    ]
    family = [p for p in others if p.effect.family == effect.family]
    kinds = (
        ([p for p in others if p.effect.name == effect.name], 1),
        ([p for p in family if p.effect.name != effect.name], 1),
        ([p for p in others if p.effect.family != effect.family], _RIVALS),
    )
    return [
        fit
        for some, most in kinds
        for fit in best_fits(
            case.fitter,
            one.rest,
            some,
            case.searched.known,
            most=most,
            forms=1,
            least=CONTENDS * own,
            links=one.links,
            steps=case.steps,
        )
    ]
