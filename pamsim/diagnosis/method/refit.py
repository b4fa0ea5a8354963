"""Refits of parameters to the trials that are not held out, ordinary and effects' ones together."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.trust_region import Stop, descend
from pamsim.inference.free_parameter import FreeParameter, SearchScale

FloatArray = NDArray[np.float64]
Remembered = MutableMapping[str, Mapping[str, Any]]
"""Fits that are done: what was fitted from where -> ``values`` and ``cost``."""

_STEP = 1e-4  # of a range, for differences: wide enough to bridge the kinks of switching valves
_TOLERANCE, _LAST_TOLERANCE = 1e-3, 1e-5  # of cost and place; while comparing, at the end
_FAR = 1.0  # floors of improvement beyond which slopes taken before are no longer good ones

EDGE = 1e-3
"""Share of a range from its ends that counts as an end."""


@dataclass(frozen=True, kw_only=True)
class Refit:
    """The end of a fit.

    Attributes:
        parameters: p that were fitted.
        values: name -> value [SI].
        residual: (n,) of all trials, held out ones too [SI].
        cost: mean square over the fitted trials, in units of the noise.
        slopes: (f, p) change of the weighted residual of the fitted trials per range.
        at_bound: names that ended on their range's ends.
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    residual: FloatArray
    cost: float
    slopes: FloatArray
    at_bound: tuple[str, ...]


