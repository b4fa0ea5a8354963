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

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.effects_on_rig import candidate
from pamsim.comparison.link_inputs import smoothed
from pamsim.comparison.links import JOINT, Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel, project_out
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.diagnosis.by_link.units import Units
from pamsim.effects.effect import Effect, size
from pamsim.engine.equilibrium import moment_arms, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.inference.projected_effect import orthonormal
from pamsim.physics.learned import LENGTH, SPEED, Learned, learned_force
from pamsim.recordings.trial import Trial

POSITION, RATE = "position", "speed"

_POSITIONS, _RATES = (0.0, 100.0), (0.2, 99.8)
"""Percentiles of what was visited, between which a curve is spread: rates of read positions have
outliers."""

_FIELD = {POSITION: "force_", RATE: "drag_"}
_ENDS = {POSITION: ("low", "high"), RATE: ("slowest", "fastest")}
_COUNT = {POSITION: LENGTH, RATE: SPEED}

_POINTS = 60  # of a curve that is written
_WEAKEST = 1e-3  # a direction of control forces that is seen less, relative, begins at 0
_FARTHEST = 100.0  # control force that a fit begins with at most [N]: promises are of first order
_TYPICAL, _MOST = 5.0, 2e3
"""Control force by which steps of fits are scaled, which changes the readings of a small arm, and
the largest that is sought [N]."""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A learned torque.

    Attributes:
        joint: on which.
        over: ``position`` or ``speed`` of the joint.
        at: (n,) of them, from one end of what was visited to the other [rad or m, or per s].
        torque: (n,) in the direction in which the position grows [N m or N].
        reach: (n,) half width of its 95 % band; infinite where the data do not show the curve.
    """

    joint: str
    over: str
    at: FloatArray
    torque: FloatArray
    reach: FloatArray


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


@dataclass(frozen=True)
class _Place:
    """A joint, the tendon of the muscle that stands for it, and what was visited of both.

    Attributes:
        at: (n,) positions from one end to the other [rad or m].
        rates: slowest and fastest change of the position [per s].
        length: (n,) of the tendon at the positions [m].
        arm: (n,) change of that length with the position.
    """

    joint: str
    muscle: str
    at: FloatArray
    rates: tuple[float, float]
    length: FloatArray
    arm: FloatArray

    @property
    def middle(self) -> float:
        """The arm that speeds of the tendon are taken with."""
        return float(np.mean(self.arm))

    def ends(self, kinds: Sequence[str] = (POSITION, RATE)) -> dict[str, float]:
        """Parameters of the ends of curves over position, speed or both [SI]."""
        values = {
            POSITION: (float(self.length.min()), float(self.length.max())),
            RATE: sorted(self.middle * one for one in self.rates),
        }
        return {
            f"{self.muscle}:learned.{name}": value
            for kind in kinds
            for name, value in zip(_ENDS[kind], values[kind], strict=True)
        }


def learned_shape(
    rig: Rig,
    trials: Sequence[Trial],
    model: LinkModel,
    nuisance: Sequence[str],
    links_of: Callable[[Rig], tuple[ChainSimulator, Units]],
    *,
    alpha: float,
    seed: int,
) -> LearnedShape | None:
    """Learn what is left behind the muscles.

    Args:
        rig: as it is.
        trials: that are fitted and judged.
        model: with the effects that are certain.
        nuisance: parameters that are refitted with the curves.
        links_of: links of the trials on a rig, and the rows that are fitted and judged.
        alpha: level at which curves must predict better.
        seed: random seed of the sign flips.

    Returns:
        The curves; None where they predict no better, or a joint has no tendon of its own.
    """
    places = _places(rig, trials)
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
            if fit is not None and better and better.p_value <= alpha and better.gain > 0.0:
                used, best, found, learned_over = one, fit, found or better, kinds
            left = unseen.remainders(best)
            if not any(left[link].counts(alpha) for link in links):
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
            curve for place in places for curve in _curves(place, learned_over, forces, errors)
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


def _effect(places: Sequence[_Place], kind: str) -> Effect:
    """The control forces of every joint's curve as an effect to fit."""
    return Effect(
        name=f"learned_over_{kind}",
        link="joint",
        family="unnamed",
        missing=f"a torque over the {kind}",
        look_alikes=(),
        separating="",
        parameters=tuple(
            size(f"{place.muscle}:learned.{_FIELD[kind]}{k}", _TYPICAL, -_MOST, _MOST)
            for place in places
            for k in range(1, _COUNT[kind] + 1)
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


def _places(rig: Rig, trials: Sequence[Trial]) -> list[_Place]:
    """Each joint that moves freely, with a tendon that runs over it alone."""
    found: list[_Place] = []
    for j, joint in enumerate(rig.joints):
        channel = rig.names.joint_channel(joint)
        seen = [trial for trial in trials if channel in trial.measured]
        if not seen:
            continue
        read = [smoothed(trial.time, trial.measured[channel]) for trial in seen]
        rates = [np.gradient(one, t.time) for one, t in zip(read, seen, strict=True)]
        at = np.linspace(*_between(read, _POSITIONS), _POINTS)
        poses = np.tile(rig.model.qpos0, (_POINTS, 1))
        poses[:, rig.position_addresses[j]] = at
        arms = np.array([moment_arms(rig, pose) for pose in poses])  # (n, m, j)
        over = np.abs(arms).max(axis=0) > 0.0
        alone = [m for m, row in enumerate(over) if row[j] and np.count_nonzero(row) == 1]
        if alone:
            lengths = np.array([tendon_lengths(rig, pose)[alone[0]] for pose in poses])
            found.append(
                _Place(
                    joint=joint,
                    muscle=list(rig.muscles)[alone[0]],
                    at=at,
                    rates=_between(rates, _RATES),
                    length=lengths,
                    arm=arms[:, alone[0], j],
                )
            )
    return found


def _between(
    signals: Sequence[FloatArray], percentiles: tuple[float, float]
) -> tuple[float, float]:
    low, high = np.percentile(np.concatenate(signals), percentiles).tolist()
    return low, high


def _curves(
    place: _Place, kinds: Sequence[str], forces: Mapping[str, float], errors: SizeErrors
) -> Iterator[Curve]:
    """The learned curves of a joint as torques on it.

    They are sums of the control forces. A constant may lie in either curve. Where there are two,
    the one over speed is 0 at rest.
    """
    visited = {POSITION: place.at, RATE: np.linspace(*place.rates, _POINTS)}
    at_rest = _columns(place, RATE, np.zeros(1)) if len(kinds) == 2 else {}
    for kind in kinds:
        columns = _columns(place, kind, visited[kind])
        if kind == RATE:
            columns = {n: column - at_rest.get(n, 0.0) for n, column in columns.items()}
        else:
            columns |= {n: place.arm / place.middle * torque for n, torque in at_rest.items()}
        yield Curve(
            joint=place.joint,
            over=kind,
            at=visited[kind],
            torque=sum((forces[n] * column for n, column in columns.items()), np.zeros(_POINTS)),
            reach=errors.reach(columns),
        )


def _columns(place: _Place, kind: str, at: FloatArray) -> dict[str, FloatArray]:
    """Control force -> torque (n,) of one newton of it at positions or speeds (n,)."""
    ends = {name.rpartition(".")[2]: end for name, end in place.ends((kind,)).items()}
    over_length = kind == POSITION
    lengths = np.interp(at, place.at, place.length) if over_length else np.zeros(at.size)
    speeds = np.zeros(at.size) if over_length else place.middle * at
    # A force against lengthening pulls the joint to where the tendon is shorter.
    arm = np.interp(at, place.at, place.arm) if over_length else place.middle
    found: dict[str, FloatArray] = {}
    for k in range(1, _COUNT[kind] + 1):
        one = Learned(**ends, **{f"{_FIELD[kind]}{k}": 1.0})
        force = [learned_force(one, *x) for x in zip(lengths, speeds, strict=True)]
        found[f"{place.muscle}:learned.{_FIELD[kind]}{k}"] = -arm * np.array(force)
    return found
