"""A model of recordings with some effects freed, judged by held-out trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate, of_all
from pamsim.comparison.noise_floor import floor_beside
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.evidence import (
    Improvement,
    compare_models,
    losses,
    mean_over_trials,
    perfect_losses,
)
from pamsim.diagnosis.method.polish import polish
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.trial_variation import TrialVariation, held_out_excess
from pamsim.diagnosis.method.verdict_thresholds import (
    FAR_NUISANCE,
    LEAST_GAIN,
    SIGNIFICANCE,
    UNREPEATED_GAIN,
)
from pamsim.inference.free_parameter import SearchScale
from pamsim.inference.intervals import parameter_covariance
from pamsim.inference.simulator_fit import Linearisation

_FEWEST_REPEATS = 2
"""Fitted trials of a protocol: of four recorded, one is held out. What differs from trial to trial
would go unseen if they were taken for one trial with coloured noise."""


@dataclass(frozen=True, kw_only=True)
class TrialModel:
    """A model with some effects freed, after its fit.

    Attributes:
        candidates: the effects.
        fit: the best over the starts.
        loss: held-out trial -> loss, 1 for a perfect model.
        excess: held-out trial -> what the model leaves beyond noise and what varies from trial to
            trial, see `held_out_excess`.
        left: the same over all of them, with its error.
        improvement: over the base model on the held-out trials.
        intervals: name of each parameter -> 95 % interval [SI].
        apart: name of each parameter of one muscle whose value for all was fitted, too -> 95 %
            interval of the difference [SI].
        least_gain: fall of the loss from which the effects may be claimed.
    """

    candidates: tuple[Candidate, ...]
    fit: Refit
    loss: Mapping[str, float]
    excess: Mapping[str, float]
    left: Improvement
    improvement: Improvement
    intervals: Mapping[str, tuple[float, float]]
    apart: Mapping[str, tuple[float, float]]
    least_gain: float = LEAST_GAIN

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(c.name for c in self.candidates)

    @property
    def labels(self) -> tuple[str, ...]:
        """Names and forms of the effects."""
        return tuple(c.label for c in self.candidates)

    @property
    def families(self) -> frozenset[str]:
        """Families of the effects."""
        return frozenset(c.family for c in self.candidates)

    @property
    def family(self) -> str:
        """Families of the effects, joined by ``+``."""
        return "+".join(dict.fromkeys(c.family for c in self.candidates))

    @property
    def mean_loss(self) -> float:
        """Mean loss over the held-out trials."""
        return float(np.mean(list(self.loss.values())))

    def all_present(self) -> bool:
        """Whether every effect's interval excludes neutral.

        Where one does not, the others of its parameters may carry the model, as the sliding
        friction of a Stribeck curve does, but for those that are another size.
        """
        return all(any(self._off_neutral(c, name) for name in c.sizes) for c in self.candidates)

    def _off_neutral(self, candidate: Candidate, name: str) -> bool:
        """Whether the interval of one of an effect's parameters excludes neutral."""
        if name in self.apart:
            return not _holds(self.apart[name], 0.0)
        return not _holds(self.intervals[name], candidate.neutral[name])

    def size_known(self) -> bool:
        """Whether every effect's interval excludes neutral and its size is off arbitrary ends."""
        if not self.all_present():
            return False
        for candidate in self.candidates:
            size = candidate.parameters[0].name
            if size in self.fit.at_bound and not candidate.effect.parameters[0].natural_ends:
                return False
        return True

    def strained(self) -> bool:
        """Whether a size or nuisance parameter is at an end of its range, or the latter far off.

        Shapes of an effect may end anywhere: they are not its size. Nor does a nuisance parameter
        count whose interval holds the rig's value: it wandered off for want of evidence.
        """
        sizes = {c.parameters[0].name for c in self.candidates}
        freed = {p.name for c in self.candidates for p in c.parameters}
        moved = [
            p
            for p in self.fit.parameters
            if p.name not in freed and not _holds(self.intervals[p.name], p.start)
        ]
        ended = set(self.fit.at_bound) & (sizes | {p.name for p in moved})
        return bool(ended) or any(far_from(self.fit.values[p.name], p.start) for p in moved)

    def accepted(self, tried: int) -> bool:
        """Whether its effects may be claimed.

        Args:
            tried: number of models that were compared, for the Bonferroni correction.
        """
        better = self.improvement.p_value * tried < SIGNIFICANCE
        return better and self.improvement.gain > self.least_gain and self.size_known()


def _holds(interval: tuple[float, float], value: float) -> bool:
    return interval[0] <= value <= interval[1]


def far_from(value: float, stated: float) -> bool:
    """Whether a nuisance parameter was refitted far from what the rig states, both in SI units."""
    return abs(value - stated) > FAR_NUISANCE * abs(stated)


