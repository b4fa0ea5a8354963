"""Profile likelihood of one fitted parameter: all others refitted at each of its values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.inference.difference_jacobian import BatchedResidual
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.search import RowWeights, SearchState, search
from pamsim.inference.simulator_fit import Simulate, SimulatorFit

_CHI2 = 3.841458820694124  # 95 % point of chi-squared with one degree of freedom
_POINTS = 4  # on each side of the optimum; a few more where the profile has to go on or to close
_STEPS = 50  # tried per point
_REACH = 1.3  # of the linear interval: how far the first points go
_FURTHER = 6  # doublings of the reach where the profile has not closed yet
_REFINED = 10  # points at most spent on the place where it closes
_STEEP = 3.0  # of the root of the threshold: beyond, the root of the rise is no straight line
_CLOSE = 0.01  # of the threshold
_BETTER = 0.1  # fall of -2 log likelihood that is no rounding


@dataclass(frozen=True, kw_only=True)
class Profile:
    """How much worse the fit becomes as one parameter leaves its optimum."""

    name: str  # of the parameter
    unit: str  # SI
    values: tuple[float, ...]  # of the parameter, increasing, m of them [unit]
    # Of -2 log likelihood above its smallest value, all others refitted, one per value; None where
    # the simulation diverges
    rise: tuple[float | None, ...]
    # Rise at the ends of the 95 % interval. It is that of chi-squared for white noise, and larger
    # by as much as the fit's interval is wider than a white one
    threshold: float
    low: float | None  # lower end of the 95 % interval [unit]; None if the range ends first
    high: float | None  # upper end [unit]; None if the range ends first
    sentence: str  # whether the profile closes on both sides
    evaluations: int  # simulated parameter vectors


def profile(
    simulate: Simulate,
    parameters: Sequence[FreeParameter],
    fit: SimulatorFit,
    name: str,
) -> Profile:
    """Move one parameter away from the optimum, refitting the others, until the data contradict it.

    The noise is held at what the fit estimated. Where that is coloured, the threshold is scaled so
    that profile and fit agree for a linear simulator (Pace, Salvan and Sartori, Statistica Sinica
    21, 2011, 129-148); what differs is then the simulator's curvature. Arguments are those of
    `fit_simulator`, and its result.

    Raises:
        InputError: no parameter of that name.
    """
    names = [p.name for p in parameters]
    if name not in names:
        raise InputError(f"no parameter {name!r} to profile; {nearest(name, names)}")
    path = _Path(simulate, parameters, fit, names.index(name))
    return path.profile(path.side(-1.0), path.side(1.0))


class _Path:
    """Values of one parameter from its optimum to both sides, in the unit cube."""

    def __init__(
        self,
        simulate: Simulate,
        parameters: Sequence[FreeParameter],
        fit: SimulatorFit,
        index: int,
    ) -> None:
        linear = fit.linearisation
        self._residual = BatchedResidual(simulate, parameters, linear.places)
        self._cost = RowWeights(self._residual, parameters, linear.residual, frozen=True)
        self._parameter, self._index = parameters[index], index
        self._noise = {c: n.standard_deviation for c, n in fit.noise.items()}
        self._free = np.arange(len(parameters)) != index
        self._base = fit.objective
        result = fit.parameters[index]
        known = [p.rise95 for p in fit.parameters if p.rise95 is not None]
        self._threshold = result.rise95 or max([_CHI2, *known])
        best = self._residual.scale.to_unit(fit.values)
        self._middle = float(best[index])
        self._reach = 1.0
        if result.interval95 is not None:
            ends = np.where(self._free, fit.values, np.reshape(result.interval95, (2, 1)))
            places = self._residual.scale.to_unit(ends)[:, index]
            self._reach = _REACH * float(np.max(np.abs(places - self._middle)))
        self._seen: dict[float, tuple[float, FloatArray]] = {self._middle: (0.0, best)}

    def side(self, sign: float) -> float | None:
        """Go to one side; return where the rise reaches the threshold, in the unit range."""
        bound = 0.0 if sign < 0.0 else 1.0
        room = abs(bound - self._middle)
        distances = [self._reach * k / _POINTS for k in range(1, _POINTS + 1)]
        distances += [self._reach * 2.0**k for k in range(1, _FURTHER)] + [room]
        before = self._middle
        for distance in distances:
            here = bound if distance >= room else self._middle + sign * distance
            if here == before:
                return None
            if self._rise(here, before) > self._threshold:
                return self._closing(before, here)
            before = here
        return None

    def _rise(self, here: float, near: float) -> float:
        """Refit the others at a value, starting from what was found nearby."""
        start = self._seen[near][1].copy()
        behind = [u for u in self._seen if abs(u - here) > abs(near - here)]
        for place in (*((self._onward(here, near, behind),) if behind else ()), start):
            place[self._index] = here
            if self._residual.at(place) is not None:
                begin = SearchState(place, self._noise)
                end = search(self._cost, begin, _STEPS, lambda _: None, free=self._free)
                self._seen[here] = end.objective - self._base, end.state.place
                return self._seen[here][0]
        self._seen[here] = np.inf, start
        return np.inf

    def _onward(self, here: float, near: float, behind: Sequence[float]) -> FloatArray:
        """Continue the line through the two nearest points: the valley is followed, not climbed."""
        second = min(behind, key=lambda u: abs(u - near))
        first, further = self._seen[near][1], self._seen[second][1]
        return np.clip(first + (first - further) * (here - near) / (near - second), 0.0, 1.0)

    def _closing(self, inside: float, outside: float) -> float:
        """Close in on the threshold; the root of the rise is nearly straight."""
        for _ in range(_REFINED):
            here = self._crossing(inside, outside)
            if here in (inside, outside):
                break
            rise = self._rise(here, inside)
            inside, outside = (here, outside) if rise <= self._threshold else (inside, here)
            if abs(rise - self._threshold) < _CLOSE * self._threshold:
                break
        return self._crossing(inside, outside)

    def _crossing(self, inside: float, outside: float) -> float:
        low, high = (np.sqrt(max(self._seen[u][0], 0.0)) for u in (inside, outside))
        level = np.sqrt(self._threshold)
        if high > _STEEP * level:
            return 0.5 * (inside + outside)
        return inside + (outside - inside) * float((level - low) / (high - low))

    def profile(self, low: float | None, high: float | None) -> Profile:
        """Put the points in order and into words."""
        points = sorted((u, rise) for u, (rise, _) in self._seen.items())
        smallest = min(rise for _, rise in points)
        start, stop = (None if u is None else self._value(u) for u in (low, high))
        return Profile(
            name=self._parameter.name,
            unit=self._parameter.unit,
            values=tuple(self._value(u) for u, _ in points),
            rise=tuple(
                float(rise - min(smallest, 0.0)) if np.isfinite(rise) else None
                for _, rise in points
            ),
            threshold=self._threshold,
            low=start,
            high=stop,
            sentence=self._sentence(start, stop, smallest),
            evaluations=self._residual.evaluations,
        )

    def _value(self, place: float) -> float:
        full = np.where(self._free, self._seen[self._middle][1], place)
        return float(self._residual.scale.from_unit(full)[self._index])

    def _sentence(self, low: float | None, high: float | None, smallest: float) -> str:
        p = self._parameter
        unit = "" if p.unit == "1" else f" {p.unit}"
        if low is not None and high is not None:
            sentence = f"{p.name} lies between {low:.4g} and {high:.4g}{unit}; closed on both sides"
        elif low is None and high is None:
            sentence = (
                f"the profile of {p.name} closes on neither side: nothing in its range,"
                f" {p.low:.4g} to {p.high:.4g}{unit}, contradicts the data"
            )
        else:
            side, end, bound = ("below", high, p.low) if low is None else ("above", low, p.high)
            word = "at most" if low is None else "at least"
            sentence = (
                f"{p.name} is {word} {end:.4g}{unit}; the profile does not close {side} before the"
                f" end of its range, {bound:.4g}{unit}"
            )
        if smallest < -_BETTER:
            sentence += "; a better fit than the optimum was found on the way: use more starts"
        return sentence
