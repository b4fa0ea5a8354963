"""95 % intervals of fitted parameters that hold for noise that drifts within trials."""

from __future__ import annotations

import numpy as np

from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.inference.free_parameter import SearchScale
from pamsim.inference.intervals import parameter_covariance
from pamsim.inference.simulator_fit import Linearisation

_FEWEST_REPEATS = 2
"""Fitted trials of a protocol: of four recorded, one is held out. What differs from trial to trial
would go unseen if they were taken for one trial with coloured noise."""


def intervals95(fitter: Fitter, found: Refit) -> dict[str, tuple[float, float]]:
    """Intervals from the scatter of trials about the mean of their protocol.

    Args:
        fitter: of the trials.
        found: the fit, with its slopes.

    Returns:
        Name -> 95 % interval [SI]; a parameter that the data do not show gets its whole range.
    """
    parameters, slopes = found.parameters, found.slopes
    norms = np.linalg.norm(slopes, axis=0)
    shown = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
    scale = SearchScale(parameters)
    at = scale.to_unit(np.array([found.values[p.name] for p in parameters]))
    reach = np.full(len(parameters), np.inf)
    if np.any(shown):
        spread = parameter_covariance(
            Linearisation(
                places=fitter.simulator.layout.fitted_places,
                residual=found.residual[fitter.fitted],
                jacobian=slopes[:, shown] / fitter.weights[:, np.newaxis],
                weight=fitter.weights,
            ),
            np.eye(int(shown.sum())),
            np.zeros((int(shown.sum()), int(shown.sum()))),
            fewest_repeats=_FEWEST_REPEATS,
        )
        reach[shown] = spread.quantile * np.sqrt(np.diag(spread.matrix))
    low = scale.from_unit(np.clip(at - reach, 0.0, 1.0))
    high = scale.from_unit(np.clip(at + reach, 0.0, 1.0))
    return {p.name: (float(a), float(b)) for p, a, b in zip(parameters, low, high, strict=True)}
