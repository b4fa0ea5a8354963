"""What a learned curve looks like: the simplest of a few closed forms that follows it.

It is a description of the curve, not a name of its cause.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray

FOLLOWS = 0.95
"""Share of a curve's squares about its mean from which a form follows it: a picture of both shows
hardly a difference."""

_GRID = 40  # places, periods or speeds that a form is tried with
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, kw_only=True)
class Description:
    """A closed form that follows a curve.

    Attributes:
        form: ``constant``, ``spring``, ``stop`` or ``ripple`` over position; ``viscous``,
            ``quadratic`` or ``dry`` over speed.
        share: of the curve's squares about its mean that it takes; 1 is all.
        numbers: of the form, in the curve's units: ``torque``, ``stiffness``, where a stop begins
            (``begin``) and whether above (``side`` 1) or below (-1), ``amplitude`` and ``period``,
            ``damping``, ``coefficient``, and the ``speed`` at which dry friction is built up.
    """

    form: str
    share: float
    numbers: dict[str, float]


def description(over: str, at: FloatArray, torque: FloatArray) -> Description | None:
    """The form with the fewest numbers that follows a curve; of as many, the nearest one.

    Args:
        over: ``position`` or ``speed``.
        at: (n,) evenly spread.
        torque: (n,).
    """
    about_mean = float(np.sum((torque - torque.mean()) ** 2))
    if over == "position" and about_mean <= (1.0 - FOLLOWS) * float(torque @ torque):
        return Description(form="constant", share=1.0, numbers={"torque": float(torque.mean())})
    following: list[tuple[int, float, Description]] = []
    for form, columns, known in _over_position(at) if over == "position" else _over_speed(at):
        weights: FloatArray = np.linalg.lstsq(columns, torque, rcond=None)[0].astype(float)
        share = 1.0 - float(np.sum((torque - columns @ weights) ** 2)) / max(about_mean, _TINY)
        if share >= FOLLOWS:
            found = Description(form=form, share=share, numbers=_numbers(form, weights, known))
            following.append((columns.shape[1] + len(known), -share, found))
    return min(following, key=lambda one: one[:2])[2] if following else None


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


def _numbers(form: str, weights: FloatArray, known: dict[str, float]) -> dict[str, float]:
    first = float(weights[0])
    match form:
        case "spring" | "stop":
            return {"stiffness": -first, **known}
        case "ripple":
            return {"amplitude": float(np.hypot(*weights[:2])), **known}
        case "viscous":
            return {"damping": -first}
        case "quadratic":
            return {"coefficient": -first}
        case _:
            return {"torque": -first, **known}
