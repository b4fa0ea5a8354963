"""Test of lack of fit: whether a model leaves something that all repeats of a protocol share.

Noise and whatever varies from trial to trial differ between repeats. What is missing from a model
does not. Products of different repeats' residuals therefore measure it without any noise floor, and
flipping the signs of whole trials gives their distribution where nothing is missing.

Parameters that vary from trial to trial would hide a small remainder. They are projected out of
each trial: the model's own parameters, and those directions of the library in which the trials of a
protocol differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.diagnosis.method.verdict_thresholds import (
    LACK_OF_FIT,
    LACK_OF_FIT_LOSS,
    LACK_OF_FIT_PATTERNS,
    LACK_OF_FIT_WEAKEST,
)
from pamsim.inference.permutation import sign_arrangements, sign_flips, upper_p_value
from pamsim.inference.residual_block import BlockPlace

FloatArray = NDArray[np.float64]

_VARYING = 0.02
"""Share of the trials' scatter from which they are held to differ in a direction."""

_DIRECTIONS = 8
"""Most directions that are projected out."""

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


@dataclass
class _Trial:
    """A trial's residual and directions, both without what has been projected out so far.

    Attributes:
        protocol: of it.
        residual: (n,) its squares sum to the trial's loss.
        directions: (n, k) of the library.
    """

    protocol: str
    residual: FloatArray
    directions: FloatArray

    def project_out(self, columns: FloatArray) -> None:
        """Project residual and directions onto the orthogonal complement of columns (n, b)."""
        space = TangentSpace(columns)
        self.residual = space.project_out(self.residual)
        self.directions = space.project_out(self.directions)

    def unit_directions(self) -> FloatArray:
        """Directions of length 1, shape (n, k); 0 where nothing is left of one."""
        norms = np.linalg.norm(self.directions, axis=0)
        kept = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
        return self.directions * np.where(kept, 1.0 / np.where(kept, norms, 1.0), 0.0)


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
    trials = _trials(fitter, fit, screened)
    if not trials:
        return LackOfFit(size=0.0, error=0.0, p_value=1.0, attainable=1.0)
    for _ in range(_DIRECTIONS):
        varying = _most_varying(trials)
        if varying is None:
            break
        for trial in trials:
            trial.project_out(trial.unit_directions()[:, [varying]])
    return _shared(trials, np.random.default_rng(seed))


def shared_when_held_out(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, *, seed: int = 0
) -> LackOfFit:
    """What repeats share of trials that no fit has seen, including what varies between trials.

    Its size is the excess over the noise of the same repeats. Trials of a protocol that by chance
    vary the same way share that too; the p-value allows for it.

    Args:
        layout: of the residual.
        residual: (n,) of a fitted model [SI].
        floor: of the noise.
        seed: random seed of the sign flips.
    """
    held_out = [p for p in layout.places if p.block.trial in layout.held_out]
    weighted = residual * layout.weights(floor.sd) / np.sqrt(len(layout.channels))
    trials = [
        _Trial(protocol, weighted[rows], np.zeros((rows.size, 0)))
        for protocol, rows_of in _repeated(held_out).items()
        for rows in rows_of
    ]
    if not trials:
        return LackOfFit(size=0.0, error=0.0, p_value=1.0, attainable=1.0)
    return _shared(trials, np.random.default_rng(seed))


def _trials(fitter: Fitter, fit: Refit, screened: Sequence[Screened]) -> list[_Trial]:
    """Fitted trials that have repeats, without what the model's own parameters can do."""
    residual = fitter.weighted(fit.residual)
    columns = [trace.signature.projected for effect in screened for trace in effect.traces]
    directions = np.stack(columns, axis=1) if columns else np.zeros((residual.size, 0))
    layout = fitter.simulator.layout
    fitted = layout.uncut(layout.fitted_places)
    places = _repeated(fitted)
    scale = np.sqrt(len({p.block.trial for p in fitted}))
    trials: list[_Trial] = []
    for protocol, rows_of in places.items():
        for rows in rows_of:
            trial = _Trial(protocol, scale * residual[rows], directions[rows])
            trial.project_out(fit.jacobian[rows])
            trials.append(trial)
    return trials


def _repeated(places: Iterable[BlockPlace]) -> dict[str, list[NDArray[np.intp]]]:
    """Protocol -> rows of each of its trials, cut to what all of them have."""
    rows: dict[str, dict[str, dict[str, slice]]] = {}
    for place in places:
        block = place.block
        rows.setdefault(block.protocol, {}).setdefault(block.trial, {})[block.channel] = place.rows
    repeated: dict[str, list[NDArray[np.intp]]] = {}
    for protocol, trials in rows.items():
        if len(trials) < 2:
            continue
        parts = list(trials.values())
        shared = [c for c in parts[0] if all(c in channels for channels in parts)]
        counts = {c: min(p[c].stop - p[c].start for p in parts) for c in shared}
        if shared:
            repeated[protocol] = [
                np.concatenate([np.arange(p[c].start, p[c].start + counts[c]) for c in shared])
                for p in parts
            ]
    return repeated


def _most_varying(trials: Sequence[_Trial]) -> int | None:
    """Direction in which the trials of a protocol differ most; None if none exceeds the share."""
    total, explained = 0.0, np.zeros(trials[0].directions.shape[1])
    for protocol in dict.fromkeys(t.protocol for t in trials):
        members = [t for t in trials if t.protocol == protocol]
        mean = np.mean([t.residual for t in members], axis=0)
        for trial in members:
            scatter = trial.residual - mean
            total += float(scatter @ scatter)
            explained += (trial.unit_directions().T @ scatter) ** 2
    if not explained.size or not total > 0.0 or explained.max() < _VARYING * total:
        return None
    return int(np.argmax(explained))


def _shared(trials: Sequence[_Trial], rng: np.random.Generator) -> LackOfFit:
    """Mean product of different repeats' residuals, against the same with trials' signs flipped."""
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
