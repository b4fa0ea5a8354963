"""Fit ordinary and effect parameters together to the trials that are not held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.diagnosis.noise_floor import NoiseFloor
from pamsim.diagnosis.trial_residuals import TrialSimulator
from pamsim.sysid.free_parameter import FreeParameter, SearchScale

FloatArray = NDArray[np.float64]
_least_squares: Any = scipy.optimize.least_squares

_STEP = 1e-4  # of a range, for differences: wide enough to bridge the kinks of switching valves
_LOST = 1e3  # factor on the residual where a simulation breaks down
_TOLERANCE = 1e-4


@dataclass(frozen=True, kw_only=True)
class Refit:
    """The end of a fit.

    Attributes:
        values: name -> value [SI].
        residual: (n,) of all trials, held out ones too [SI].
        cost: mean square over the fitted trials, in units of the noise.
        at_bound: names that ended on their range's ends.
    """

    values: dict[str, float]
    residual: FloatArray
    cost: float
    at_bound: tuple[str, ...]


class Fitter:
    """Fits by Gauss-Newton steps within ranges, with slopes kept where they hardly change.

    The slopes of ordinary parameters are taken once, at the fit of the base model, and serve every
    effect: a fit then costs its effect's own slopes and the steps.

    Args:
        simulator: of all trials.
        floor: of the noise.
    """

    def __init__(self, simulator: TrialSimulator, floor: NoiseFloor) -> None:
        self.simulator = simulator
        self.floor = floor
        fitted = simulator.layout.trials(held_out=False)
        self.fitted = simulator.layout.rows(fitted)
        weights = simulator.layout.weights(floor.sd)[self.fitted]
        channels = len(simulator.layout.channels)
        self.weights = weights / np.sqrt(len(fitted) * channels)
        self._slopes: dict[str, FloatArray] = {}

    def weighted(self, residual: FloatArray) -> FloatArray:
        """Rows of the fitted trials in units of noise; their sum of squares is the mean loss."""
        return residual[self.fitted] * self.weights

    def slopes(
        self, parameters: Sequence[FreeParameter], values: Mapping[str, float], at: FloatArray
    ) -> FloatArray:
        """Change of the weighted residual per range of each parameter, shape (n, p).

        Args:
            parameters: p of them.
            values: of all that is not at the rig's own value [SI].
            at: (n,) weighted residual there.
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
            np.zeros_like(at) if found is None else (self.weighted(found) - at) / step
            for found, step in zip(self.simulator.many(sets), steps, strict=True)
        ]
        return np.stack(columns, axis=1) if columns else np.empty((at.size, 0))

    def keep_slopes(self, parameters: Sequence[FreeParameter], found: Refit) -> FloatArray:
        """Take the slopes of ordinary parameters at a fit, for all later ones, shape (n, p)."""
        matrix = self.slopes(parameters, found.values, self.weighted(found.residual))
        self._slopes = {p.name: matrix[:, i] for i, p in enumerate(parameters)}
        return matrix

    def all_slopes(self, parameters: Sequence[FreeParameter], found: Refit) -> FloatArray:
        """Slopes at a fit, kept ones as they are, shape (n, p)."""
        fresh = [p for p in parameters if p.name not in self._slopes]
        own = iter(self.slopes(fresh, found.values, self.weighted(found.residual)).T)
        return np.stack(
            [self._slopes[p.name] if p.name in self._slopes else next(own) for p in parameters],
            axis=1,
        )

    def fit(
        self,
        parameters: Sequence[FreeParameter],
        start: Mapping[str, float],
        *,
        most: int = 12,
    ) -> Refit:
        """Fit from one start.

        Args:
            parameters: p of them.
            start: name -> value for each [SI].
            most: steps tried.

        Raises:
            InputError: if the simulation breaks down at the start.
        """
        scale = SearchScale(parameters)
        names = [p.name for p in parameters]
        begin = np.clip(scale.to_unit(np.array([start[n] for n in names])), 1e-3, 1.0 - 1e-3)
        seen: dict[bytes, FloatArray | None] = {}

        def values(place: FloatArray) -> dict[str, float]:
            return dict(zip(names, scale.from_unit(place).tolist(), strict=True))

        def residual(place: FloatArray) -> FloatArray | None:
            key = place.tobytes()
            if key not in seen:
                seen[key] = self.simulator.many([values(place)])[0]
            return seen[key]

        first = residual(begin)
        if first is None:
            raise InputError(f"the simulation breaks down at {', '.join(names)} = {dict(start)}")
        lost = _LOST * self.weighted(first)

        def weighted(place: FloatArray) -> FloatArray:
            found = residual(place)
            return lost if found is None else self.weighted(found)

        def jacobian(place: FloatArray) -> FloatArray:
            fresh = [p for p in parameters if p.name not in self._slopes]
            own = iter(self.slopes(fresh, values(place), weighted(place)).T)
            return np.stack(
                [self._slopes[n] if n in self._slopes else next(own) for n in names], axis=1
            )

        found = _least_squares(
            weighted,
            begin,
            jac=jacobian,
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=_TOLERANCE,
            xtol=_TOLERANCE,
            gtol=1e-10,
            max_nfev=most,
        )
        whole = residual(found.x)
        assert whole is not None  # a place where it breaks down is never accepted
        ends = np.minimum(found.x, 1.0 - found.x) < 1e-3
        return Refit(
            values=values(found.x),
            residual=whole,
            cost=2.0 * float(found.cost),
            at_bound=tuple(n for n, end in zip(names, ends, strict=True) if end),
        )
