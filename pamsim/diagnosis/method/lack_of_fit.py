"""Whether a model leaves something that all repeats of a protocol share: a test of lack of fit.

Noise and whatever varies from trial to trial differ between repeats. What is missing from a model
does not. So the products of different repeats' residuals measure it, without any noise floor, and
turning the signs of whole trials shows what chance makes of such products.

Parameters that vary from trial to trial would drown a small remainder. The part of each trial that
they can make is left out: the model's own parameters, and those directions of the library that the
trials of a protocol are seen to differ by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import TangentSpace

FloatArray = NDArray[np.float64]

SIGNIFICANCE = 0.001
"""p-value from which a remainder is held to be there."""

LEAST = 0.005
"""Remainder, in floors, that is left alone: numerical errors of a good simulation reach it."""

_VARYING = 0.02
"""Share of the trials' scatter from which a direction counts as one in which they differ."""

_DIRECTIONS = 8
"""Most of these."""

_FLIPS = 9999


@dataclass(frozen=True, kw_only=True)
class LackOfFit:
    """What repeats share that a model does not predict.

    Attributes:
        size: its mean square, in floors; may come out below 0 where there is none.
        p_value: one-sided, of none; 1 without repeats.
    """

    size: float
    p_value: float

    @property
    def found(self) -> bool:
        """Whether the model lacks something."""
        return self.p_value < SIGNIFICANCE and self.size > LEAST


@dataclass
class _Trial:
    """A trial's residual and directions, both across what has been left out so far.

    Attributes:
        protocol: of it.
        residual: (n,) its squares sum to the trial's loss.
        directions: (n, k) of the library.
    """

    protocol: str
    residual: FloatArray
    directions: FloatArray

    def leave_out(self, columns: FloatArray) -> None:
        """Keep of both what lies across the columns, shape (n, b)."""
        space = TangentSpace(columns)
        self.residual = space.across(self.residual)
        self.directions = space.across(self.directions)

    def units(self) -> FloatArray:
        """Directions of length 1, shape (n, k); 0 where nothing is left of one."""
        norms = np.linalg.norm(self.directions, axis=0)
        kept = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
        return self.directions * np.where(kept, 1.0 / np.where(kept, norms, 1.0), 0.0)


def lack_of_fit(
    fitter: Fitter, found: Refit, screened: Sequence[Screened], *, seed: int = 0
) -> LackOfFit:
    """Test what a fitted model leaves of the trials that it was fitted to.

    Args:
        fitter: of the trials.
        found: the fit, with its slopes.
        screened: effects, whose signatures are the directions in which trials may differ.
        seed: of the sign flips.
    """
    trials = _trials(fitter, found, screened)
    if not trials:
        return LackOfFit(size=0.0, p_value=1.0)
    for _ in range(_DIRECTIONS):
        varying = _most_varying(trials)
        if varying is None:
            break
        for trial in trials:
            trial.leave_out(trial.units()[:, [varying]])
    return _shared(trials, np.random.default_rng(seed))


def _trials(fitter: Fitter, found: Refit, screened: Sequence[Screened]) -> list[_Trial]:
    """Fitted trials that have repeats, across the model's own parameters."""
    residual = fitter.weighted(found.residual)
    columns = [trace.signature.across for one in screened for trace in one.traces]
    directions = np.stack(columns, axis=1) if columns else np.zeros((residual.size, 0))
    places = _repeated(fitter.simulator.layout)
    scale = np.sqrt(len(fitter.simulator.layout.trials(held_out=False)))
    trials: list[_Trial] = []
    for protocol, rows_of in places.items():
        for rows in rows_of:
            trial = _Trial(protocol, scale * residual[rows], directions[rows])
            trial.leave_out(found.slopes[rows])
            trials.append(trial)
    return trials


def _repeated(layout: TrialLayout) -> dict[str, list[NDArray[np.intp]]]:
    """Protocol -> rows of each of its fitted trials, cut to what all of them have."""
    rows: dict[str, dict[str, dict[str, slice]]] = {}
    for place in layout.fitted_places:
        block = place.block
        rows.setdefault(block.protocol, {}).setdefault(block.trial, {})[block.channel] = place.rows
    found: dict[str, list[NDArray[np.intp]]] = {}
    for protocol, trials in rows.items():
        if len(trials) < 2:
            continue
        parts = list(trials.values())
        shared = [c for c in parts[0] if all(c in channels for channels in parts)]
        counts = {c: min(p[c].stop - p[c].start for p in parts) for c in shared}
        if shared:
            found[protocol] = [
                np.concatenate([np.arange(p[c].start, p[c].start + counts[c]) for c in shared])
                for p in parts
            ]
    return found


def _most_varying(trials: Sequence[_Trial]) -> int | None:
    """The direction that makes most of what the trials of a protocol differ by, if it is much."""
    total, made = 0.0, np.zeros(trials[0].directions.shape[1])
    for protocol in dict.fromkeys(t.protocol for t in trials):
        members = [t for t in trials if t.protocol == protocol]
        mean = np.mean([t.residual for t in members], axis=0)
        for trial in members:
            scatter = trial.residual - mean
            total += float(scatter @ scatter)
            made += (trial.units().T @ scatter) ** 2
    if not made.size or not total > 0.0 or made.max() < _VARYING * total:
        return None
    return int(np.argmax(made))


def _shared(trials: Sequence[_Trial], rng: np.random.Generator) -> LackOfFit:
    """Mean product of different repeats' residuals, against the same with trials' signs turned."""
    size, chance = 0.0, np.zeros(_FLIPS)
    protocols = list(dict.fromkeys(t.protocol for t in trials))
    for protocol in protocols:
        stack = np.stack([t.residual for t in trials if t.protocol == protocol])
        products = stack @ stack.T
        np.fill_diagonal(products, 0.0)
        pairs = len(stack) * (len(stack) - 1) * len(protocols)
        signs = rng.choice([-1.0, 1.0], (_FLIPS, len(stack)))
        size += float(products.sum()) / pairs
        chance += np.einsum("fi,ij,fj->f", signs, products, signs) / pairs
    # All signs alike give the same number again, but for its last bits.
    beyond = int(np.sum(chance >= size - 1e-12 * abs(size)))
    return LackOfFit(size=size, p_value=(1 + beyond) / (1 + _FLIPS))
