"""Which of several models to recommend: what a scan chose, if it leaves nothing to explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.models import Candidate
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import what_is_missing
from pamsim.identification.structure_choice import p_value_of_improvement
from pamsim.inference.criteria import aicc_above_best

_LEVEL = 0.05  # probability of accepting a parameter that does not help, per comparison
_TIE = 2.0  # difference of AICc below which two models are equally supported


@dataclass(frozen=True, kw_only=True)
class Recommendation:
    """The model to use, if any.

    Attributes:
        name: of the candidate; empty if none can be trusted, or past inputs explain part of the
            residuals of the best.
        best: the model that describes the records best; empty if none can be trusted.
        reason: for the best, as a sentence.
        missing: what the best does not describe, as a sentence; empty if nothing.
        aicc: name of every continuous candidate -> AICc by effective samples, relative to the best.
        effective_samples: number of independent samples that the residuals are worth.
    """

    name: str
    best: str
    reason: str
    missing: str
    aicc: dict[str, float]
    effective_samples: float


def recommend(
    candidates: Sequence[Candidate],
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    chosen: str = "",
    why: str = "",
) -> Recommendation:
    """Recommend one continuous model; discrete ones stand beside for comparison.

    What a scan chose is the best. Else only fits that converged and whose parameters the data
    determine are eligible. With held-out trials a richer model is preferred if its squared error
    there is significantly smaller (test of Diebold and Mariano, one-sided, 5 %). Without, the
    smallest AICc decides, or the simpler model if it is within 2. AICc uses the effective number of
    independent samples, because the residuals of a mechanism are correlated and would otherwise
    favour every added parameter. ``chosen`` is the name of the candidate that a scan led to.

    Source: Diebold and Mariano (J. Business & Economic Statistics 1995); Hurvich and Tsai
    (Biometrika 1989); rule of 2 of Burnham and Anderson, Model Selection (2002).
    """
    fits = {c.name: c.fit for c in candidates if c.continuous}
    squares = {
        name: sum(trial.samples * trial.rms**2 for trial in fit.trials)
        for name, fit in fits.items()
    }
    unknowns = {
        name: fit.coordinates.size + fit.structure.per_trial * len(fit.trials)
        for name, fit in fits.items()
    }
    # Samples divided by twice the correlation time of the residuals that are left at best.
    sizes = [record.output.size for record in records]
    effective = fits[min(squares, key=lambda name: squares[name])].noise.independent(sizes)
    errors = [square / sum(sizes) for square in squares.values()]
    above = aicc_above_best(errors, list(unknowns.values()), effective)
    scores = dict(zip(fits, above, strict=True))
    order = sorted(fits, key=lambda name: unknowns[name])
    converged = [name for name in order if fits[name].status is FitStatus.CONVERGED]
    best = missing = ""
    if chosen:
        best, reason = chosen, why
    elif not converged:
        reason = "; ".join(f"{name.replace('_', ' ')}: {fits[name].sentence}" for name in order)
        reason = f"no model can be trusted ({reason})"
    elif held_out:
        best, reason = _by_held_out(converged, fits, held_out)
    else:
        best, reason = _by_aicc(converged, scores, effective)
    for one in candidates:
        if one.name == best:
            missing = what_is_missing(one.fit, records, one.adequate)
            if one.fit.status is not FitStatus.CONVERGED:
                vague = f"the records do not determine all of its numbers: {one.fit.sentence}"
                missing = f"{vague}; {missing}" if missing else vague
    return Recommendation(
        name="" if missing else best,
        best=best,
        reason=reason,
        missing=missing,
        aicc=scores,
        effective_samples=effective,
    )


def _by_aicc(converged: list[str], scores: dict[str, float], effective: float) -> tuple[str, str]:
    best = min(scores[name] for name in converged)
    name = next(name for name in converged if scores[name] <= best + _TIE)
    rivals = [rival for rival in converged if rival != name]
    if not rivals:
        return name, "the only model whose parameters the data determine"
    rival = min(rivals, key=lambda each: scores[each])
    gap = scores[rival] - scores[name]
    against = rival.replace("_", " ")
    if gap < 0.0:
        reason = f"simpler than {against}, whose AICc is only {-gap:.1f} smaller"
    else:
        reason = f"smallest AICc, {gap:.1f} below {against}"
    return name, f"{reason} ({effective:.0f} effective samples; no trial was held out)"


def _by_held_out(
    converged: list[str], fits: dict[str, IdentifiedModel], held_out: Sequence[SignalRecord]
) -> tuple[str, str]:
    errors = {
        name: [fits[name].simulate(record) - record.output for record in held_out]
        for name in converged
    }
    times = [record.sample_time for record in held_out]
    name, reason = converged[0], "the only model whose parameters the data determine"
    for richer in converged[1:]:
        p_value = p_value_of_improvement(errors[name], errors[richer], times)
        shown = f"p = {p_value:.2g}, {len(held_out)} trial(s)"
        if p_value < _LEVEL:
            before = name.replace("_", " ")
            name, reason = richer, f"better than {before} on held-out trials ({shown})"
        elif name == converged[0] or not reason.startswith("better"):
            reason = f"no richer model is better on held-out trials ({shown})"
    return name, reason
