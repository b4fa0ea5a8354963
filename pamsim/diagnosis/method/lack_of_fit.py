"""Test of lack of fit: whether a model leaves something that all repeats of a protocol share.

Noise and whatever varies from trial to trial differ between repeats. What is missing from a model
does not. Products of different repeats' residuals therefore measure it without any noise floor, and
flipping the signs of whole trials gives their distribution where nothing is missing.

Parameters that vary from trial to trial would hide a small remainder. They are projected out of
each trial: the model's own parameters, and those directions of the library in which the trials of a
protocol differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.repeated_trials import (
    RepeatedTrial,
    project_out_variation,
    repeated_rows,
)
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.verdict_thresholds import (
    LACK_OF_FIT,
    LACK_OF_FIT_LOSS,
    LACK_OF_FIT_PATTERNS,
    LACK_OF_FIT_WEAKEST,
)
from pamsim.inference.permutation import sign_arrangements, sign_flips, upper_p_value

_FLIPS = 9999

_ALL = 2**17
"""Most sign patterns that are all computed; of more, some are drawn."""


@dataclass(frozen=True, kw_only=True)
class LackOfFit:
    """What repeats share that a model does not predict.

    Attributes:
        size: its mean square over the noise variance; may come out below 0 where there is none.
        error: its standard error where there is none, from the sign flips; 0 without repeats.
        p_value: one-sided, by sign flips; 1 without repeats.
        attainable: smallest p-value that the repeats can reach; 1 without repeats.
    """

    size: float
    error: float
    p_value: float
    attainable: float

    @property
    def at_most(self) -> float:
        """What may be left although it does not show: the size and its standard error."""
        return max(self.size, 0.0) + self.error

    @property
    def level(self) -> float:
        """p-value below which the remainder counts."""
        within_reach = LACK_OF_FIT_PATTERNS * self.attainable
        return max(LACK_OF_FIT, min(within_reach, LACK_OF_FIT_WEAKEST))

    @property
    def testable(self) -> bool:
        """Whether the repeats could show a remainder of any size."""
        return self.attainable < self.level

    @property
    def significant(self) -> bool:
        """Whether something is missing from the model."""
        return self.p_value < self.level and self.size > LACK_OF_FIT_LOSS


def lack_of_fit(
    fitter: Fitter, fit: Refit, screened: Sequence[Screened], *, seed: int = 0
) -> LackOfFit:
    """Test what a fitted model leaves of the trials that it was fitted to.

    Args:
        fitter: of the trials.
        fit: of the model.
        screened: effects, whose signatures are the directions in which trials may differ.
        seed: random seed of the sign flips.
    """
    trials = fitted_trials(fitter, fit, screened)
    project_out_variation(trials)
    return shared_by_repeats(trials, seed=seed)


def fitted_trials(fitter: Fitter, fit: Refit, screened: Sequence[Screened]) -> list[RepeatedTrial]:
    """Fitted trials that have repeats, without what the model's own parameters can do.

    Their directions are the signatures of the effects, one per trace.
    """
    residual = fitter.weighted(fit.residual)
    columns = [trace.signature.projected for effect in screened for trace in effect.traces]
    directions = np.stack(columns, axis=1) if columns else np.zeros((residual.size, 0))
    layout = fitter.simulator.layout
    fitted = layout.uncut(layout.fitted_places)
    places = repeated_rows(fitted)
    scale = np.sqrt(len({p.block.trial for p in fitted}))
    trials: list[RepeatedTrial] = []
    for protocol, rows_of in places.items():
        for rows in rows_of.values():
            trial = RepeatedTrial(protocol, scale * residual[rows], directions[rows])
            trial.project_out(fit.jacobian[rows])
            trials.append(trial)
    return trials


def shared_by_repeats(trials: Sequence[RepeatedTrial], *, seed: int = 0) -> LackOfFit:
    """Mean product of different repeats' residuals, against the same with trials' signs flipped.

    Args:
        trials: with repeats of each.
        seed: random seed of the sign flips.
    """
    if not trials:
        return LackOfFit(size=0.0, error=0.0, p_value=1.0, attainable=1.0)
    rng = np.random.default_rng(seed)
    protocols = list(dict.fromkeys(t.protocol for t in trials))
    forms = [_products([t.residual for t in trials if t.protocol == p]) for p in protocols]
    size = float(sum(form.sum() for form in forms)) / len(forms)
    patterns = 2 ** sum(len(form) - 1 for form in forms)
    if patterns <= _ALL:
        flipped = np.zeros(1)
        for form in forms:
            flipped = np.add.outer(flipped, _flipped(form, sign_arrangements(len(form)))).ravel()
        flipped = flipped[1:]  # all but the pattern observed, which a p-value counts anyhow
    else:
        flipped = np.zeros(_FLIPS)
        for form in forms:
            signs = np.concatenate(list(sign_flips(_FLIPS, len(form), rng)))
            flipped += _flipped(form, signs)
    scale = float(sum(np.abs(form).sum() for form in forms)) / len(forms)
    return LackOfFit(
        size=size,
        error=float(np.std(flipped)) / len(forms),
        p_value=upper_p_value(flipped / len(forms), size, scale=scale),
        attainable=1.0 / (1 + flipped.size),
    )


def _products(residuals: Sequence[FloatArray]) -> FloatArray:
    """Products of different repeats' residuals over the number of pairs, shape (r, r)."""
    stack = np.stack(residuals)
    products = stack @ stack.T
    np.fill_diagonal(products, 0.0)
    return products / (len(stack) * (len(stack) - 1))


def _flipped(form: FloatArray, signs: FloatArray) -> FloatArray:
    """Sum of a form (r, r) of products with the trials' signs flipped by (k, r), shape (k,)."""
    return np.einsum("fi,ij,fj->f", signs, form, signs)