def fit_effects(
    fitter: Fitter,
    base: Refit,
    base_loss: Mapping[str, float],
    candidates: Sequence[Candidate],
    starts: Sequence[Mapping[str, float]],
    *,
    variation: TrialVariation | None = None,
    worth: float = np.inf,
) -> TrialModel | None:
    """Fit the base model with effects freed, from several starts, and judge it.

    Args:
        fitter: of the trials.
        base: fit of the base model.
        base_loss: its loss on the held-out trials.
        candidates: effects to free.
        starts: values of their parameters to begin from [SI].
        variation: from trial to trial; None where it is not known.
        worth: cost that the fit must come to, see `Fitter.fit`.

    Returns:
        The result, or None if the simulation breaks down.
    """
    parameters = (*base.parameters, *(p for c in candidates for p in c.parameters))
    try:
        begins = [{**base.values, **start} for start in starts]
        fit = fitter.fit(parameters, begins, worth=worth)
    except InputError:
        return None
    return _judged(fitter, base_loss, candidates, fit, variation)


def polished(
    fitter: Fitter,
    base_loss: Mapping[str, float],
    model: TrialModel,
    variation: TrialVariation | None = None,
) -> TrialModel:
    """A model fitted to convergence in fine time steps, judged again."""
    return _judged(fitter, base_loss, model.candidates, polish(fitter, model.fit), variation)


def _judged(
    fitter: Fitter,
    base_loss: Mapping[str, float],
    candidates: Sequence[Candidate],
    fit: Refit,
    variation: TrialVariation | None,
) -> TrialModel:
    """A fit with its losses and intervals."""
    layout = fitter.simulator.layout
    loss = losses(layout, fit.residual, fitter.floor, held_out=True)
    excess = held_out_excess(layout, fit.residual, fitter.floor, variation)
    intervals, apart = _intervals95(fitter, fit)
    return TrialModel(
        candidates=tuple(candidates),
        fit=fit,
        loss=loss,
        excess=excess,
        left=mean_over_trials(excess, layout.protocol_of),
        improvement=compare_models(base_loss, loss, layout),
        intervals=intervals,
        apart=apart,
        least_gain=_least_gain(fitter, fit),
    )


def _least_gain(fitter: Fitter, fit: Refit) -> float:
    """Fall of the loss from which the effects of a fit may be claimed."""
    layout = fitter.simulator.layout
    if not layout.origin:
        return LEAST_GAIN
    noise = perfect_losses(layout, floor_beside(fitter.floor, layout, fit.residual))
    return UNREPEATED_GAIN * float(np.mean(list(noise.values())))


Intervals = dict[str, tuple[float, float]]


def _intervals95(fitter: Fitter, fit: Refit) -> tuple[Intervals, Intervals]:
    """95 % intervals [SI] from the scatter of trials about the mean of their protocol.

    They hold for noise that drifts within trials. A parameter that the data do not show gets its
    whole range.

    Returns:
        Name -> interval of each parameter, and of the difference between each of one muscle and
        that of all, see `TrialModel.apart`.
    """
    norms = np.linalg.norm(fit.jacobian, axis=0)
    shown = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
    scale = SearchScale(fit.parameters)
    covariance = np.diag(np.full(norms.size, np.inf))
    if shown.any():
        count = int(shown.sum())
        spread = parameter_covariance(
            Linearisation(
                places=fitter.simulator.layout.fitted_places,
                residual=fit.residual[fitter.fitted],
                jacobian=fit.jacobian[:, shown] / fitter.weights[:, np.newaxis],
                weight=fitter.weights,
            ),
            np.eye(count),
            np.zeros((count, count)),
            fewest_repeats=_FEWEST_REPEATS,
        )
        factor = np.broadcast_to(spread.quantile, count)
        covariance[np.ix_(shown, shown)] = spread.matrix * np.outer(factor, factor)
    reach = np.sqrt(np.diag(covariance))
    at = scale.place(fit.values)
    low = scale.values(np.clip(at - reach, 0.0, 1.0))
    high = scale.values(np.clip(at + reach, 0.0, 1.0))
    index = {p.name: i for i, p in enumerate(fit.parameters)}
    width = np.array([p.high - p.low for p in fit.parameters])
    apart: Intervals = {}
    for name, i in index.items():
        j = index.get(of_all(name))
        if j is not None and shown[i] and shown[j]:
            own, common = width[i], width[j]
            variance = (
                own**2 * covariance[i, i]
                + common**2 * covariance[j, j]
                - 2.0 * own * common * covariance[i, j]
            )
            difference = fit.values[name] - fit.values[of_all(name)]
            far = math.sqrt(max(variance, 0.0))
            apart[name] = (difference - far, difference + far)
    return {name: (low[name], high[name]) for name in low}, apart
