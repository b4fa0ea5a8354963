"""Polish the fits that a verdict rests on: to convergence, in fine time steps.

A kept Jacobian and a loose tolerance are enough to compare effects. In a curved valley, where an
effect trades off against a nuisance parameter, they end well before its bottom.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pamsim.diagnosis.method.refit import EDGE, Fitter, Refit, at_ends
from pamsim.inference.difference_jacobian import secant_updated
from pamsim.inference.free_parameter import SearchScale

_ROUNDS = 4

_STEPS = 10
"""Steps from one Jacobian on."""

_SETTLED = 3e-5
"""Fall of the cost, as a share of it, that is not worth another round."""


def polish(fitter: Fitter, fit: Refit) -> Refit:
    """Descend in fine steps, each round from a new Jacobian on, until nothing moves.

    Args:
        fitter: of the trials.
        fit: a fit.

    Returns:
        The fit with its residual in fine steps; the one handed in if nothing comes through.
    """
    for _ in range(_ROUNDS):
        further = _further(fitter, fit)
        if further is None:
            break
        fit, fell = further
        if fell < _SETTLED * fit.cost:
            break
    return fit


def _further(fitter: Fitter, fit: Refit) -> tuple[Refit, float] | None:
    """A round from a fit, and by how much the cost fell; None if nothing comes through."""
    scale = SearchScale(fit.parameters)
    (coarse,) = fitter.simulator.fit_rows([fit.values])
    if coarse is None:
        return None
    jacobian = fitter.jacobian(fit.parameters, fit.values, coarse * fitter.weights)
    begin = np.clip(scale.place(fit.values), EDGE, 1.0 - EDGE)
    updated = secant_updated(lambda _place, _at: jacobian)
    end = fitter.steps(fit.parameters, begin, updated, _STEPS, fine=True)
    if end is None:
        return None
    values = scale.values(end.x)
    residual = fitter.simulator.fine(values)
    if residual is None:
        return None
    settled = replace(
        fit,
        values=values,
        residual=residual,
        cost=end.cost,
        jacobian=jacobian,
        at_bound=at_ends(list(values), end.x),
    )
    return settled, end.start_cost - end.cost
