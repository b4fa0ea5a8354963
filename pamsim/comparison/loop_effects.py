"""Effects that may open a loop between rising and falling input, as signals along its path.

Each has one form: a signal with at most one number for its shape, along an input scaled to its
span.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.effects.catalog import EFFECTS
from pamsim.effects.effect import Effect, EffectParameter, change, shape
from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate
from pamsim.physics.hysteresis.maxwell_slip import play

_SUBSTEPS = 8  # of the Bouc-Wen equation between two points
_SLIPS = 4  # elements of the Maxwell-slip form
_TRAVEL = (0.1, 0.02, 0.05, 0.15, 0.2, 0.3, 0.45)  # of the span
_LAGS = (4.0, 1.0, 2.0, 8.0, 16.0)  # points of the path


@dataclass(frozen=True, kw_only=True)
class LoopEffect:
    """One form of an effect.

    Attributes:
        effect: which; its first parameter is how far it opens the loop.
        signal: scaled input along the path (n,), and the number of its shape, to the signal (n,).
        moving: True for what vanishes where readings are taken at rest.
    """

    effect: Effect
    signal: Callable[[FloatArray, float], FloatArray]
    moving: bool = False


def _along(path: FloatArray, step: Callable[[float, float], float]) -> FloatArray:
    """A memory driven along a path; a closed path is run through once before."""
    start = [*path] if abs(path[-1] - path[0]) < 0.05 else []
    memory, signal = float(path[0]), np.empty(path.size)
    for x in start:
        memory = step(memory, float(x))
    for k, x in enumerate(path):
        memory = step(memory, float(x))
        signal[k] = memory
    return signal


def stop_signal(path: FloatArray, travel: float) -> FloatArray:
    """One block on a spring: input minus play operator, over the travel at which it slips."""
    return (path - _along(path, lambda z, x: play(x, z, travel))) / travel


def maxwell_slip_signal(path: FloatArray, travel: float) -> FloatArray:
    """Blocks in parallel that slip one after the other, the last at the travel (Iwan 1966)."""
    parts = [stop_signal(path, travel * (k + 1) / _SLIPS) for k in range(_SLIPS)]
    return np.mean(parts, axis=0)


def bouc_wen_signal(path: FloatArray, travel: float) -> FloatArray:
    """Internal variable of the normalised Bouc-Wen model that turns over within the travel."""
    before = [float(path[0])]

    def step(z: float, x: float) -> float:
        h = (x - before[0]) / _SUBSTEPS
        before[0] = x
        if h == 0.0:
            return z
        for _ in range(_SUBSTEPS):
            half = z + 0.5 * abs(h) * bouc_wen_rate(z, np.sign(h), travel, 0.5, 1.0)
            z += abs(h) * bouc_wen_rate(half, np.sign(h), travel, 0.5, 1.0)
        return min(max(z, -1.0), 1.0)

    # `_along` begins its memory at the input; that of this operator begins at rest.
    shifted = path - path[0]
    before[0] = 0.0
    return _along(shifted, step)


def rate_signal(path: FloatArray, _: float) -> FloatArray:
    """A resistance to motion: its direction, at turning points the mean of both sides."""
    sign = np.sign(np.diff(path))
    return 0.5 * (np.concatenate([sign[:1], sign]) + np.concatenate([sign, sign[-1:]]))


def lag_signal(path: FloatArray, lag: float) -> FloatArray:
    """Creep: input less what a first-order lag has made up, in points of the path."""
    keep = np.exp(-1.0 / lag)
    return path - _along(path, lambda z, x: keep * z + (1.0 - keep) * x)


def drift_signal(path: FloatArray, _: float) -> FloatArray:
    """A drift in time."""
    return np.linspace(-1.0, 1.0, path.size)


def _opening(form: str) -> EffectParameter:
    # Lengths differ between the branches by less than they change along them.
    return change(f"{form}.opening", 0.05, -1.0, 1.0, scaled_by="span of the output", unit="m")


def _form(name: str, form: str, missing: str, *shapes: EffectParameter) -> Effect:
    """An effect of the catalog as a signal in a loop."""
    return replace(
        EFFECTS[name],
        form=form,
        missing=missing,
        equation="",
        parameters=(_opening(form), *shapes),
        separating="the same loop at a tenth of the rate: creep and what grows with the rate close"
        " it, hysteresis does not",
    )


LOOP_EFFECTS: tuple[LoopEffect, ...] = (
    *(
        LoopEffect(
            effect=_form(
                "muscle_hysteresis",
                form,
                "rate-independent hysteresis",
                shape(f"{form}.travel_over_span", _TRAVEL[0], 0.01, most, starts=_TRAVEL[1:]),
            ),
            signal=signal,
        )
        for form, signal, most in (
            ("stop", stop_signal, 0.49),  # one that slips after half of the span never slips back
            ("maxwell_slip", maxwell_slip_signal, 0.49 * _SLIPS),
            ("bouc_wen", bouc_wen_signal, 2.0),
        )
    ),
    LoopEffect(
        effect=_form("viscous_friction", "viscous", "a resistance that grows with the rate"),
        signal=rate_signal,
        moving=True,
    ),
    LoopEffect(
        effect=_form(
            "viscoelastic_creep",
            "creep",
            "creep",
            shape("creep.lag_in_points", _LAGS[0], 0.5, 32.0, starts=_LAGS[1:]),
        ),
        signal=lag_signal,
    ),
    LoopEffect(
        effect=Effect(
            name="drift",
            link="sensor",
            family="drift",
            missing="a drift in time",
            parameters=(_opening("drift"),),
            look_alikes=("viscoelastic_creep", "muscle_hysteresis"),
            separating="the same loop once more: a drift goes on, and the second loop lies beside"
            " the first",
        ),
        signal=drift_signal,
    ),
)
