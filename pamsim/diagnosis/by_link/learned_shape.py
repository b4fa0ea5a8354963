"""What has no name gets a shape: a torque over a joint's position or speed, learned from the data.

Where more than noise is left behind the muscles and no effect tried explains it, curves without a
formula stand in (`pamsim.physics.learned`): forces along a tendon over its length and its speed,
fitted through the simulator as the effects are. They are judged as an effect is, on units that no
fit has seen. A braid that locks is a torque over the position, too: nuisance parameters keep what
the rig states, and are refitted only where more than noise is left and the curves then predict
better. A curve is a description, never a name. Without load cells a force of the muscles over
their length is a torque over the joint's position, too: which of them it is stays open.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.effects_on_rig import candidate
from pamsim.comparison.links import JOINT, Link
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.joint_curves import (
    COUNT,
    FIELD,
    POSITION,
    RATE,
    Curve,
    Place,
    curves_of,
    places_of,
)
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel, project_out
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.diagnosis.by_link.units import Units
from pamsim.effects.effect import Effect, size
from pamsim.engine.rig import Rig
from pamsim.inference.projected_effect import orthonormal
from pamsim.recordings.trial import Trial

_WEAKEST = 1e-3  # a direction of control forces that is seen less, relative, begins at 0
_FARTHEST = 100.0  # control force that a fit begins with at most [N]: promises are of first order
_TYPICAL, _MOST = 5.0, 2e3
"""Control force by which steps of fits are scaled, which changes the readings of a small arm, and
the largest that is sought [N]."""


@dataclass(frozen=True, kw_only=True)
class LearnedShape:
    """Curves that stand for what has no name.

    Attributes:
        curves: of every joint that has some.
        links: whose outputs they change.
        model: with the curves, as fitted.
        values: rig parameters of the curves, their ends among them [SI].
        before: mean square that is left in these links without them, in the judged units; 1 is
            noise.
        after: the same with them.
        p_value: of curves that predict no better.
    """

    curves: tuple[Curve, ...]
    links: tuple[Link, ...]
    model: LinkModel
    values: Mapping[str, float]
    before: float
    after: float
    p_value: float


def learned_shape(
    rig: Rig,
    trials: Sequence[Trial],
    model: LinkModel,
    nuisance: Sequence[str],
    links_of: Callable[[Rig], tuple[ChainSimulator, Units]],
    *,
    seed: int,
) -> LearnedShape | None:
    """Learn what is left behind the muscles.

    Args:
        rig: as it is.
        trials: that are fitted and judged.
        model: with the effects that are certain.
        nuisance: parameters that are refitted with the curves.
        links_of: links of the trials on a rig, and the rows that are fitted and judged.
        seed: random seed of the sign flips.

    Returns:
        The curves; None where they predict no better, or a joint has no tendon of its own.
    """
    places = places_of(rig, trials)
    if not places:
        return None
    ends = {name: end for one in places for name, end in one.ends().items()}
    with_ends = rig.with_parameters(ends)
    simulator, units = links_of(with_ends)
    links = frozenset(link for link in simulator.links if JOINT in link.parts)
    fitter = LinkFitter(simulator, nuisance, units)
    own = {name: value for name, value in model.values.items() if name not in fitter.nuisance}
    # Nuisance parameters have stood in for what is left: fits with curves begin as the rig states.
    rest, begin = (
        fitter.everywhere(replace(fitter.stated, effects=model.effects, values=values))
        for values in ({**fitter.nuisance, **model.values}, {**own, **fitter.nuisance})
    )
    shapes = {kind: candidate(with_ends, _effect(places, kind)) for kind in (POSITION, RATE)}
    unseen, best, found, learned_over = HeldOut(fitter, seed=seed), rest, None, ()
    as_stated = LinkFitter(simulator, (), units)
    used = fitter
    # One curve first: two must predict better than one.
    for kinds, start in _promised(fitter, begin, shapes, links):
        chosen = [shapes[kind] for kind in kinds]
        for one in (as_stated, fitter):
            fit = one.fit(begin, (*begin.effects, *chosen), start, links)
            better = None if fit is None else unseen.better(fit, best, links)
            if fit is not None and better and better.certain:
                used, best, found, learned_over = one, fit, found or better, kinds
            left = unseen.remainders(best)
            if not any(left[link].counts for link in links):
                break
        if learned_over != kinds:
            break
    if found is None:
        return None
    forces = {name: value for name, value in best.values.items() if ":learned." in name}
    before, after = (_mean(unseen, m, links) for m in (rest, best))
    errors = SizeErrors(used, best)
    best = replace(best, values={**fitter.nuisance, **best.values})
    return LearnedShape(
        curves=tuple(
            curve for place in places for curve in curves_of(place, learned_over, forces, errors)
        ),
        links=tuple(sorted(links, key=lambda link: link.order)),
        model=best,
        values={
            **{n: end for place in places for n, end in place.ends(learned_over).items()},
            **forces,
        },
        before=before,
        after=after,
        p_value=found.p_value,
    )


def _effect(places: Sequence[Place], kind: str) -> Effect:
    """The control forces of every joint's curve as an effect to fit."""
    return Effect(
        name=f"learned_over_{kind}",
        link="joint",
        family="unnamed",
        missing=f"a torque over the {kind}",
        look_alikes=(),
        separating="",
        parameters=tuple(
            size(f"{place.muscle}:learned.{FIELD[kind]}{k}", _TYPICAL, -_MOST, _MOST)
            for place in places
            for k in range(1, COUNT[kind] + 1)
        ),
    )


def _promised(
    fitter: LinkFitter,
    begin: LinkModel,
    shapes: Mapping[str, Candidate],
    links: frozenset[Link],
) -> list[tuple[tuple[str, ...], dict[str, float]]]:
    """Kinds of curves that promise something, and the control forces that fits begin with [N].

    The more promising kind comes first, then both together. Every control force costs what a
    parameter of an effect does (`LinkModel.criterion`). What nuisance parameters can take is not
    promised: the locking of both muscles' braids is a torque over the position, too.
    """
    none = {p.name: 0.0 for shape in shapes.values() for p in shape.parameters}
    both = replace(
        begin, effects=(*begin.effects, *shapes.values()), values={**begin.values, **none}
    )
    columns = fitter.sensitivities(both, list(none), links)
    basis = orthonormal(begin.jacobian())
    left = project_out(basis, begin.rows)
    cost = float(np.log(left.size))

    def promise(kinds: tuple[str, ...]) -> tuple[float, tuple[str, ...], dict[str, float]]:
        names = [p.name for kind in kinds for p in shapes[kind].parameters]
        own = project_out(basis, np.column_stack([columns[name] for name in names]))
        share = np.linalg.lstsq(own, -left, rcond=_WEAKEST)[0]
        after = float(np.sum((left + own @ share) ** 2)) + len(names) * cost
        scaled = (share * _TYPICAL).clip(-_FARTHEST, _FARTHEST).tolist()
        return after, kinds, dict(zip(names, scaled, strict=True))

    single = min(promise((POSITION,)), promise((RATE,)), key=lambda one: one[0])
    double, found, least = promise((POSITION, RATE)), [], float(left @ left)
    for after, kinds, start in (single, double):
        if after < least:
            found.append((kinds, start))
            least = after
    return found


def _mean(unseen: HeldOut, model: LinkModel, links: Collection[Link]) -> float:
    losses = unseen.losses(model)
    return float(np.mean([np.mean(loss) for link, loss in losses.items() if link in links]))
