"""A loop of readings, up and down again, as rows: how far it opens at every level of the input.

A reversible curve, whatever its shape, has one free value at every level, so that only what
separates the branches is left to explain. Each level is a row: rising less falling output.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.chain_runs import Values
from pamsim.comparison.loop_effects import LoopEffect
from pamsim.comparison.rest_simulator import RestSimulator, row_blocks
from pamsim.core.errors import InputError
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.effects.effect import EffectParameter
from pamsim.inference.free_parameter import FreeParameter

CHANNEL = "length"

_NOTHING = 1e-9  # of a signal: what is left of it is rounding


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Readings along a path of the pressure, up and down.

    Attributes:
        pressure: (n,) in the order of the path [Pa].
        length: (n,) [m].
        rising: (n,) True on a rising branch.
        error: (n,) standard error of each length [m], or None if it is not known.
    """

    pressure: FloatArray
    length: FloatArray
    rising: NDArray[np.bool_]
    error: FloatArray | None = None


class LoopRows:
    """The levels of a loop that were read on both branches.

    Args:
        loop: readings.
        effects: that may open it.

    Attributes:
        level: (m,) pressures [Pa].
        branches: (2, m) rising and falling length there [m].
        error: (m,) standard error of their difference, in a unit of its own if the readings' are
            not known.
        candidates: the effects as a search takes them.

    Raises:
        InputError: if no pressure was read on both branches.
    """

    def __init__(self, loop: Loop, effects: Sequence[LoopEffect]) -> None:
        levels, number = np.unique(np.round(loop.pressure, 9), return_inverse=True)
        sides = loop.rising, ~loop.rising
        counts = np.array([np.bincount(number[side], minlength=levels.size) for side in sides])
        both = np.all(counts > 0, axis=0)
        if not np.any(both):
            raise InputError("no pressure was read on both branches, rising and falling")

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
        """Rising less falling length by effects, (m,) [m].

        Args:
            values: of their parameters [SI].
        """
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
        free = tuple(_free(p) for p in (opening, *shapes))
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


def _free(parameter: EffectParameter) -> FreeParameter:
    return FreeParameter(
        name=parameter.name,
        unit=parameter.unit or "1",
        start=parameter.typical,
        low=parameter.low,
        high=parameter.high,
    )
