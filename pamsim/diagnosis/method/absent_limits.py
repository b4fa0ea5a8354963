"""How large an effect that is not claimed could be without the data showing it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import Signature
from pamsim.inference.residual_block import BlockPlace

FloatArray = NDArray[np.float64]

_ERRORS = 2.0
"""Standard errors by which the limit lies beyond the estimate: one-sided, 97.5 %."""


@dataclass(frozen=True, kw_only=True)
class AbsentLimit:
    """The largest size of an effect that the data allow beside the model.

    Attributes:
        effect: which.
        parameter: that measures its size.
        size: the limit in units of the typical size; infinite if the data cannot show it, NaN if it
            is not known.
        limit: the same as a distance of the parameter from neutral [SI].
        visible: whether the data would show it at any of its probes.
    """

    effect: str
    parameter: str
    size: float
    limit: float
    visible: bool


def absent_limits(
    fitter: Fitter, screened: Sequence[Screened], fit: Refit
) -> tuple[AbsentLimit, ...]:
    """Limits from each effect's smallest signature, to first order.

    The scatter of the trials about the mean of their protocol gives the standard error, as it does
    for intervals: noise that drifts and trials that differ count.

    Args:
        fitter: of the trials.
        screened: effects that are not in the model.
        fit: of the model.
    """
    space, misfit = fitter.unexplained(fit)
    places = fitter.simulator.layout.fitted_places
    limits: list[AbsentLimit] = []
    for effect in screened:
        candidate = effect.candidate
        parameter = candidate.parameters[0].name
        traces = [(t.probe, t.signature.within(space)) for t in effect.traces]
        traces = [(p, s) for p, s in traces if float(s.projected @ s.projected) > 0.0]
        smallest = min((probe.size for probe, _ in traces), default=0.0)
        bounds: list[tuple[float, float]] = []
        for probe, signature in traces:
            if probe.size == smallest:
                share, error = signature.share(misfit), _error(signature, misfit, places)
                most = (abs(share) if candidate.two_sided else max(share, 0.0)) + _ERRORS * error
                away = abs(probe.values[parameter] - candidate.neutral[parameter])
                bounds.append((most * probe.size, most * away))
        size, limit = max(bounds, default=(np.inf, np.inf))
        limits.append(
            AbsentLimit(
                effect=candidate.name,
                parameter=parameter,
                size=size,
                limit=limit,
                visible=bool(traces) and effect.visible,
            )
        )
    return tuple(limits)


def _error(signature: Signature, misfit: FloatArray, places: Sequence[BlockPlace]) -> float:
    """Standard error of a signature's share of a misfit."""
    score = signature.projected * misfit
    parts: dict[str, dict[str, float]] = {}
    for place in places:
        trials = parts.setdefault(place.block.protocol, {})
        trial = place.block.trial
        trials[trial] = trials.get(trial, 0.0) + float(np.sum(score[place.rows]))
    square = float(signature.projected @ signature.projected)
    return sum(_variance(list(p.values())) for p in parts.values()) ** 0.5 / square


def _variance(scores: Sequence[float]) -> float:
    """Variance of a sum of trials' scores; from their size where there is but one."""
    count = len(scores)
    return count * float(np.var(scores, ddof=1)) if count > 1 else scores[0] ** 2
