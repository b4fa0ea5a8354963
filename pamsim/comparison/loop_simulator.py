"""A loop of readings, up and down again, as rows: how far it opens at every level of the input.

A reversible curve, whatever its shape, has one free value at every level, so that only what
separates the branches is left to explain. Each level is a row: rising less falling output.

Effects that may open a loop have one form each: a signal along its path with at most one number for
its shape, along an input scaled to its span.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.chain_runs import Values
from pamsim.comparison.rest_simulator import RestSimulator, row_blocks
from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.effects.catalog import EFFECTS
from pamsim.effects.effect import Effect, EffectParameter, change, shape
from pamsim.inference.free_parameter import FreeParameter
from pamsim.physics.hysteresis.bouc_wen import bouc_wen_rate
from pamsim.physics.hysteresis.maxwell_slip import play

CHANNEL = "length"

_NOTHING = 1e-9  # of a signal: what is left of it is rounding
_SUBSTEPS = 8  # of the Bouc-Wen equation between two points
_SLIPS = 4  # elements of the Maxwell-slip form
_TRAVEL = (0.1, 0.02, 0.05, 0.15, 0.2, 0.3, 0.45)  # of the span
_LAGS = (4.0, 1.0, 2.0, 8.0, 16.0)  # points of the path


@dataclass(frozen=True, kw_only=True)
class LoopEffect:
    """One form of an effect."""

    effect: Effect  # which; its first parameter is how far it opens the loop
    # Scaled input along the path (n,), and the number of its shape, to the signal (n,)
    signal: Callable[[FloatArray, float], FloatArray]
    moving: bool = False  # True for what vanishes where readings are taken at rest


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


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Readings along a path of the pressure, up and down."""

    pressure: FloatArray  # (n,) in the order of the path [Pa]
    length: FloatArray  # (n,) [m]
    rising: NDArray[np.bool_]  # (n,) True on a rising branch
    # (n,) standard error of each length [m], or None if it is not known
    error: FloatArray | None = None


class LoopRows:
    """The levels of a loop that were read on both branches, with effects that may open it.

    Attributes:
        level: (m,) pressures [Pa].
        branches: (2, m) rising and falling length there [m].
        error: (m,) standard error of their difference, in a unit of its own if the readings' are
            not known.
        candidates: the effects as a search takes them.

    Raises:
        InputError: if no pressure was read on both branches, or the length never changes.
    """

    def __init__(self, loop: Loop, effects: Sequence[LoopEffect]) -> None:
        levels, number = np.unique(np.round(loop.pressure, 9), return_inverse=True)
        sides = loop.rising, ~loop.rising
        counts = np.array([np.bincount(number[side], minlength=levels.size) for side in sides])
        both = np.all(counts > 0, axis=0)
        if not np.any(both):
            raise InputError(
                "no pressure was read on both branches; read the same levels rising and falling"
            )
        if np.ptp(loop.length) == 0.0:
            raise InputError(f"the length never changes from {loop.length[0]:g} m: no loop")

        def mean(values: FloatArray) -> FloatArray:
            sums = [np.bincount(number[s], values[s], minlength=levels.size) for s in sides]
            return np.array(sums)[:, both] / counts[:, both]

        self.loop, self.level, self.branches = loop, levels[both], mean(loop.length)
        square = np.ones(loop.length.size) if loop.error is None else loop.error**2
        self.error: FloatArray = np.sqrt(np.sum(mean(square) / counts[:, both], axis=0))
        self._mean = mean
        path = (loop.pressure - loop.pressure.min()) / np.ptp(loop.pressure)
        self._path = path
        self._effects = {own.effect.label: own for own in effects}
        self._openings: dict[tuple[str, float], FloatArray] = {}
        tried = [self._candidate(own) for own in effects]
        names = [one.name for one in tried]
        self.candidates = tuple(
            replace(one, usual=names.index(one.name) == i) for i, one in enumerate(tried)
        )

    @property
    def apart(self) -> FloatArray:
        """Rising less falling length at each level, (m,) [m]."""
        return self.branches[0] - self.branches[1]

    def opened(self, values: Values) -> FloatArray:
        """Rising less falling length by effects with values of their parameters [SI], (m,) [m]."""
        total = np.zeros(self.level.size)
        for label, own in self._effects.items():
            opening, *shapes = own.effect.parameters
            if values.get(opening.name, 0.0) != 0.0:
                at = values[shapes[0].name] if shapes else 0.0
                total += values[opening.name] * self._opening(label, at)
        return total

    def simulator(self, variance: float) -> RestSimulator:
        """The rows, with a variance of their noise [m^2], the mean over the levels."""
        names = [f"{pressure / PA_PER_KPA:g} kPa" for pressure in self.level]
        noise = variance * self.error**2 / float(np.mean(self.error**2))
        return RestSimulator(
            lambda sets: [self.opened(values) - self.apart for values in sets],
            row_blocks(names, CHANNEL, noise),
            self.level[:, np.newaxis],
            {},
        )

    def _opening(self, label: str, at: float) -> FloatArray:
        """A signal's rising less falling values, the largest of them 1; 0 where none differ."""
        if (label, at) not in self._openings:
            rising, falling = self._mean(self._effects[label].signal(self._path, at))
            apart = rising - falling
            largest = float(max(apart, key=abs))
            known = abs(largest) > _NOTHING
            self._openings[label, at] = apart / largest if known else np.zeros_like(apart)
        return self._openings[label, at]

    def _candidate(self, own: LoopEffect) -> Candidate:
        span = float(np.ptp(self.loop.length))
        opening, *shapes = own.effect.parameters
        opening = opening.scaled(span)
        free = tuple(
            FreeParameter(name=p.name, unit=p.unit or "1", start=p.typical, low=p.low, high=p.high)
            for p in (opening, *shapes)
        )
        variants: list[Mapping[str, float]] = [
            {shape.name: value} for shape in shapes for value in (shape.typical, *shape.starts)
        ]
        probes = tuple(
            Probe(
                size=1.0,
                values={opening.name: opening.typical, **variant},
                shape=tuple(variant.values()),
            )
            for variant in variants or [{}]
        )
        return Candidate(
            effect=own.effect, parameters=free, neutral={opening.name: 0.0}, probes=probes
        )
