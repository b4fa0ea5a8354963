"""How large an effect that is not claimed could be without the data showing it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.method.refit import Fitter
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import TangentSpace

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
    fitter: Fitter, screened: Sequence[Screened], space: TangentSpace, residual: FloatArray
) -> tuple[AbsentLimit, ...]:
    """Limits from each effect's smallest signature, to first order.

    The scatter of the trials about the mean of their protocol gives the standard error, as it does
    for intervals: noise that drifts and trials that differ count.

    Args:
        fitter: of the trials.
        screened: effects that are not in the model.
        space: tangent space of all that is in the model.
        residual: (n,) of the model [SI].
    """
    misfit = space.project_out(-fitter.weighted(residual))
    places = fitter.simulator.layout.fitted_places
    limits: list[AbsentLimit] = []
    for effect in screened:
        candidate = effect.candidate
        parameter = candidate.parameters[0].name
        traces = [(t.probe, t.signature.within(space)) for t in effect.traces]
        traces = [(p, s) for p, s in traces if float(s.projected @ s.projected) > 0.0]
        if not traces:
            limits.append(
                AbsentLimit(
                    effect=candidate.name,
                    parameter=parameter,
                    size=np.inf,
                    limit=np.inf,
                    visible=False,
                )
            )
            continue
        bounds: list[tuple[float, float]] = []
        smallest = min(probe.size for probe, _ in traces)
        for probe, signature in traces:
            if probe.size == smallest:
                score = signature.projected * misfit
                square = float(signature.projected @ signature.projected)
                parts: dict[str, dict[str, float]] = {}
                for place in places:
                    trials = parts.setdefault(place.block.protocol, {})
                    trial = place.block.trial
                    trials[trial] = trials.get(trial, 0.0) + float(np.sum(score[place.rows]))
                share = signature.share(misfit)
                error = np.sqrt(sum(_variance(list(p.values())) for p in parts.values())) / square
                most = (abs(share) if candidate.two_sided else max(share, 0.0)) + _ERRORS * error
                away = abs(probe.values[parameter] - candidate.neutral[parameter])
                bounds.append((most * probe.size, most * away))
        size, limit = max(bounds)
        limits.append(
            AbsentLimit(
                effect=candidate.name,
                parameter=parameter,
                size=size,
                limit=limit,
                visible=effect.visible,
            )
        )
    return tuple(limits)


def _variance(scores: Sequence[float]) -> float:
    """Variance of a sum of trials' scores; from their size where there is but one."""
    count = len(scores)
    return count * float(np.var(scores, ddof=1)) if count > 1 else scores[0] ** 2
