"""What was learned where nothing has a name, as a result states it.

A curve is described by the simplest of a few closed forms that follows it. That is no name of its
cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from pamsim.core.encoding import json_property
from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.diagnosis.by_link.curve_places import Curve, Kind
from pamsim.diagnosis.by_link.curve_properties import properties
from pamsim.diagnosis.by_link.learned_shape import LearnedShape
from pamsim.engine.rig import Rig

FOLLOWS = 0.95
"""Share of a curve's squares about its mean from which a form follows it: a picture of both shows
hardly a difference."""

_SIZE = {
    "spring": ("stiffness", -1.0),
    "stop": ("stiffness", -1.0),
    "viscous": ("damping", -1.0),
    "quadratic": ("coefficient", -1.0),
    "dry": ("torque", -1.0),
    "line": ("slope", 1.0),
    "bump": ("height", 1.0),
}
"""Form -> name of its size, and the sign with which it is stated: torques pull back."""

_GRID = 40  # places, periods or speeds that a form is tried with
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, kw_only=True)
class LearnedEntry:
    """A learned curve. It is a description of what is missing, not a name."""

    kind: Kind  # of curve
    acts_at: str  # joint, a muscle, the muscles or the valves, as `Curve` has it
    joint: str = ""  # over whose position or speed it runs; empty for contraction and opening
    at: FloatArray  # (n,) what it runs over
    at_unit: str  # ``deg`` or ``m``, the same per second, or ``%`` of a contraction or opening
    # (n,) torque in the direction in which the position grows, tension, read less true position, or
    # change of the flow
    value: FloatArray
    # ``N*m`` or, on a joint that slides, ``N``; of a tension ``N`` or ``N/bar``; of a sensor's
    # error that of the position; of a change of the flow ``%``
    unit: str
    # (n, 2) ends of its 95 % intervals, place by place; infinite where the data do not show it
    band95: FloatArray
    # What it obeys within its band, see `pamsim.diagnosis.by_link.curve_properties`
    holds: tuple[str, ...]
    # Closed form that follows it; empty for none. See
    # `pamsim.diagnosis.by_link.learned_entry.description`
    resembles: str
    # Of that form, in these units
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])
    links: tuple[str, ...]  # in which the curves are seen
    before: float  # mean square that is left there without all curves, in the variance of the noise
    after: float  # the same with them
    p_value: float  # of curves that predict no better
    # What other curves, in place of all that were learned, predict no worse for certain
    tied: tuple[str, ...] = ()

    @json_property
    def over(self) -> str:
        """What it runs over, see `Kind.over`."""
        return self.kind.over

    @json_property
    def where(self) -> str:
        """What it runs over the position of, and at which muscle, if it acts at one."""
        if self.joint in ("", self.acts_at):
            return self.acts_at
        return f"{self.joint}, at {self.acts_at}"

    @json_property
    def words(self) -> str:
        """The form that follows it, in words; empty for none."""
        numbers = {name: f"{value:.3g}" for name, value in self.numbers.items()}
        way = "up" if self.numbers.get("side", 1.0) > 0.0 else "down"
        return _WORDS.get(self.resembles, "").format(
            **numbers, way=way, at=self.at_unit, force=self.unit
        )


_WORDS = {
    "constant": "a constant {value} {force}",
    "spring": "a spring of {stiffness} {force}/{at}",
    "stop": "a stop from {begin} {at} {way}, {stiffness} {force}/{at}",
    "ripple": "a ripple of +-{amplitude} {force}, its period {period} {at}",
    "viscous": "viscous friction of {damping} {force} per {at}",
    "quadratic": "a drag of {coefficient} {force} per ({at})^2",
    "dry": "dry friction of {torque} {force}, built up within {speed} {at}",
    "line": "a straight line of {slope} {force} per {at}",
    "bump": "a bump of {height} {force} at {middle} {at}, {width} {at} wide",
}
"""Form -> what it is, with its numbers."""

_POWERS = {
    **dict.fromkeys(("begin", "period", "speed", "middle", "width"), (1, 0)),
    **dict.fromkeys(("stiffness", "damping", "slope"), (-1, 1)),
    "coefficient": (-2, 1),
    "side": (0, 0),
}
"""Number of a form -> power of the unit of the curve's places in it, and of its values; those of
others are 0 and 1."""


def learned_entries(rig: Rig, shape: LearnedShape | None) -> tuple[LearnedEntry, ...]:
    """Every learned curve with what it looks like."""
    if shape is None:
        return ()
    found: list[LearnedEntry] = []
    for curve in shape.curves:
        at_unit, scale, unit, factor = _units(rig, curve)
        form, numbers = description(curve.kind, curve.at, curve.value)
        band = np.column_stack([curve.value - curve.reach, curve.value + curve.reach])
        found.append(
            LearnedEntry(
                kind=curve.kind,
                acts_at=curve.acts_at,
                joint=curve.joint,
                at=curve.at * scale,
                at_unit=at_unit,
                value=curve.value * factor,
                unit=unit,
                band95=band * factor,
                holds=properties(curve),
                resembles=form,
                numbers={
                    name: one * scale**at * factor**value
                    for name, one in numbers.items()
                    for at, value in [_POWERS.get(name, (0, 1))]
                },
                links=tuple(link.name for link in shape.links),
                before=shape.before,
                after=shape.after,
                p_value=shape.p_value,
                tied=tuple(" and ".join(kinds) for kinds in shape.tied),
            )
        )
    return tuple(found)


def _units(rig: Rig, curve: Curve) -> tuple[str, float, str, float]:
    """Unit of a curve's places and its factor on SI, and those of its values."""
    if curve.kind is Kind.PRESSED:
        return "%", 100.0, "N/bar", PA_PER_BAR
    if curve.kind is Kind.UNPRESSED:
        return "%", 100.0, "N", 1.0
    if curve.kind is Kind.FLOW:
        return "%", 100.0, "%", 100.0
    turns = rig.joints[curve.joint] == "angle"
    at, scale, torque = ("deg", DEG_PER_RAD, "N*m") if turns else ("m", 1.0, "N")
    if curve.kind is Kind.READING:
        return at, scale, at, scale
    if curve.kind is Kind.ARM:
        return at, scale, "%", 100.0
    return f"{at}/s" if curve.kind is Kind.RATE else at, scale, torque, 1.0


