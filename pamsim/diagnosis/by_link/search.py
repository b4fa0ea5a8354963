"""Search for effects: link by link, one after the other, while more is left than a formula's error.

While a further effect is sought, errors of the formulas in the model are free (`forms_of`), so that
what remains is none of them. An effect is taken for the fit that it makes possible beside
its rivals, not for its promise. Nothing is claimed here: `pamsim.diagnosis.by_link.judge` does that
on trials that no fit has seen.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.links import Link
from pamsim.core.computation import Steps
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import (
    Promise,
    Signature,
    first_probe,
    forms_of,
    promises,
    seen_in,
    signatures,
)

_OF_LEFT = 0.1
"""Share of what is left in that link, other forms free, that an effect must promise: of some fifty
signatures one resembles any smooth misfit by less."""

CONTENDS = 0.2
"""Share of a promise from which another effect may turn out as good: all of its forms and probes
are simulated, or it is fitted as a rival. A fit triples a promise at most, of those seen."""

WORTH = 0.5
"""Share of the largest promise from which an effect, or a form of one, is fitted: promises are of
first order."""

_NEARER = 0.1
"""Share of a promise that a fit begins with again where it has ended worse than without the effect:
begun too far away, other parameters of the model went to another minimum."""

MOST, _FORMS = 4, 2  # effects that are fitted in a round, and forms of each
_ROUNDS = 8  # effects at most: twice as many as from which none need be certain


@dataclass(frozen=True)
class Tried:
    """What is tried on the rows of a fitter: effects by their signatures, and fits with these."""

    fitter: LinkFitter
    steps: Steps  # each fit is one
    # About the rig as it is, and about the base where it is much better
    known: list[Signature] = field(default_factory=list[Signature])
    most: int = MOST  # effects that are fitted in a round

    def seen_in(self, name: str) -> frozenset[Link]:
        """Links whose rows an effect changes by a share that counts."""
        return seen_in(self.fitter, self.known, name)

    def untried(self, effects: Iterable[Candidate]) -> list[tuple[Candidate, Probe]]:
        """Forms and probes of effects whose signatures are not known yet."""
        done = {(s.effect.label, s.probe.size, s.probe.shape) for s in self.known}
        return [
            (effect, probe)
            for effect in effects
            for probe in effect.probes
            if (effect.label, probe.size, probe.shape) not in done
        ]

    def best_fits(
        self,
        model: LinkModel,
        found: Sequence[Promise],
        *,
        most: int | None = None,
        forms: int = _FORMS,
        least: float | None = None,
        links: Collection[Link] = (),
    ) -> list[LinkModel]:
        """Fits of a model with one effect more: each in its best form, the most promising first.

        Args:
            model: to be added to.
            found: promises beside it, the largest first.
            most: effects that are fitted; as many as in a round if left out.
            forms: of each that are fitted.
            least: promise from which one is fitted; a share of the largest if left out.
            links: fitted beside those in which the effect is seen.
        """

        def enough(some: Sequence[Promise]) -> float:
            return WORTH * some[0].gain if least is None else least

        fits: list[LinkModel] = []
        for name in dict.fromkeys(promise.effect.name for promise in found):
            own = [promise for promise in found if promise.effect.name == name]
            if len(fits) == (self.most if most is None else most) or own[0].gain < enough(found):
                break
            where = self.seen_in(name) | frozenset(links)
            tried: list[LinkModel] = []
            for label in list(dict.fromkeys(promise.effect.label for promise in own))[:forms]:
                promise = next(p for p in own if p.effect.label == label)
                if promise.gain < enough(own):
                    break
                self.steps.begin(label)
                fit = self._with_effect(model, promise, where)
                if fit is not None:
                    tried.append(fit)
            if tried:
                fits.append(min(tried, key=lambda fit: fit.criterion))
        return fits

    def _with_effect(
        self, model: LinkModel, promise: Promise, links: Collection[Link]
    ) -> LinkModel | None:
        """The model fitted with one effect more; None if that fits no better than without it."""
        effects = (*model.effects, promise.effect)
        for share in (1.0, _NEARER):
            fit = self.fitter.fit(model, effects, promise.start(share), links)
            if fit is not None and fit.cost <= model.cost:
                return fit
        return None

    def without(self, model: LinkModel, effect: Candidate) -> LinkModel | None:
        """The model refitted without one of its effects, in the links in which that is seen."""
        rest = tuple(other for other in model.effects if other.name != effect.name)
        return self.fitter.fit(model, rest, {}, self.seen_in(effect.name))

    def in_best_forms(self, model: LinkModel) -> LinkModel:
        """A model whose effects of several forms have the one that fits best beside the others.

        The form that was best alone may have stood for another effect, too.
        """
        for effect in model.effects:
            named = {s.effect.label for s in self.known if s.effect.name == effect.name}
            forms = named - {effect.label}
            if not forms or len(model.effects) == 1:
                continue
            rest = self.without(model, effect)
            if rest is None:
                continue
            _, found = promises(rest, [s for s in self.known if s.effect.label in forms])
            others = self.best_fits(rest, found, most=1)
            model = min([model, *others], key=lambda fit: fit.criterion)
        return model

    def worth_fitting(
        self, model: LinkModel, now: Sequence[Signature]
    ) -> tuple[FloatArray, list[Promise]]:
        """Rows (f,) that neither a model nor other forms take away, and promises beside it to fit.

        Those are of what is tried ``now``; forms are all that are known.
        """
        left, found = promises(model, now, forms_of(self.fitter, model, self.known))
        unknown = self.fitter.by_link(left**2) - self.fitter.counts
        least = np.maximum(self.fitter.material, _OF_LEFT * unknown)
        return left, [p for p in found if np.any(_falls(self.fitter, p, left) >= least)]


@dataclass(frozen=True, kw_only=True)
class Searched:
    """What a search has found."""

    base: LinkModel  # the rig with its nuisance parameters fitted
    model: LinkModel  # with all effects that were found, in the order in which they were
    tried: Tried


def search(
    fitter: LinkFitter, candidates: Sequence[Candidate], *, steps: Steps, most: int = MOST
) -> Searched:
    """Find the effects that a rig is missing, among candidates in all of their forms.

    Of those that promise much, the ``most`` promising are fitted in each round.
    """
    least = fitter.units.limits.least
    tried = Tried(fitter, steps, most=most)
    tried.known.extend(_screened(tried, fitter.stated, candidates))
    base = fitter.stated
    for link in fitter.simulator.links:
        base = fitter.fit(base, (), {}, {link}) or base
    # Where a nuisance parameter stands in for an effect, what this would do beside it is not seen
    # about the rig as it is.
    falls = fitter.by_link(fitter.stated.rows**2 - base.rows**2) >= fitter.material
    better = {link for link, fell in zip(fitter.simulator.links, falls, strict=True) if fell}
    again = [effect for effect in candidates if tried.seen_in(effect.name) & better]
    about_base = _screened(tried, base, again)
    tried.known.extend(about_base)
    model, now, all_forms = fitter.stated, list(tried.known), False
    while len(model.effects) < _ROUNDS:
        left, worth = tried.worth_fitting(model, now)
        if not model.effects:
            left, beside_base = tried.worth_fitting(base, about_base)
            worth = sorted([*worth, *beside_base], key=lambda promise: -promise.gain)
        more_left = np.any(fitter.by_link(left**2) >= (1.0 + least) * fitter.counts)
        if not worth and not all_forms and more_left:
            # An effect's usual form at its first size may look like nothing: a ripple with another
            # pitch than the chain's.
            others = [e for e in candidates if e.name not in model.names]
            more, all_forms = signatures(fitter, model, tried.untried(others)), True
            now += more
            tried.known.extend(more)
            continue
        if not worth:
            break
        where = tried.seen_in(worth[0].effect.name)
        fits = tried.best_fits(model, [p for p in worth if tried.seen_in(p.effect.name) & where])
        best = min(fits, key=lambda fit: fit.criterion, default=None)
        if best is None or not np.any(
            fitter.by_link(model.rows**2 - best.rows**2) >= fitter.material
        ):
            break
        model = tried.in_best_forms(fitter.everywhere(best))
        now = _about(fitter, model, now, where)
    # Rivals of one family differ in detail: each of their forms may be the one that fits.
    families = {effect.family for effect in model.effects}
    kin = tried.untried(effect for effect in candidates if effect.family in families)
    tried.known.extend(signatures(fitter, fitter.stated, kin))
    return Searched(base=base, model=model, tried=tried)


def _screened(tried: Tried, about: LinkModel, candidates: Sequence[Candidate]) -> list[Signature]:
    """Signatures about a model: of every effect, and of all unknown forms of what promises."""
    fitter = tried.fitter
    usual = [effect for effect in candidates if effect.usual]
    first = signatures(fitter, about, [(effect, first_probe(effect)) for effect in usual])
    left, found = promises(about, first)
    largest: dict[Link, float] = {}
    seen = {p.effect.name: seen_in(fitter, first, p.effect.name) for p in found}
    for promise in found:
        for link in seen[promise.effect.name]:
            largest[link] = max(largest.get(link, 0.0), promise.gain)
    wide = {
        p.effect.name
        for p in found
        if any(p.gain >= CONTENDS * largest[link] for link in seen[p.effect.name])
        and np.any(_falls(fitter, p, left) >= CONTENDS * fitter.material)
    }
    more = [effect for effect in candidates if effect.name in wide]
    both = Tried(fitter, tried.steps, [*tried.known, *first])
    return first + signatures(fitter, about, both.untried(more))


def _about(
    fitter: LinkFitter, model: LinkModel, now: Sequence[Signature], where: Collection[Link]
) -> list[Signature]:
    """Signatures about a model, of what promises something in the links that it has changed."""
    _, found = promises(model, now, forms_of(fitter, model, now))
    near = [p for p in found if p.gain >= CONTENDS * found[0].gain]
    again = {p.effect.label for p in near if seen_in(fitter, now, p.effect.name) & frozenset(where)}
    fresh = signatures(fitter, model, [(s.effect, s.probe) for s in now if s.effect.label in again])
    return [s for s in now if s.effect.label not in again] + fresh


def _falls(fitter: LinkFitter, promise: Promise, left: FloatArray) -> FloatArray:
    """Fall of the sum of squares of each link that an effect promises."""
    return fitter.by_link(left**2 - (left + promise.rows) ** 2)
