"""Closed forms that a learned curve may follow.

A curve is described by the simplest of a few that follows it. That is no name of its cause.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.curve_places import Kind

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


def description(kind: Kind, at: FloatArray, value: FloatArray) -> tuple[str, dict[str, float]]:
    """The form with the fewest numbers that follows a curve; of as many, the nearest one.

    It is ``constant``, ``spring``, ``stop`` or ``ripple`` over position; ``viscous``, ``quadratic``
    or ``dry`` over speed; ``constant``, ``line`` or ``bump`` over contraction or opening;
    ``constant``, ``line`` or ``ripple`` of a sensor's error; empty if none follows. Places (n,) are
    evenly spread.

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
}
"""Kind of curve -> forms that may follow it."""