def description(kind: Kind, at: FloatArray, value: FloatArray) -> tuple[str, dict[str, float]]:
    """The form with the fewest numbers that follows a curve; of as many, the nearest one.

    It is ``constant``, ``spring``, ``stop`` or ``ripple`` over position; ``viscous``, ``quadratic``
    or ``dry`` over speed; ``constant``, ``line`` or ``bump`` over contraction or opening;
    ``constant``, ``line`` or ``ripple`` of a sensor's error; ``constant``, ``line`` or ``bump`` of
    dry friction and a moment arm; empty if none follows. Places (n,) are evenly spread.

    Its numbers are in the curve's units: ``value``, ``stiffness``, where a stop begins (``begin``)
    and whether above (``side`` 1) or below (-1), ``amplitude`` and ``period``, ``damping``,
    ``coefficient``, the ``torque`` of dry friction and the ``speed`` at which it is built up,
    ``slope``, and the ``height``, ``middle`` and ``width`` (two standard deviations) of a bump.
    """
    about_mean = float(np.sum((value - value.mean()) ** 2))
    flat = about_mean <= (1.0 - FOLLOWS) * float(value @ value)
    if kind is not Kind.RATE and flat:
        return "constant", {"value": float(value.mean())}
    following: list[tuple[int, float, str, dict[str, float]]] = []
    for form, columns, known in _FORMS[kind](at):
        weights: FloatArray = np.linalg.lstsq(columns, value, rcond=None)[0].astype(float)
        share = 1.0 - float(np.sum((value - columns @ weights) ** 2)) / max(about_mean, _TINY)
        if share >= FOLLOWS:
            count = columns.shape[1] + len(known)
            first, *others = weights.tolist()
            if form == "ripple":
                size = {"amplitude": float(np.hypot(first, others[0]))}
            else:
                name, sign = _SIZE[form]
                size = {name: sign * first}
            following.append((count, -share, form, {**size, **known}))
    return min(following, key=lambda one: one[:2], default=(0, 0.0, "", {}))[2:]


Form = tuple[str, FloatArray, dict[str, float]]


def _over_position(at: FloatArray) -> Iterator[Form]:
    ones = np.ones_like(at)
    yield "spring", np.column_stack([at, ones]), {}
    for begin in np.linspace(at[0], at[-1], _GRID + 2)[1:-1].tolist():
        for side in (1.0, -1.0):
            beyond = np.maximum(side * (at - begin), 0.0)
            yield "stop", np.column_stack([side * beyond, ones]), {"begin": begin, "side": side}
    yield from _ripples(at)


def _of_reading(at: FloatArray) -> Iterator[Form]:
    yield "line", np.column_stack([at, np.ones_like(at)]), {}
    yield from _ripples(at)


def _ripples(at: FloatArray) -> Iterator[Form]:
    ones, span = np.ones_like(at), float(np.ptp(at))
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


def _smooth(at: FloatArray) -> Iterator[Form]:
    ones, span = np.ones_like(at), float(np.ptp(at))
    yield "line", np.column_stack([at, ones]), {}
    for middle in np.linspace(at[0], at[-1], _GRID).tolist():
        for width in np.geomspace(0.1, 1.0, _GRID).tolist():
            deviation = 0.5 * width * span
            bump = np.exp(-0.5 * ((at - middle) / deviation) ** 2)
            yield "bump", bump[:, np.newaxis], {"middle": middle, "width": width * span}


_FORMS = {
    Kind.POSITION: _over_position,
    Kind.RATE: _over_speed,
    Kind.PRESSED: _smooth,
    Kind.UNPRESSED: _smooth,
    Kind.READING: _of_reading,
    Kind.FLOW: _smooth,
    Kind.FRICTION: _smooth,
    Kind.ARM: _smooth,
}
"""Kind of curve -> forms that may follow it."""
