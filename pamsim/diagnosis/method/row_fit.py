"""Fit a model to rows of a table, which have no order in time and no repeats."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pamsim.comparison.candidate import INSIDE
from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import BreakdownError, bounded_least_squares
from pamsim.inference.difference_jacobian import difference_jacobian
from pamsim.inference.free_parameter import FreeParameter, SearchScale

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
            None if residual is None or not np.all(np.isfinite(residual)) else residual
            for residual in self.predict(sets)
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
        return SearchScale(self.parameters).place(self.values)

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
        (residual,) = simulator.many([{}])
        if residual is None:
            return None
        return RowFit(
            parameters=(), values={}, residual=residual, jacobian=np.empty((residual.size, 0))
        )
    scale = SearchScale(parameters)

    def residuals(places: FloatArray) -> list[FloatArray | None]:
        return simulator.many([scale.values(place) for place in places])

    try:
        fit = bounded_least_squares(
            residuals,
            [np.clip(scale.place(start), INSIDE, 1.0 - INSIDE) for start in starts],
            jacobian=_STEP,
            tolerance=_TOLERANCE,
            max_steps=most,
            follow=_FOLLOWED,
            try_bounds=True,
        )
    except BreakdownError:
        return None
    jacobian = fit.jacobian
    if fit.moved_to_bound:
        jacobian = difference_jacobian(residuals, fit.x, fit.residual, _STEP)
    return RowFit(
        parameters=parameters,
        values=scale.values(fit.x),
        residual=fit.residual,
        jacobian=jacobian,
    )
