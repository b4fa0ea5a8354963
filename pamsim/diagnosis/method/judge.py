"""Whether adding effects to the base model predicts held-out trials better, by how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.evidence import Comparison, compare, losses
from pamsim.diagnosis.method.intervals import intervals95
from pamsim.diagnosis.method.polish import polish
from pamsim.diagnosis.method.refit import Fitter, Refit

EFFECT_FLOOR = 0.01
"""Gain, in noise floors, below which an effect is not claimed: a candidate nearer the truth by luck
does predict a little better."""

SIGNIFICANCE = 0.05
"""Share of false claims allowed over all effects that were tried."""


@dataclass(frozen=True, kw_only=True)
class Trialled:
    """A model with some effects freed, after its fit.

    Attributes:
        candidates: the effects.
        fit: the best over the starts.
        loss: held-out trial -> loss, 1 for a perfect model.
        gain: over the base model on the held-out trials.
        intervals: name of each parameter -> 95 % interval [SI].
    """

    candidates: tuple[Candidate, ...]
    fit: Refit
    loss: Mapping[str, float]
    gain: Comparison
    intervals: Mapping[str, tuple[float, float]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(c.name for c in self.candidates)

    @property
    def mean_loss(self) -> float:
        """Mean loss over the held-out trials."""
        return float(np.mean(list(self.loss.values())))

    def size_known(self) -> bool:
        """Whether every effect's interval is off neutral, and its size not at an arbitrary end."""
        for candidate in self.candidates:
            size = candidate.parameters[0].name
            low, high = self.intervals[size]
            if low <= candidate.neutral[size] <= high:
                return False
            if size in self.fit.at_bound and not candidate.effect.parameters[0].natural_ends:
                return False
        return True

    def accepted(self, tried: int, over: Comparison | None = None) -> bool:
        """Whether its effects may be claimed.

        Args:
            tried: models that were compared, against whose luck it must stand.
            over: gain that counts; that over the base model if left out.
        """
        gain = over or self.gain
        sure = gain.p_value * tried < SIGNIFICANCE and gain.gain > EFFECT_FLOOR
        return sure and self.size_known()


def trial(
    fitter: Fitter,
    base: Refit,
    base_loss: Mapping[str, float],
    candidates: Sequence[Candidate],
    starts: Sequence[Mapping[str, float]],
) -> Trialled | None:
    """Fit the base model with effects freed, from several starts, and judge it.

    Args:
        fitter: of the trials.
        base: fit of the base model.
        base_loss: its loss on the held-out trials.
        candidates: effects to free.
        starts: values of their parameters to begin from [SI].

    Returns:
        The result, or None if the simulation breaks down.
    """
    parameters = (*base.parameters, *(p for c in candidates for p in c.parameters))
    try:
        found = fitter.fit(parameters, [{**base.values, **start} for start in starts])
    except InputError:
        return None
    return judged(fitter, base_loss, candidates, found)


def judged(
    fitter: Fitter, base_loss: Mapping[str, float], candidates: Sequence[Candidate], found: Refit
) -> Trialled:
    """A fit with its losses and intervals.

    Args:
        fitter: of the trials.
        base_loss: of the base model on the held-out trials.
        candidates: effects that were freed.
        found: the fit.
    """
    layout = fitter.simulator.layout
    loss = losses(layout, found.residual, fitter.floor, held_out=True)
    return Trialled(
        candidates=tuple(candidates),
        fit=found,
        loss=loss,
        gain=compare(base_loss, loss, layout.protocol_of),
        intervals=intervals95(fitter, found),
    )


def polished(fitter: Fitter, base_loss: Mapping[str, float], model: Trialled) -> Trialled:
    """A model fitted the rest of the way in fine steps, judged anew."""
    return judged(fitter, base_loss, model.candidates, polish(fitter, model.fit))
