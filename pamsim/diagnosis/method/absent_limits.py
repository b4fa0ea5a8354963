"""How large an effect that is not claimed could be without the data showing it.

A nuisance parameter that was refitted far from what the rig states may have taken the place of the
effect, whose signature there is another than where the rig is. The effect is therefore sized a
second time with such parameters held to what is known of them. Where that contradicts the limit,
there is none.

Nor are the formulas of the effects that are claimed quite right. What they may leave
(`FORM_ERROR`) may hide an effect that leaves as much, and the limit is wider by that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import Signature, TangentSpace, signature
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import KNOWN_NUISANCE
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.residual_block import BlockPlace

NOT_SHOWN = "the data do not show it at any size that was tried"
OUT_OF_RANGE = "the limit would lie outside the parameter's range"

TIED = "a model with it predicts as well as the best"
UNEXPLAINED_PART = "what the model leaves unexplained may hide it"

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
        cannot_tell: why the limit does not hold; None where it does.
    """

    effect: str
    parameter: str
    size: float
    limit: float
    cannot_tell: str | None


def absent_limits(
    fitter: Fitter,
    screened: Sequence[Screened],
    fit: Refit,
    nuisance: Sequence[FreeParameter],
    *,
    form_error: float = 0.0,
) -> tuple[AbsentLimit, ...]:
    """Limits from each effect's smallest signature, to first order.

    The scatter of the trials about the mean of their protocol gives the standard error, as it does
    for intervals: noise that drifts and trials that differ count.

    Args:
        fitter: of the trials.
        screened: effects that are not in the model.
        fit: of the model.
        nuisance: parameters of the model that belong to no effect, each starting at the rig's own
            value.
        form_error: loss that the formulas of the model's effects may leave.
    """
    space, misfit = fitter.unexplained(fit)
    held = _held(nuisance, fit.values)
    held_space, held_misfit = _with_held(fitter, fit, held) if held else (space, None)
    places = fitter.simulator.layout.fitted_places
    limits: list[AbsentLimit] = []
    for effect in screened:
        candidate = effect.candidate
        parameter = candidate.parameters[0].name
        traces = [(t, t.signature.within(space)) for t in effect.traces]
        traces = [(t, s) for t, s in traces if float(s.projected @ s.projected) > 0.0]
        smallest = min((trace.probe.size for trace, _ in traces), default=0.0)
        bounds: list[tuple[float, float]] = []
        hidden = False
        for trace, own in traces:
            probe = trace.probe
            if probe.size == smallest:
                share, error = _sized(candidate, own, misfit, places)
                most = share + _ERRORS * error + _hidden_by(form_error, own)
                away = abs(probe.values[parameter] - candidate.neutral[parameter])
                bounds.append((most * probe.size, most * away))
                if held_misfit is not None:
                    there = signature(held_space, trace.change, probe.size)
                    share, error = _sized(candidate, there, held_misfit, places)
                    hidden = hidden or share - _ERRORS * error > most
        size, limit = max(bounds, default=(np.inf, np.inf))
        cannot_tell = None
        if not traces or not effect.visible:
            cannot_tell = NOT_SHOWN
        elif hidden:
            cannot_tell = f"refitted far from the rig, {', '.join(held)} may stand in for it"
        elif limit > farthest(candidate.parameters[0], candidate.neutral[parameter]):
            cannot_tell = OUT_OF_RANGE
        limits.append(
            AbsentLimit(
                effect=candidate.name,
                parameter=parameter,
                size=size,
                limit=limit,
                cannot_tell=cannot_tell,
            )
        )
    return tuple(limits)


def widest(limits: Sequence[Sequence[AbsentLimit]]) -> tuple[AbsentLimit, ...]:
    """Of each effect the limit that holds beside every one of several models.

    Args:
        limits: one sequence per model, of the same effects in the same order.
    """
    return tuple(max(same, key=_order) for same in zip(*limits, strict=True))


def _order(limit: AbsentLimit) -> tuple[bool, float]:
    return limit.cannot_tell is not None, limit.limit


def supported(
    limits: Sequence[AbsentLimit],
    verdict: Verdict,
    families: Mapping[str, str],
    models: Sequence[Sequence[str]],
) -> tuple[AbsentLimit, ...]:
    """Limits as far as the verdict supports the model that they were taken beside.

    A model that leaves something may have taken up an effect in another's name, and of effects of
    one family each takes up the others. Only a clean name, or no gap, leaves every limit, but of
    effects in a model that predicts as well.

    Args:
        limits: beside the best model and those tied with it.
        verdict: of the diagnosis.
        families: effect -> its family.
        models: names of the effects of the best model and of those that predict as well.
    """
    standing = {name: families.get(name) for names in models for name in names}

    def why(limit: AbsentLimit) -> str | None:
        if limit.cannot_tell is not None:
            return limit.cannot_tell
        if verdict not in (Verdict.NO_GAP, Verdict.NAMED, Verdict.AMBIGUOUS):
            return UNEXPLAINED_PART
        if limit.effect in standing:
            return TIED
        if verdict is not Verdict.AMBIGUOUS:
            return None
        same = [n for n, family in standing.items() if family == families.get(limit.effect)]
        return f"{same[0]} is of the same family and may stand in for it" if same else None

    return tuple(replace(limit, cannot_tell=why(limit)) for limit in limits)


def farthest(parameter: FreeParameter, neutral: float) -> float:
    """Largest distance from neutral that a parameter's range allows [SI]."""
    return max(abs(parameter.low - neutral), abs(parameter.high - neutral))


def _held(nuisance: Sequence[FreeParameter], values: Mapping[str, float]) -> dict[str, float]:
    """Nuisance parameters refitted farther than they are known, at the end of what is known."""
    held: dict[str, float] = {}
    for parameter in nuisance:
        reach = KNOWN_NUISANCE * abs(parameter.start)
        low, high = parameter.start - reach, parameter.start + reach
        if not low <= values[parameter.name] <= high:
            held[parameter.name] = min(max(values[parameter.name], low), high)
    return held


def _with_held(
    fitter: Fitter, fit: Refit, held: Mapping[str, float]
) -> tuple[TangentSpace, FloatArray | None]:
    """Tangent space and misfit of a fit with some parameters held; no misfit if it breaks down."""
    free = [i for i, p in enumerate(fit.parameters) if p.name not in held]
    space = TangentSpace(fit.jacobian[:, free])
    (residual,) = fitter.changes([{**fit.values, **held}], np.zeros(len(fit.jacobian)))
    return space, None if residual is None else space.project_out(-residual)


def _sized(
    candidate: Candidate, own: Signature, misfit: FloatArray, places: Sequence[BlockPlace]
) -> tuple[float, float]:
    """Size that a misfit shows of a signature, in units of its own, and its standard error."""
    share = own.share(misfit)
    square = float(own.projected @ own.projected)
    error = _error(own, misfit, places) if square > 0.0 else np.inf
    return abs(share) if candidate.two_sided else max(share, 0.0), error


def _hidden_by(form_error: float, own: Signature) -> float:
    """Size of an effect, in units of its signature, that leaves a given loss."""
    return math.sqrt(form_error / float(own.projected @ own.projected))


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
