"""Fit a model to rows of a table, which have no order in time and no repeats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.candidate import INSIDE
from pamsim.diagnosis.method.trust_region import descend
from pamsim.inference.free_parameter import FreeParameter, SearchScale

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]
PredictRows = Callable[[Sequence[Values]], Sequence[FloatArray | None]]
"""Rig parameters by name [SI], those left out at the rig's own values, to simulated minus measured
of every row, shape (n,); None where there is no prediction."""

_STEP = 1e-4  # of a range, for differences
_TOLERANCE = 1e-4
_FOLLOWED = 2  # starts that are followed to their end, of those tried


@dataclass
class RowSimulator:
    """A handed-in predictor of rows, its predictions counted.

    Attributes:
        predict: see `PredictRows`.
        anchor: makes the predictions exact at given values, where ``predict`` is an approximation
            that is better the nearer; None where it is exact everywhere.
        evaluations: parameter sets predicted so far.
    """

    predict: PredictRows
    anchor: Callable[[Values], None] | None = None
    evaluations: int = 0

    def many(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        """Residuals of several parameter sets."""
        self.evaluations += len(sets)
        return [
            None if found is None or not np.all(np.isfinite(found)) else found
            for found in self.predict(sets)
        ]


@dataclass(frozen=True, kw_only=True)
class RowFit:
    """A model fitted to all rows.

    Attributes:
        parameters: p of them.
        values: name -> value [SI].
        residual: simulated minus measured, (n,) [SI].
        jacobian: change of the residual per range of each parameter, (n, p).
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    residual: FloatArray
    jacobian: FloatArray = field(repr=False)

    @property
    def rms(self) -> float:
        """Root mean square of the residual [SI]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def place(self) -> FloatArray:
        """Of the values in their ranges, (p,)."""
        vector = np.array([self.values[p.name] for p in self.parameters])
        return SearchScale(self.parameters).to_unit(vector)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names that ended on their range's ends."""
        ends = np.minimum(self.place, 1.0 - self.place) < INSIDE
        return tuple(p.name for p, end in zip(self.parameters, ends, strict=True) if end)


def fit_rows(
    simulator: RowSimulator,
    parameters: Sequence[FreeParameter],
    starts: Sequence[Values],
    *,
    most: int = 15,
) -> RowFit | None:
    """Least squares within the ranges, the best from several starts.

    Args:
        simulator: of the rows.
        parameters: p of them; none gives the model as it is.
        starts: values of all parameters to begin from [SI]; the nearest are followed.
        most: steps tried from each.

    Returns:
        The fit; None if there is no prediction at any start.
    """
    parameters = tuple(parameters)
    if not parameters:
        (found,) = simulator.many([{}])
        if found is None:
            return None
        return RowFit(parameters=(), values={}, residual=found, jacobian=np.empty((found.size, 0)))
    if len(starts) > _FOLLOWED:
        first = simulator.many(starts)
        costs = [np.inf if r is None else float(r @ r) for r in first]
        starts = [starts[i] for i in np.argsort(costs, kind="stable")[:_FOLLOWED]]
    best: RowFit | None = None
    for start in starts:
        found = _fit_from(simulator, parameters, start, most)
        if found is not None and (best is None or found.rms < best.rms * (1.0 - 1e-6)):
            best = found
    return best


def _fit_from(
    simulator: RowSimulator, parameters: tuple[FreeParameter, ...], start: Values, most: int
) -> RowFit | None:
    scale = SearchScale(parameters)
    names = [p.name for p in parameters]
    begin = scale.to_unit(np.array([start[name] for name in names]))
    begin = np.clip(begin, INSIDE, 1.0 - INSIDE)

    def at(places: FloatArray) -> list[FloatArray | None]:
        return simulator.many(
            [dict(zip(names, v, strict=True)) for v in scale.from_unit(places).tolist()]
        )

    def residual(place: FloatArray) -> FloatArray | None:
        return at(place[np.newaxis])[0]

    def jacobian(place: FloatArray, middle: FloatArray) -> FloatArray:
        steps = np.where(place > 0.5, -_STEP, _STEP)
        moved = at(place + np.diag(steps))
        columns = [
            np.zeros_like(middle) if found is None else (found - middle) / step
            for found, step in zip(moved, steps, strict=True)
        ]
        return np.stack(columns, axis=1)

    stop = descend(residual, jacobian, begin, most=most, tolerance=_TOLERANCE, gradient=1e-12)
    if stop is None:
        return None
    place, middle, slopes = stop.place, stop.residual, stop.slopes
    onto = _onto_ends(place)
    if onto is not None:
        there = residual(onto)
        if there is not None and float(there @ there) <= stop.cost * (1.0 + 1e-6):
            place, middle, slopes = onto, there, jacobian(onto, there)
    return RowFit(
        parameters=parameters,
        values=dict(zip(names, scale.from_unit(place).tolist(), strict=True)),
        residual=middle,
        jacobian=slopes,
    )


def _onto_ends(place: FloatArray) -> FloatArray | None:
    """A place with what has come close to an end of its range put onto it; None if nothing has.

    The solver stays inside by design and approaches an end without ever reaching it.
    """
    near = np.minimum(place, 1.0 - place) < INSIDE
    return np.where(near, np.round(place), place) if np.any(near) else None
