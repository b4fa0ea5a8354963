"""What was learned where nothing has a name, as a result states it.

A curve is described by the simplest of a few closed forms that follows it. That is no name of its
cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from pamsim.core.encoding import json_property
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.diagnosis.by_link.joint_curves import POSITION, Curve
from pamsim.diagnosis.by_link.learned_shape import LearnedShape
from pamsim.engine.rig import Rig

FOLLOWS = 0.95
"""Share of a curve's squares about its mean from which a form follows it: a picture of both shows
hardly a difference."""

_SIZE = {
    "spring": "stiffness",
    "stop": "stiffness",
    "viscous": "damping",
    "quadratic": "coefficient",
    "dry": "torque",
}
"""Form -> name of its size, which pulls back."""

_GRID = 40  # places, periods or speeds that a form is tried with
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, kw_only=True)
class LearnedEntry:
    """A learned curve. It is a description of what is missing, not a name.

    Attributes:
        joint: on which it acts.
        over: ``position`` or ``speed`` of the joint.
        at: (n,) of them.
        at_unit: ``deg`` or ``m``, or the same per second.
        torque: (n,) in the direction in which the position grows.
        torque_unit: ``N*m``, or ``N`` on a joint that slides.
        band95: (n, 2) ends of its 95 % intervals, place by place; infinite where the data do not
            show it.
        holds: what it obeys within its band, see `properties`.
        resembles: closed form that follows it, see `description`; empty for none.
        numbers: of that form, in these units.
        links: in which the curves are seen.
        before: mean square that is left there without all curves, in the variance of the noise.
        after: the same with them.
        p_value: of curves that predict no better.
    """

    joint: str
    over: str
    at: FloatArray
    at_unit: str
    torque: FloatArray
    torque_unit: str
    band95: FloatArray
    holds: tuple[str, ...]
    resembles: str
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])
    links: tuple[str, ...]
    before: float
    after: float
    p_value: float

    @json_property
    def words(self) -> str:
        """The form that follows it, in words; empty for none."""
        numbers = {name: f"{value:.3g}" for name, value in self.numbers.items()}
        way = "up" if self.numbers.get("side", 1.0) > 0.0 else "down"
        return _WORDS.get(self.resembles, "").format(
            **numbers, way=way, at=self.at_unit, force=self.torque_unit
        )


_WORDS = {
    "constant": "a constant {torque} {force}",
    "spring": "a spring of {stiffness} {force}/{at}",
    "stop": "a stop from {begin} {at} {way}, {stiffness} {force}/{at}",
    "ripple": "a ripple of +-{amplitude} {force}, its period {period} {at}",
    "viscous": "viscous friction of {damping} {force} per {at}",
    "quadratic": "a drag of {coefficient} {force} per ({at})^2",
    "dry": "dry friction of {torque} {force}, built up within {speed} {at}",
}
"""Form -> what it is, with its numbers."""

_AT = {"stiffness": -1, "damping": -1, "coefficient": -2, "begin": 1, "period": 1, "speed": 1}
"""Number of a form -> power of the unit of position or speed in it."""


def learned_entries(rig: Rig, shape: LearnedShape | None) -> tuple[LearnedEntry, ...]:
    """Every learned curve with what it looks like."""
    if shape is None:
        return ()
    found: list[LearnedEntry] = []
    for curve in shape.curves:
        turns = rig.joints[curve.joint] == "angle"
        scale = DEG_PER_RAD if turns else 1.0
        form, numbers = description(curve.over, curve.at, curve.torque)
        found.append(
            LearnedEntry(
                joint=curve.joint,
                over=curve.over,
                at=curve.at * scale,
                at_unit=("deg" if turns else "m") + ("" if curve.over == POSITION else "/s"),
                torque=curve.torque,
                torque_unit="N*m" if turns else "N",
                band95=np.column_stack([curve.torque - curve.reach, curve.torque + curve.reach]),
                holds=properties(curve),
                resembles=form,
                numbers={name: one * scale ** _AT.get(name, 0) for name, one in numbers.items()},
                links=tuple(link.name for link in shape.links),
                before=shape.before,
                after=shape.after,
                p_value=shape.p_value,
            )
        )
    return tuple(found)


def properties(curve: Curve) -> tuple[str, ...]:
    """What a curve obeys within its band.

    Over speed it may be ``passive``: it brakes somewhere and drives nowhere for certain; and
    ``odd``: as large in both directions. Over position it may be ``restoring``: it falls somewhere
    and grows nowhere for certain. No curve over position takes or gives work in a closed cycle.
    """
    at, torque, reach = curve.at, curve.torque, curve.reach
    if curve.over == POSITION:
        rise, error = torque - torque[:, np.newaxis], reach + reach[:, np.newaxis]
        later = np.triu_indices(at.size, 1)
        return ("restoring",) if _only_below(rise[later], error[later]) else ()
    found = ("passive",) if _only_below(torque * np.sign(at), reach) else ()
    both = np.abs(at) <= min(-at[0], at[-1])
    mirrored, error = np.interp(-at[both], at, torque), np.interp(-at[both], at, reach)
    odd = both.any() and np.all(np.abs(torque[both] + mirrored) <= reach[both] + error)
    return (*found, "odd") if odd else found


def _only_below(values: FloatArray, error: FloatArray) -> bool:
    """Whether some values are below zero for certain, and none above."""
    return bool(np.any(values < -error) and np.all(values <= error))


def description(over: str, at: FloatArray, torque: FloatArray) -> tuple[str, dict[str, float]]:
    """The form with the fewest numbers that follows a curve; of as many, the nearest one.

    Args:
        over: ``position`` or ``speed``.
        at: (n,) evenly spread.
        torque: (n,).

    Returns:
        ``constant``, ``spring``, ``stop`` or ``ripple`` over position; ``viscous``, ``quadratic``
        or ``dry`` over speed; empty if none follows. And its numbers in the curve's units:
        ``torque``, ``stiffness``, where a stop begins (``begin``) and whether above (``side`` 1) or
        below (-1), ``amplitude`` and ``period``, ``damping``, ``coefficient``, and the ``speed`` at
        which dry friction is built up.
    """
    about_mean = float(np.sum((torque - torque.mean()) ** 2))
    if over == POSITION and about_mean <= (1.0 - FOLLOWS) * float(torque @ torque):
        return "constant", {"torque": float(torque.mean())}
    following: list[tuple[int, float, str, dict[str, float]]] = []
    for form, columns, known in _over_position(at) if over == POSITION else _over_speed(at):
        weights: FloatArray = np.linalg.lstsq(columns, torque, rcond=None)[0].astype(float)
        share = 1.0 - float(np.sum((torque - columns @ weights) ** 2)) / max(about_mean, _TINY)
        if share >= FOLLOWS:
            count = columns.shape[1] + len(known)
            first, *others = weights.tolist()
            if form == "ripple":
                size = {"amplitude": float(np.hypot(first, others[0]))}
            else:
                size = {_SIZE[form]: -first}
            following.append((count, -share, form, {**size, **known}))
    return min(following, key=lambda one: one[:2], default=(0, 0.0, "", {}))[2:]


Form = tuple[str, FloatArray, dict[str, float]]


def _over_position(at: FloatArray) -> Iterator[Form]:
    ones, span = np.ones_like(at), float(np.ptp(at))
    yield "spring", np.column_stack([at, ones]), {}
    for begin in np.linspace(at[0], at[-1], _GRID + 2)[1:-1].tolist():
        for side in (1.0, -1.0):
            beyond = np.maximum(side * (at - begin), 0.0)
            yield "stop", np.column_stack([side * beyond, ones]), {"begin": begin, "side": side}
    for turns in np.geomspace(1.0, 6.0, _GRID).tolist():
        phase = 2.0 * np.pi * turns * (at - at[0]) / span
        columns = np.column_stack([np.sin(phase), np.cos(phase), ones])
        yield "ripple", columns, {"period": span / turns}


def _over_speed(at: FloatArray) -> Iterator[Form]:
    yield "viscous", at[:, np.newaxis], {}
    yield "quadratic", (at * np.abs(at))[:, np.newaxis], {}
    for speed in np.geomspace(0.02, 0.5, _GRID).tolist():
        own = speed * float(np.max(np.abs(at)))
        yield "dry", np.tanh(at / own)[:, np.newaxis], {"speed": own}