class Fitter:
    """Fits by Gauss-Newton steps within ranges, with slopes kept where they hardly change.

    The slopes of ordinary parameters are taken once, at the fit of the base model, and serve every
    effect that changes little: such a fit costs its effect's own slopes and the steps.

    Args:
        simulator: of all trials.
        floor: of the noise.
        remembered: fits of an interrupted run; new ones are added.
    """

    def __init__(
        self,
        simulator: TrialSimulator,
        floor: NoiseFloor,
        remembered: Remembered | None = None,
    ) -> None:
        self.simulator = simulator
        self.floor = floor
        self.fitted = simulator.fitted
        self._remembered: Remembered = {} if remembered is None else remembered
        fitted = simulator.layout.trials(held_out=False)
        weights = simulator.layout.weights(floor.sd)[self.fitted]
        channels = len(simulator.layout.channels)
        self.weights = weights / np.sqrt(len(fitted) * channels)
        self._slopes: dict[str, FloatArray] = {}

    def weighted(self, residual: FloatArray) -> FloatArray:
        """Rows (f,) of the fitted trials out of (n,) [SI] in units of noise.

        Their sum of squares is the mean loss.
        """
        return residual[self.fitted] * self.weights

    def changes(
        self, sets: Sequence[Mapping[str, float]], at: FloatArray
    ) -> list[FloatArray | None]:
        """How parameter sets change the weighted residual.

        Args:
            sets: values by name [SI].
            at: (f,) weighted residual to compare with.

        Returns:
            For each (f,), or None where the simulation breaks down.
        """
        return [
            None if found is None else found * self.weights - at
            for found in self.simulator.fit_rows(sets)
        ]

    def slopes(
        self, parameters: Sequence[FreeParameter], values: Mapping[str, float], at: FloatArray
    ) -> FloatArray:
        """Change of the weighted residual per range of each parameter, shape (f, p).

        Args:
            parameters: p of them.
            values: of all that is not at the rig's own value [SI].
            at: (f,) weighted residual there, in coarse steps.
        """
        scale = SearchScale(parameters)
        place = scale.to_unit(np.array([values[p.name] for p in parameters]))
        steps = np.where(place > 0.5, -_STEP, _STEP)
        moved = [scale.from_unit(place + step) for step in np.diag(steps)]
        sets = [
            {**values, parameter.name: float(vector[i])}
            for i, (parameter, vector) in enumerate(zip(parameters, moved, strict=True))
        ]
        columns = [
            np.zeros_like(at) if change is None else change / step
            for change, step in zip(self.changes(sets, at), steps, strict=True)
        ]
        return np.stack(columns, axis=1) if columns else np.empty((at.size, 0))

    def keep_slopes(self, found: Refit) -> None:
        """Let the slopes at a fit of ordinary parameters serve all later ones."""
        self._slopes = {p.name: found.slopes[:, i] for i, p in enumerate(found.parameters)}

    def fit(
        self,
        parameters: Sequence[FreeParameter],
        starts: Sequence[Mapping[str, float]],
        *,
        most: int = 12,
    ) -> Refit:
        """Fit from one or more starts; the best end counts.

        Args:
            parameters: p of them.
            starts: name -> value for each [SI].
            most: steps tried.

        Raises:
            InputError: if the simulation breaks down at every start.
        """
        key = json.dumps([[p.name for p in parameters], [dict(s) for s in starts]])
        known = self._remembered.get(key)
        if known is not None:
            return self._finished(parameters, self._stop_at(parameters, known))
        best: Stop | None = None
        for start in starts:
            found = self._search(parameters, start, most)
            if found is not None and (best is None or found.cost < best.cost):
                best = found
        if best is None:
            names = ", ".join(p.name for p in parameters)
            raise InputError(f"the simulation breaks down wherever a fit of {names} begins")
        scale = SearchScale(parameters)
        values = scale.from_unit(best.place).tolist()
        named = dict(zip([p.name for p in parameters], values, strict=True))
        self._remembered[key] = {"values": named, "cost": best.cost}
        return self._finished(parameters, best)

    def _search(
        self, parameters: Sequence[FreeParameter], start: Mapping[str, float], most: int
    ) -> Stop | None:
        scale = SearchScale(parameters)
        names = [p.name for p in parameters]
        begin = np.clip(scale.to_unit(np.array([start[n] for n in names])), EDGE, 1.0 - EDGE)

        def slopes(
            kept: Mapping[str, FloatArray],
        ) -> Callable[[FloatArray, FloatArray], FloatArray]:
            def at(place: FloatArray, here: FloatArray) -> FloatArray:
                values = dict(zip(names, scale.from_unit(place).tolist(), strict=True))
                fresh = [p for p in parameters if p.name not in kept]
                own = iter(self.slopes(fresh, values, here).T)
                return np.stack([kept[n] if n in kept else next(own) for n in names], axis=1)

            return at

        found = self.steps(parameters, begin, slopes(self._slopes), most)
        if found is not None and self._slopes and found.fell > _FAR:
            return self.steps(parameters, found.place, slopes({}), most) or found
        return found

    def steps(
        self,
        parameters: Sequence[FreeParameter],
        begin: FloatArray,
        slopes: Callable[[FloatArray, FloatArray], FloatArray],
        most: int,
        *,
        fine: bool = False,
    ) -> Stop | None:
        """Descend from a place.

        Args:
            parameters: p of them.
            begin: (p,) in the unit cube of their ranges.
            slopes: place and residual there to (f, p).
            most: steps tried.
            fine: whether in fine steps, and to the last of what they resolve.

        Returns:
            The end; None if the simulation breaks down at the beginning.
        """
        scale = SearchScale(parameters)
        names = [p.name for p in parameters]

        def residual(place: FloatArray) -> FloatArray | None:
            values = dict(zip(names, scale.from_unit(place).tolist(), strict=True))
            (found,) = self.simulator.fit_rows([values], fine=fine)
            return None if found is None else found * self.weights

        tolerance = _LAST_TOLERANCE if fine else _TOLERANCE
        return descend(residual, slopes, begin, most=most, tolerance=tolerance)

    def _stop_at(self, parameters: Sequence[FreeParameter], known: Mapping[str, Any]) -> Stop:
        """A remembered fit, with slopes taken anew."""
        values = {p.name: float(known["values"][p.name]) for p in parameters}
        (at,) = self.simulator.fit_rows([values])
        if at is None:
            raise InputError("a remembered fit no longer runs; start without --resume")
        here = at * self.weights
        fresh = [p for p in parameters if p.name not in self._slopes]
        own = iter(self.slopes(fresh, values, here).T)
        columns = [
            self._slopes[p.name] if p.name in self._slopes else next(own) for p in parameters
        ]
        place = SearchScale(parameters).to_unit(np.array([values[p.name] for p in parameters]))
        return Stop(
            place=place,
            residual=here,
            cost=float(known["cost"]),
            slopes=np.stack(columns, axis=1),
        )

    def _finished(self, parameters: Sequence[FreeParameter], stop: Stop) -> Refit:
        names = [p.name for p in parameters]
        values = dict(
            zip(names, SearchScale(parameters).from_unit(stop.place).tolist(), strict=True)
        )
        residual = self.simulator.whole(values)
        if residual is None:
            raise InputError(f"held-out trials break down at {values}")
        return Refit(
            parameters=tuple(parameters),
            values=values,
            residual=residual,
            cost=stop.cost,
            slopes=stop.slopes,
            at_bound=at_ends(names, stop.place),
        )


def at_ends(names: Sequence[str], place: FloatArray) -> tuple[str, ...]:
    """Names of the parameters whose place (p,) in the unit cube is at an end."""
    ends = np.minimum(place, 1.0 - place) < EDGE
    return tuple(n for n, end in zip(names, ends, strict=True) if end)
