"""What has no name gets a shape: a torque, tension, sensor's error or flow, learned from data.

Where more than noise is left and no effect tried explains it, curves without a formula stand in:
forces along a tendon over its length and its speed and a dry friction that differs from length to
length (`pamsim.physics.learned`), tensions over the contraction with pressure and without
(`pamsim.physics.learned_tension`), a change of the moment arm over the position
(`pamsim.physics.chain`), an error of the joint's sensor over it (`pamsim.recordings.sensors`), and
a change of the valves' flow over their opening (`pamsim.physics.valves`). They are fitted through
the simulator as the effects are, and judged as an effect is, on units that no fit has seen. A braid
that locks is a torque over the position, too: nuisance parameters keep what the rig states, and are
refitted only where more than noise is left and the curves then predict better. A curve is a
description, never a name. Without load cells a tension over the contraction without pressure hardly
differs from a torque over the joint's position: which of them it is stays open.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.effects_on_rig import candidate
from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.diagnosis.by_link.curve_places import (
    Curve,
    JointPlace,
    Kind,
    Place,
)
from pamsim.diagnosis.by_link.curve_properties import properties
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.search import WORTH
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.diagnosis.by_link.units import Units
from pamsim.diagnosis.by_link.visited_places import places_of
from pamsim.effects.effect import Effect, size
from pamsim.engine.rig import Rig
from pamsim.inference.projection import orthonormal, project_out
from pamsim.recordings.trial import Trial

_WEAKEST = 1e-3  # a direction of control values that is seen less, relative, promises nothing
_TYPICAL = {
    Kind.POSITION: 5.0,
    Kind.RATE: 5.0,
    Kind.PRESSED: 5.0 / 3e5,
    Kind.UNPRESSED: 5.0,
    Kind.READING: 5e-3,
    Kind.FLOW: 0.1,
    Kind.FRICTION: 5.0,
    Kind.ARM: 0.05,
}
"""Control value by which steps of fits are scaled: a force [N] that changes the readings of a small
arm, the area [m^2] on which 3 bar make that force, an error of some tenths of a degree [rad], a
tenth of the flow, the force again, or a twentieth of the arm [-]."""
_MOST = 400.0  # largest control value that is sought, in typical ones


@dataclass(frozen=True, kw_only=True)
class LearnedShape:
    """Curves that stand for what has no name."""

    # Of every joint that has some, of the muscles, or of valves or a sensor
    curves: tuple[Curve, ...]
    links: tuple[Link, ...]  # whose outputs they change
    model: LinkModel  # with the curves, as fitted
    rest: LinkModel  # the same without them, which stands for the other links
    values: Mapping[str, float]  # rig parameters of the curves, their ends among them [SI]
    # Mean square that is left in these links without them, in the judged units; 1 is noise
    before: float
    after: float  # the same with them
    p_value: float  # of curves that predict no better
    # Kinds of other curves that predict the same units no worse for certain
    tied: tuple[tuple[Kind, ...], ...] = ()


def learned_shape(
    rig: Rig,
    trials: Sequence[Trial],
    model: LinkModel,
    nuisance: Sequence[str],
    links: Collection[Link],
    links_of: Callable[[Rig], tuple[ChainSimulator, Units]],
    *,
    seed: int,
) -> LearnedShape | None:
    """Learn what a model with the effects that are certain leaves in some links.

    ``links_of`` gives the links of the trials on a rig, and the rows that are fitted and judged.
    None where the curves predict no better, or nothing can have one.
    """
    places = places_of(rig, trials)
    possible = [
        kind
        for kind in Kind
        if _holding(kind.parts, links) and any(place.controls(kind) for place in places)
    ]
    if not possible:
        return None
    stated = _ends(places, possible)
    with_ends = rig.with_parameters(stated)
    simulator, units = links_of(with_ends)
    fitter = LinkFitter(simulator, nuisance, units)
    own = {name: value for name, value in model.values.items() if name not in fitter.nuisance}
    # Nuisance parameters have stood in for what is left: fits with curves begin as the rig states.
    rest, begin = (
        fitter.everywhere(replace(fitter.stated, effects=model.effects, values=values))
        for values in ({**fitter.nuisance, **model.values}, {**own, **fitter.nuisance})
    )
    shapes = {kind: candidate(with_ends, _effect(places, kind)) for kind in possible}
    unseen, best, found, learned_over = HeldOut(fitter, seed=seed), rest, None, ()
    tied: tuple[tuple[Kind, ...], ...] = ()
    as_stated = LinkFitter(simulator, (), units)
    used = fitter

    def fitted(by: LinkFitter, kinds: Sequence[Kind]) -> LinkModel | None:
        # From no curve: what a large effect promises to first order is far off.
        chosen = [shapes[kind] for kind in kinds]
        start = {p.name: stated.get(p.name, 0.0) for shape in chosen for p in shape.parameters}
        return by.fit(begin, (*begin.effects, *chosen), start, around(kinds))

    def around(kinds: Collection[Kind]) -> frozenset[Link]:
        # All behind the valves, since a curve that explains one link there may spoil another.
        parts = {p for k in kinds for p in ((VALVES,) if k is Kind.FLOW else (MUSCLE, JOINT))}
        return _holding(parts, simulator.links)

    def something_left(kinds: Collection[Kind]) -> bool:
        left = unseen.remainders(best)
        return any(left[link].counts for link in around(kinds))

    # One curve first: where it leaves something, or is none by itself, two must predict better.
    for offers in _promised(fitter, begin, shapes, stated, around(possible)):
        fits = [(fit, kinds) for kinds in offers if (fit := fitted(as_stated, kinds)) is not None]
        if not fits:
            break
        nearest, kinds = min(fits, key=lambda one: one[0].criterion)
        for one in (as_stated, fitter):
            fit = nearest if one is as_stated else fitted(one, kinds)
            better = None if fit is None else unseen.better(fit, best, around(kinds))
            material = better is not None and better.gain >= units.limits.material
            if fit is not None and better and better.certain and material:
                used, best, found, learned_over = one, fit, found or better, kinds
            if not something_left(kinds):
                break
        if learned_over == kinds:
            tied = tuple(
                others
                for fit, others in fits
                if others != kinds
                and not unseen.better(nearest, fit, around({*kinds, *others})).certain
            )
        if not something_left(possible):
            break
    if found is None:
        return None
    seen = _holding({part for kind in learned_over for part in kind.parts}, simulator.links)
    before, after = (_mean(unseen, m, seen) for m in (rest, best))
    if before - after < after - 1.0:  # as of effects: it explains less than what is left
        return None
    names = {p.name for kind in learned_over for p in shapes[kind].parameters}
    controls = {name: value for name, value in best.values.items() if name in names}
    errors = SizeErrors(used, best)
    best = replace(best, values={**fitter.nuisance, **best.values})
    curves = [c for place in places for c in place.curves(learned_over, controls, errors)]
    return LearnedShape(
        curves=tuple(curves),
        links=tuple(sorted(seen, key=lambda link: link.order)),
        model=best,
        rest=rest,
        values=_ends(places, learned_over) | controls | _dissipating(places, controls, curves),
        before=before,
        after=after,
        p_value=found.p_value,
        tied=tied,
    )


def _holding(parts: Collection[str], links: Collection[Link]) -> frozenset[Link]:
    """Links that hold one of these parts of the chain."""
    return frozenset(link for link in links if set(parts) & set(link.parts))


def _ends(places: Sequence[Place], kinds: Collection[Kind]) -> dict[str, float]:
    return {name: end for place in places for name, end in place.ends(kinds).items()}


def _dissipating(
    places: Sequence[Place], controls: Mapping[str, float], curves: Sequence[Curve]
) -> dict[str, float]:
    """Control values by which curves that are passive within their band give work in no cycle.

    What drives is left out then. For that, a drag at rest lies in the curve over position.
    """
    joints = [place for place in places if isinstance(place, JointPlace)]
    changed: dict[str, float] = {}
    if {Kind.POSITION, Kind.RATE} <= {curve.kind for curve in curves}:
        for place in joints:
            changed |= place.without_drag_at_rest(controls)
    braking = [curve for curve in curves if curve.kind in (Kind.RATE, Kind.FRICTION)]
    if braking and all("passive" in properties(curve) for curve in braking):
        changed |= {place.brakes: 1.0 for place in joints}
    return changed


def _effect(places: Sequence[Place], kind: Kind) -> Effect:
    """The control values of a kind of curve, at all places, as an effect to fit.

    So is the speed in which a dry friction is built up.
    """
    typical = _TYPICAL[kind]
    return Effect(
        name=f"learned_{kind.name.lower()}",
        family="unnamed",
        missing=kind,
        look_alikes=(),
        separating="",
        parameters=tuple(
            size(name, typical, -_MOST * typical, _MOST * typical)
            for place in places
            for name in place.controls(kind)
        )
        + tuple(
            size(name, *ends)
            for place in places
            if isinstance(place, JointPlace)
            for name, ends in place.speeds(kind).items()
        ),
    )


def _promised(
    fitter: LinkFitter,
    begin: LinkModel,
    shapes: Mapping[Kind, Candidate],
    stated: Mapping[str, float],
    links: frozenset[Link],
) -> Iterator[list[tuple[Kind, ...]]]:
    """Kinds of curves that are worth a fit.

    Single ones come first, then pairs, as long as they promise more than the best single one. Every
    control value costs what a parameter of an effect does (`LinkModel.criterion`). What nuisance
    parameters can take is not promised: the locking of both muscles' braids is a torque over the
    position, too.
    """
    none = {p.name: stated.get(p.name, 0.0) for shape in shapes.values() for p in shape.parameters}
    both = replace(
        begin, effects=(*begin.effects, *shapes.values()), values={**begin.values, **none}
    )
    columns = fitter.sensitivities(both, list(none), links)
    basis = orthonormal(begin.jacobian())
    left = project_out(basis, begin.rows)
    cost = float(np.log(left.size))

    def left_by(kinds: tuple[Kind, ...]) -> float:
        names = [p.name for kind in kinds for p in shapes[kind].parameters]
        own = project_out(basis, np.column_stack([columns[name] for name in names]))
        share = np.linalg.lstsq(own, -left, rcond=_WEAKEST)[0]
        return float(np.sum((left + own @ share) ** 2)) + len(names) * cost

    least = float(left @ left)
    for count in (1, 2):
        promised = {kinds: left_by(kinds) for kinds in combinations(shapes, count)}
        best = min(promised.values(), default=least)
        if best >= least:
            return
        # Promises are of first order, so that the nearest kind need not promise most.
        worth = least - WORTH * (least - best)
        least = best
        yield [kinds for kinds, after in promised.items() if after <= worth]


def _mean(unseen: HeldOut, model: LinkModel, links: Collection[Link]) -> float:
    losses = unseen.losses(model)
    return float(np.mean([np.mean(loss) for link, loss in losses.items() if link in links]))
