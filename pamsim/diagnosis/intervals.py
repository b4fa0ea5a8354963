"""95 % intervals of fitted parameters that hold for noise that drifts within trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.refit import Fitter, Refit
from pamsim.sysid.calibration_intervals import parameter_covariance
from pamsim.sysid.calibration_result import Linearisation
from pamsim.sysid.free_parameter import FreeParameter, SearchScale
from pamsim.sysid.residual_block import BlockPlace

FloatArray = NDArray[np.float64]


def intervals95(
    fitter: Fitter, found: Refit, parameters: Sequence[FreeParameter], slopes: FloatArray
) -> dict[str, tuple[float, float]]:
    """Intervals from the scatter of trials about the mean of their protocol.

    Args:
        fitter: of the trials.
        found: the fit.
        parameters: p that were fitted.
        slopes: (n, p) change of the weighted residual of the fitted trials per range.

    Returns:
        Name -> 95 % interval [SI]; a parameter that the data do not show gets its whole range.
    """
    layout = fitter.simulator.layout
    places: list[BlockPlace] = []
    end = 0
    for place in layout.places:
        if place.block.trial not in layout.held_out:
            count = place.rows.stop - place.rows.start
            places.append(BlockPlace(place.block, slice(end, end + count)))
            end += count
    norms = np.linalg.norm(slopes, axis=0)
    shown = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
    scale = SearchScale(parameters)
    at = scale.to_unit(np.array([found.values[p.name] for p in parameters]))
    reach = np.full(len(parameters), np.inf)
    if np.any(shown):
        residual = found.residual[fitter.fitted]
        spread = parameter_covariance(
            Linearisation(
                places=tuple(places),
                residual=residual,
                jacobian=slopes[:, shown] / fitter.weights[:, np.newaxis],
                weight=fitter.weights,
            ),
            np.eye(int(shown.sum())),
            np.zeros((int(shown.sum()), int(shown.sum()))),
        )
        reach[shown] = spread.quantile * np.sqrt(np.diag(spread.matrix))
    low = scale.from_unit(np.clip(at - reach, 0.0, 1.0))
    high = scale.from_unit(np.clip(at + reach, 0.0, 1.0))
    return {p.name: (float(a), float(b)) for p, a, b in zip(parameters, low, high, strict=True)}
