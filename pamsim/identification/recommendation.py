"""Which of the models that ``identify`` has fitted to use, and what the best one is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.identification.choose import by_aicc, by_held_out, pick_trusted
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import Independence, what_is_missing


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One fitted model."""

    name: str  # such as ``second_order_dead_time``
    fit: IdentifiedModel
    # whether past inputs explain part of its residuals; None if that could not be tested
    independence: Independence | None

    @property
    def adequate(self) -> bool:
        """Whether past inputs explain nothing more of the residuals, as far as can be tested."""
        return self.independence is None or self.independence.independent

    @property
    def continuous(self) -> bool:
        """Whether the model is a continuous one."""
        return self.fit.structure.kind == "continuous"


@dataclass(frozen=True, kw_only=True)
class Recommendation:
    """The model to use, if any."""

    best: str  # the model that describes the records best; empty if none can be trusted
    reason: str  # for the best, as a sentence
    missing: str  # what the best does not describe, as a sentence; empty if nothing
    # name of every continuous candidate -> AICc by effective samples, relative to the best
    aicc: dict[str, float]
    effective_samples: float  # number of independent samples that the residuals are worth

    @property
    def name(self) -> str:
        """Of the candidate to use; empty if none can be trusted, or something is missing."""
        return "" if self.missing else self.best


def recommend(
    candidates: Sequence[Candidate],
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    chosen: str = "",
    why: str = "",
) -> Recommendation:
    """Recommend one continuous model; discrete ones stand beside for comparison.

    What a scan chose is the best: ``chosen``, its name. Else only fits that converged and whose
    parameters the data determine are eligible, and held-out trials decide between them, or AICc.
    """
    ranked = sorted(
        (one for one in candidates if one.continuous), key=lambda one: one.fit.structure.unknowns
    )
    names, fits = [one.name for one in ranked], [one.fit for one in ranked]
    by_criterion = by_aicc(fits, records)
    best, reason, missing = chosen, why, ""
    if not chosen:
        choice = by_held_out(fits, records, held_out) if held_out else by_criterion
        place, reason = pick_trusted(choice, [name.replace("_", " ") for name in names])
        best = "" if place is None else names[place]
    if best:
        one = ranked[names.index(best)]
        missing = what_is_missing(one.fit, records, one.adequate)
        unstable = [c.name for c in candidates if _unstable_in_closed_loop(c.fit, records)]
        if unstable:  # residuals of a stable model do not show what else is missing
            missing = (
                f"the plant may be unstable, in a closed loop: {unstable[0]} has a pole outside the"
                " unit circle, and all continuous models are stable"
            )
        if one.fit.status is not FitStatus.CONVERGED:
            vague = f"the records do not determine all of its numbers: {one.fit.sentence}"
            missing = f"{vague}; {missing}" if missing else vague
    return Recommendation(
        best=best,
        reason=reason,
        missing=missing,
        aicc=dict(zip(names, by_criterion.scores, strict=True)),
        effective_samples=by_criterion.effective,
    )


def _unstable_in_closed_loop(fit: IdentifiedModel, records: Sequence[SignalRecord]) -> bool:
    """Whether a pole of an ARX model would let noise grow beyond the output within its trial.

    By the lower end of the pole's interval. The output of two integrators grows, too, but not so.
    """
    structure = fit.structure
    if not isinstance(structure, DiscreteStructure) or structure.kind != "arx":
        return False

    def largest(coordinates: FloatArray) -> FloatArray:
        return np.max(np.abs(np.roots(structure.denominator(coordinates))), keepdims=True)

    half = fit.half_widths(largest)
    least = 0.0 if half is None else float(largest(fit.coordinates)[0] - half[0])
    noise = float(np.sqrt(fit.noise.variance))
    return min(least - 1.0, noise) > 0.0 and any(
        record.output.size * np.log(least) > np.log(np.ptp(record.output) / noise)
        for record in records
    )
