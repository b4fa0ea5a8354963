"""Judgement of effects where rows are too few to hold some out: each is left out in turn.

* Whether an effect is there: it must fit better than the best of all effects and forms that were
  tried on the same rows would by chance (exchanges of the rows), agree over the rows (flips of
  their scores), and predict rows that are left out better (flips of their losses). Half of ten rows
  would show nothing, and no row is unseen by the search. Noise alone passes the first two tests in
  7 % of toy tables at a level of 5 %, and all three in 0.5 %.
* What it gains, and by how much a rival in its place is worse: mean losses of rows that are left
  out, each predicted by a fit to the others.
* Whether a rival is worse: the model with the effect must add something to that with the rival,
  and not the other way round (Davidson and MacKinnon, Econometrica 49 (1981)). Where each adds to
  the other neither formula is exact, and flips of the losses decide: they need more rows, since a
  few rows hold most of what separates two effects.

All is linear about a fit to all rows, and in the size of an effect
(`pamsim.inference.projected_effect`); numbers of its shape stay as all rows have fitted them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.core.computation import Steps
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.judge import ALPHA, Judged, Rival
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import Signature, promises, seen_in
from pamsim.diagnosis.by_link.search import MATERIAL_SHARE, Searched, best_fits, without
from pamsim.inference.blocks import Stack
from pamsim.inference.model_comparison import compare_with_reference
from pamsim.inference.permutation import best_of_many_p_values
from pamsim.inference.projected_effect import FreeForms, compare_effects, orthonormal

_RIVALS = 3  # effects of other families that are fitted in the place of one
_RIVAL_WORTH = 0.2
"""Share of an effect's promise from which another is its rival, as in
`pamsim.diagnosis.by_link.judge`."""


def judge_left_out(
    fitter: LinkFitter,
    searched: Searched,
    *,
    alpha: float = ALPHA,
    seed: int = 0,
    steps: Steps,
) -> tuple[LinkModel, tuple[Judged, ...]]:
    """Judge every effect of a model by rows left out; what is not there is taken out.

    Args:
        fitter: of all rows, each a unit of its own.
        searched: the model and all signatures.
        alpha: see `pamsim.diagnosis.by_link.judge.ALPHA`.
        seed: random seed of exchanges and sign flips.
        steps: each fit is one.

    Returns:
        The model that is left, and its effects in the order of their gain.

    Raises:
        InputError: for fewer than two rows, or units of several.
    """
    if any(block.size > 1 for block in fitter.units.fitted.blocks):
        raise InputError("rows are exchanged one by one; give each as a unit of its own")
    known, before = searched.known, _links_left_out(fitter, searched.base)
    model = searched.model
    while True:
        model, needed = _needed(fitter, model, searched, before, alpha, seed)
        judged = [_beside_rivals(fitter, model, one, known, alpha, seed, steps) for one in needed]
        # A swap lowers the cost, and what is not needed goes: this ends.
        better = [r.model for one in judged for r in one.rivals if r.model.cost < model.cost]
        if not better:
            return model, tuple(sorted(judged, key=lambda one: -one.gain))
        model = min(better, key=lambda other: other.cost)


def losses_left_out(fitter: LinkFitter, model: LinkModel) -> dict[Link, FloatArray]:
    """Loss of each row of each link, predicted by a fit to the others, (n,); 1 is noise."""
    return {
        link: _left_out(fitter, model, frozenset({link})).losses for link in fitter.simulator.links
    }


def _left_out(fitter: LinkFitter, model: LinkModel, links: frozenset[Link]) -> FreeForms:
    """Rows of some links, each predicted from the others, about a model."""
    rows = fitter.in_links(links)
    return FreeForms(
        Stack(
            units=tuple(fitter.units.fitted.blocks[k].unit for k in np.flatnonzero(rows).tolist()),
            unit=np.arange(int(np.sum(rows))),
            residual=model.rows[rows],
            jacobian=model.jacobian()[rows],
        ),
        np.empty((int(np.sum(rows)), 0)),
    )


def _links_left_out(fitter: LinkFitter, model: LinkModel) -> dict[Link, float]:
    """What a model leaves in each link beyond the noise, mean over rows left out."""
    losses = losses_left_out(fitter, model)
    return {link: float(np.mean(loss)) - 1.0 for link, loss in losses.items()}


@dataclass(frozen=True)
class _Needed:
    """An effect that a model needs.

    Attributes:
        effect: which.
        links: in which it is seen.
        rest: the model refitted without it.
        gain: fall of the mean loss of rows left out.
        before: what the rig without any effect leaves in these links.
        p_value: of an effect that is not there, the largest of the three tests.
    """

    effect: Candidate
    links: frozenset[Link]
    rest: LinkModel
    gain: float
    before: float
    p_value: float


def _needed(
    fitter: LinkFitter,
    model: LinkModel,
    searched: Searched,
    before: dict[Link, float],
    alpha: float,
    seed: int,
) -> tuple[LinkModel, list[_Needed]]:
    """A model without the effects that do nothing for rows left out."""
    while True:
        found = [
            one
            for effect in model.effects
            if (one := _tested(fitter, model, effect, searched, before, seed)) is not None
        ]
        idle = [
            one for one in found if one.p_value > alpha or one.gain < MATERIAL_SHARE * one.before
        ]
        if not idle:
            return model, found
        model = min(idle, key=lambda one: one.gain).rest


def _tested(
    fitter: LinkFitter,
    model: LinkModel,
    effect: Candidate,
    searched: Searched,
    before: dict[Link, float],
    seed: int,
) -> _Needed | None:
    """An effect beside the model without it, among all that were tried; None without such a fit."""
    known, base = searched.known, searched.base
    links = seen_in(fitter, known, effect.name)
    rest = without(fitter, model, effect, known) or _from_base(fitter, base, model, effect, links)
    if rest is None:
        return None
    rows, left_out = fitter.in_links(links), _left_out(fitter, rest, links)
    step = left_out.effect((model.rows - rest.rows)[rows])
    extended = [(model.rows[rows], model.jacobian()[rows])]
    own = rest.jacobian()[rows]
    for other in known:
        taken = rest.freed & {p.name for p in other.effect.parameters}
        if other.effect.name not in rest.names and not taken:
            wider = np.column_stack([own, other.rows[rows]])
            basis = orthonormal(wider)
            left = rest.rows[rows] - basis @ (basis.T @ rest.rows[rows])
            extended.append((left, wider))
    chance = best_of_many_p_values(rest.rows[rows], own, extended, seed=seed)[0]
    unseen = compare_with_reference(left_out.losses, step.losses[:, np.newaxis], seed=seed)
    return _Needed(
        effect=effect,
        links=links,
        rest=rest,
        gain=float(unseen.gain[0]),
        before=float(np.mean([before[link] for link in links])),
        p_value=max(
            chance,
            float(compare_effects([step], seed=seed).p_value[0]),
            float(unseen.p_value[0]),
        ),
    )


def _from_base(
    fitter: LinkFitter,
    base: LinkModel,
    model: LinkModel,
    effect: Candidate,
    links: frozenset[Link],
) -> LinkModel | None:
    """A model without an effect where nuisance parameters fitted with it have no prediction."""
    rest = tuple(other for other in model.effects if other.name != effect.name)
    start = {p.name: model.values[p.name] for other in rest for p in other.parameters}
    return fitter.fit(base, rest, start, links)


def _beside_rivals(
    fitter: LinkFitter,
    model: LinkModel,
    one: _Needed,
    known: Sequence[Signature],
    alpha: float,
    seed: int,
    steps: Steps,
) -> Judged:
    """An effect beside those that may stand in its place."""
    rest, rows = one.rest, fitter.in_links(one.links)
    left_out = _left_out(fitter, rest, one.links)
    mine = left_out.effect((model.rows - rest.rows)[rows]).losses
    rivals: list[Rival] = []
    for fit in _rival_fits(fitter, model, one, known, steps):
        theirs = left_out.effect((fit.rows - rest.rows)[rows]).losses
        worse = compare_with_reference(theirs, mine[:, np.newaxis], seed=seed)
        p_value = float(worse.p_value[0])
        if _adds(fitter, fit, model, one.links, seed) > alpha:
            p_value = _adds(fitter, model, fit, one.links, seed)
        rivals.append(
            Rival(
                effect=fit.effects[-1],
                model=fit,
                excess=float(worse.gain[0]),
                p_value=p_value,
            )
        )
    return Judged(
        effect=one.effect,
        links=one.links,
        gain=one.gain,
        before=one.before,
        p_value=one.p_value,
        rivals=tuple(sorted(rivals, key=lambda rival: rival.excess)),
        exact=True,  # rows without repeats do not show what is left
    )


def _adds(
    fitter: LinkFitter, one: LinkModel, other: LinkModel, links: frozenset[Link], seed: int
) -> float:
    """p-value of a model that adds nothing to another."""
    rows = fitter.in_links(links)
    step = _left_out(fitter, other, links).effect((one.rows - other.rows)[rows])
    return float(compare_effects([step], seed=seed).p_value[0])


def _rival_fits(
    fitter: LinkFitter,
    model: LinkModel,
    one: _Needed,
    known: Sequence[Signature],
    steps: Steps,
) -> list[LinkModel]:
    """Fits with others in the place of an effect: another form, another of the family, others."""
    effect = one.effect
    _, found = promises(one.rest, known)
    own = max((p.gain for p in found if p.effect.name == effect.name), default=0.0)
    others = [
        p
        for p in found
        if p.effect.name not in model.names - {effect.name}
        and p.effect.label != effect.label
        and seen_in(fitter, known, p.effect.name) & one.links
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
            fitter,
            one.rest,
            some,
            known,
            most=most,
            forms=1,
            least=_RIVAL_WORTH * own,
            links=one.links,
            steps=steps,
        )
    ]
