"""The rest of a fit's way, for the models that a verdict rests on.

Kept slopes and a loose tolerance are enough to compare effects. In a curved valley, where an effect
trades off against an ordinary parameter, they end well before its bottom.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pamsim.diagnosis.method.refit import EDGE, Fitter, Refit, at_ends
from pamsim.inference.free_parameter import SearchScale

_ROUNDS = 8

_STEPS = 4
"""Steps with the same slopes."""

_SETTLED = 3e-5
"""Fall of the cost, as a share of it, that is not worth another round."""


def polish(fitter: Fitter, found: Refit) -> Refit:
    """Go down in fine steps, with slopes taken anew every few, until nothing moves.

    Args:
        fitter: of the trials.
        found: a fit.

    Returns:
        The fit with its residual in fine steps; the one handed in if nothing comes through.
    """
    for _ in range(_ROUNDS):
        further = _further(fitter, found)
        if further is None:
            break
        found, fell = further
        if fell < _SETTLED * found.cost:
            break
    return found


def _further(fitter: Fitter, found: Refit) -> tuple[Refit, float] | None:
    """A round from a fit, and by how much the cost fell; None if nothing comes through."""
    scale = SearchScale(found.parameters)
    names = [p.name for p in found.parameters]
    (coarse,) = fitter.simulator.fit_rows([found.values])
    if coarse is None:
        return None
    slopes = fitter.slopes(found.parameters, found.values, coarse * fitter.weights)
    begin = np.clip(scale.to_unit(np.array([found.values[n] for n in names])), EDGE, 1.0 - EDGE)
    end = fitter.steps(found.parameters, begin, lambda _place, _at: slopes, _STEPS, fine=True)
    if end is None:
        return None
    values = dict(zip(names, scale.from_unit(end.x).tolist(), strict=True))
    residual = fitter.simulator.fine(values)
    if residual is None:
        return None
    settled = replace(
        found,
        values=values,
        residual=residual,
        cost=end.cost,
        slopes=slopes,
        at_bound=at_ends(names, end.x),
    )
    return settled, end.start_cost - end.cost
