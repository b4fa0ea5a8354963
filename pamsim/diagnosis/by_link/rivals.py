"""Rivals of an effect: what else is fitted in its place."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from pamsim.comparison.links import Link
from pamsim.diagnosis.by_link.judged import Rival
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.needed import Case, Needed
from pamsim.diagnosis.by_link.promise import promises
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.search import CONTENDS, best_fits

_RIVALS = 3  # effects that are fitted in the place of one


def compared(case: Case, fit: LinkModel, model: LinkModel, one: Needed) -> Rival:
    """A fit with something else in the place of an effect, and how much worse it predicts."""
    worse = case.unseen.worse(fit, model, one.rest, one.links)
    return Rival(
        effect=fit.effects[-1],
        model=fit,
        excess=worse.gain,
        p_value=worse.p_value,
        by_trial=worse.by_unit,
    )


def pairs_of_effects(
    case: Case, rivals: Collection[LinkModel], one: Needed, left: Mapping[Link, Remainder]
) -> list[LinkModel]:
    """Rivals with the further effect that promises most beside them.

    None where an effect leaves noise alone, and of rows that are too few to hold some out.
    """
    if not case.fitter.units.judged.blocks or not one.leaves_more(left, case.alpha):
        return []
    found: list[LinkModel] = []
    for rival in rivals:
        _, promised = promises(rival, case.searched.known)
        others = [
            p
            for p in promised
            if p.effect.name != one.effect.name and case.seen_in(p.effect) & one.links
        ]
        found += best_fits(
            case.fitter, rival, others, case.searched.known, most=1, forms=1, steps=case.steps
        )
    return found


def rival_fits(
    case: Case, model: LinkModel, one: Needed, left: Mapping[Link, Remainder]
) -> list[LinkModel]:
    """Fits with another effect in the place of one: the best forms, nearest kinds first.

    Where an effect leaves more than noise its whole family is fitted, in all forms: promises are
    of first order, and that of a form which fits far from the rig as it is may be small.
    """
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
    least = CONTENDS * own
    wide = one.leaves_more(left, case.alpha)
    many, enough = (len(others), 0.0) if wide else (1, least)
    kinds = (
        ([p for p in others if p.effect.name == effect.name], 1, many, enough),
        ([p for p in family if p.effect.name != effect.name], many, many, enough),
        ([p for p in others if p.effect.family != effect.family], _RIVALS, 1, least),
    )
    return [
        fit
        for some, most, forms, promised in kinds
        for fit in best_fits(
            case.fitter,
            one.rest,
            some,
            case.searched.known,
            most=most,
            forms=forms,
            least=promised,
            links=one.links,
            steps=case.steps,
        )
    ]
