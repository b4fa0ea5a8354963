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


def intervals95(fitter: Fitter, fit: Refit) -> dict[str, tuple[float, float]]:
    """Intervals from the scatter of trials about the mean of their protocol.

    Args:
        fitter: of the trials.
        fit: the fit, with its Jacobian.

    Returns:
        Name -> 95 % interval [SI]; a parameter that the data do not show gets its whole range.
    """
    parameters, jacobian = fit.parameters, fit.jacobian
    norms = np.linalg.norm(jacobian, axis=0)
    shown = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
    scale = SearchScale(parameters)
    at = scale.to_unit(np.array([fit.values[p.name] for p in parameters]))
    reach = np.full(len(parameters), np.inf)
    if np.any(shown):
        spread = parameter_covariance(
            Linearisation(
                places=fitter.simulator.layout.fitted_places,
                residual=fit.residual[fitter.fitted],
                jacobian=jacobian[:, shown] / fitter.weights[:, np.newaxis],
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
