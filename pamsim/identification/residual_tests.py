"""Test whether past inputs, or a nonlinearity, explain part of a linear model's residuals.

Tests lag by lag almost always give a false alarm in one of many lags. Here the residuals are
regressed on all lagged inputs at once, after whitening (residuals may be coloured) and after
projecting out the directions that the fit has already used, so that the statistic has its nominal
distribution.

A weak static nonlinearity before, behind or within the dynamics adds the squares and cubes of the
input and of the model's output, unfiltered and through the model, to the output.
Source: Ramsey's test of specification (Journal of the Royal Statistical Society B 31, 1969), with
the filtered powers of a second- and third-order Volterra series.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np
import scipy.special

from pamsim.core.digits import p_in_words
from pamsim.core.encoding import json_key
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import SignalRecord
from pamsim.identification.separable import column_scale, linearise
from pamsim.identification.triangular import triangular_factor
from pamsim.inference.trial_noise import WHITE

_f_tail: Any = scipy.special.fdtrc

_LEVEL = 0.05  # p-value below which past inputs explain something
_EXCITED = 1e-3  # a direction of lagged inputs weaker than this, relative, is ignored
_DEPENDENT = 1e-10  # a direction of the fit weaker than this, relative, is rounding
_ROUNDING = 1e-5  # percent points below 100
_NONLINEAR = 0.01  # p-value below which powers of input and output explain part of them
_POWERS = (2, 3)  # the first two terms of a weak nonlinearity
_LAGS = 20  # of each input: some in every decade from a sample to the longest
_SETTLED = 3.0  # slowest time constants that the lags reach back
_BLOCK = 8192  # rows of regressors at once: thirty columns of them stay in a processor's cache

_Rows = Callable[[int, int], FloatArray]
"""First row and the one after the last -> regressors of a trial there, ``(rows, columns)``."""


@dataclass(frozen=True, kw_only=True)
class RegressorTest:
    """F test that added regressors explain nothing of the residuals."""

    statistic: float  # mean square explained over the residual's own [-]
    # independent directions among the regressors, residual freedom
    degrees_of_freedom: tuple[int, int]
    p_value: float  # probability of a larger statistic if the model is right

    @property
    def shown(self) -> str:
        """The p-value in words."""
        return p_in_words(self.p_value)


@dataclass(frozen=True, kw_only=True)
class Independence(RegressorTest):
    """Portmanteau test that past inputs explain nothing of the residuals."""

    longest_lag: float = field(metadata=json_key("longest_lag_s"))  # of the lagged inputs [s]
    independent: bool  # whether the p-value is at least 5 %
    sentence: str  # the same for a person


def residual_independence(fit: IdentifiedModel, records: Sequence[SignalRecord]) -> Independence:
    """Test whether past inputs explain part of the residuals.

    The lags are spread evenly in the logarithm from one sample to three of the model's slowest time
    constants (at most a quarter of the shortest record). Lag 0 is among them where it acts in the
    direction of the gain, as where an output is read after the input of its row acted. A controller
    that computes the input from that output acts against it: that is no fault of the model.

    Raises:
        InputError: for too few samples.

    Source: score test of added regressors (Breusch and Godfrey's principle) on lagged inputs; for
    white residuals it is the correlation test of Ljung (System Identification, 2nd ed., 16.6) with
    the covariance of estimated parameters.
    """
    latest = max(channel.dead_time for channel in fit.channels)
    reach = _SETTLED * fit.structure.slowest(fit.coordinates) + latest
    most = 0.25 * min(record.duration for record in records)
    longest = float(np.clip(reach, 2.0 * max(record.sample_time for record in records), most))
    if 100.0 - fit.fit_percent < _ROUNDING:
        return Independence(
            statistic=0.0,
            degrees_of_freedom=(0, 0),
            p_value=1.0,
            longest_lag=longest,
            independent=True,
            sentence="the model reproduces the records to rounding: nothing is left to explain",
        )
    spread = np.geomspace(min(r.sample_time for r in records), longest, _LAGS)
    left = _unexplained(fit, records, [_lagged_inputs(record, spread) for record in records])
    gains = fit.structure.static_gains(fit.coordinates)
    present, past = np.split(left.columns, [gains.size], axis=1)
    explained: Any = np.linalg.lstsq(past, left.residual, rcond=None)[0]
    # Chance has either sign, whatever its size, so that the level stays what it is.
    acts = gains * (present.T @ (left.residual - past @ explained)) > 0.0
    test = _explains(replace(left, columns=np.hstack([present[:, acts], past])))
    independent = test.p_value >= _LEVEL
    verdict = (
        "past inputs explain nothing more of the residuals"
        if independent
        else "past inputs explain part of the residuals: dynamics, dead time or a nonlinearity is "
        "missing in the model"
    )
    sentence = f"{verdict} ({test.shown}, lags to {longest:.2g} s)"
    return Independence(
        **vars(test), longest_lag=longest, independent=independent, sentence=sentence
    )


def _lagged_inputs(record: SignalRecord, spread: FloatArray) -> _Rows:
    """The inputs, then those so much earlier [s]; before the trial they were what they began as."""
    steps = np.unique(np.maximum(np.round(spread / record.sample_time).astype(int), 1))
    # As many columns of every trial.
    steps = np.pad(steps, (1, _LAGS - steps.size), constant_values=(0, steps[-1]))
    longest = int(steps[-1])
    given = np.pad(record.inputs - record.inputs[0], ((longest, 0), (0, 0)))
    firsts = (longest - steps).tolist()
    return lambda begin, end: np.hstack([given[begin + k : end + k] for k in firsts])


@dataclass(frozen=True, kw_only=True)
class _Unexplained:
    """What the fit left, in coordinates in which all inner products are as among the samples."""

    residual: FloatArray  # whitened, (r,)
    columns: FloatArray  # whitened regressors without what the fit used, (r, k)
    samples: int  # of all trials
    freedom: int  # samples less what the fit used


def _unexplained(
    fit: IdentifiedModel, records: Sequence[SignalRecord], added: Sequence[_Rows]
) -> _Unexplained:
    x, theta = np.split(fit.coordinates, [fit.structure.searched])
    # ARX assumes a white equation error: whitening it would test another model.
    noise = WHITE if fit.structure.kind == "arx" else fit.noise
    line = linearise(fit.structure.problem(records), x, theta, noise)
    factors: list[FloatArray] = []
    for i, (record, rows, residual) in enumerate(zip(records, added, line.residuals, strict=True)):
        # ARX has no equations for its first samples.
        first, each = record.output.size - residual.size, []
        for begin in range(0, residual.size, _BLOCK):
            end = min(begin + _BLOCK, residual.size)
            before = min(line.noise.reach(i), begin)
            columns = rows(first + begin - before, first + end)
            columns = np.column_stack([np.ones(len(columns)), columns])
            ones, used = np.split(line.noise.whiten(columns, i)[before:], [1], axis=1)
            here = slice(begin, end)
            each.append(
                triangular_factor(
                    np.column_stack([ones, line.jacobians[i][here], used, residual[here]])
                )
            )
        # Without its first row and column: what is left of the columns beside an offset.
        factors.append(triangular_factor(np.concatenate(each))[1:, 1:])
    # The triangular factor holds all inner products, in a few rows.
    triangle = triangular_factor(np.concatenate(factors))
    count = line.jacobians[0].shape[1]
    known, columns, residual = triangle[:, :count], triangle[:, count:-1], triangle[:, -1]
    known = _directions(known / column_scale(known), _DEPENDENT)
    columns = columns / column_scale(columns)
    samples = sum(one.size for one in line.residuals)
    return _Unexplained(
        residual=residual - known @ (known.T @ residual),
        columns=columns - known @ (known.T @ columns),
        samples=samples,
        freedom=samples - known.shape[1] - line.own,
    )


def _explains(left: _Unexplained) -> RegressorTest:
    basis = _directions(left.columns, _EXCITED)
    directions = basis.shape[1]
    freedom = left.freedom - directions
    if freedom < 1 or directions < 1:
        raise InputError(f"{left.samples} samples are too few for {directions} lags; give fewer")
    explained = float(np.sum((basis.T @ left.residual) ** 2))
    rest = float(left.residual @ left.residual) - explained
    statistic = explained / directions / (rest / freedom) if rest > 0.0 else 0.0
    p_value = float(_f_tail(directions, freedom, statistic))
    return RegressorTest(
        statistic=statistic, degrees_of_freedom=(directions, freedom), p_value=p_value
    )


def _directions(columns: FloatArray, weakest: float) -> FloatArray:
    """Return an orthonormal basis of the columns without directions weaker than ``weakest``."""
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, sizes > weakest * sizes[0]]


def residual_nonlinearity(fit: IdentifiedModel, records: Sequence[SignalRecord]) -> RegressorTest:
    """Test whether powers of inputs and output, or products of inputs, explain the residuals.

    The model is a continuous one, the records the trials it was fitted to.
    """
    moves = np.any([np.ptp(record.inputs, axis=0) > 0.0 for record in records], axis=0)
    moving = np.flatnonzero(moves).tolist()
    powers = [_powers(fit, record, moving) for record in records]
    added = [lambda begin, end, own=own: own[begin:end] for own in powers]
    return _explains(_unexplained(fit, records, added))


def _powers(fit: IdentifiedModel, record: SignalRecord, moving: Sequence[int]) -> FloatArray:
    """Powers of a trial's inputs and output, and products of inputs: ``(N, 6)`` of one input.

    Each unfiltered and through the model, powers of the output through the model alone. ``moving``
    are the inputs that move in some trial: those that rest in this one have columns of zeros.
    """
    structure = fit.structure
    assert isinstance(structure, ContinuousStructure)
    channels = fit.channels

    def through_model(values: FloatArray, given: int) -> FloatArray:
        alone, x = channels[given].structure, channels[given].coordinates
        assert isinstance(alone, ContinuousStructure)
        numerator = x[alone.coefficients()]
        units, hold = (record.units_input[given],), (record.holds[given],)
        filtered = replace(record, inputs=values, units_input=units, holds=hold, held_out=True)
        return alone.responses(x, filtered)[:, : numerator.size] @ numerator

    run = _standardised(fit.simulate(record))
    inputs = {i: _standardised(record.inputs[:, i]) for i in moving}
    columns: list[FloatArray] = []
    for power in _POWERS:
        columns += [*(through_model(run**power, i) for i in moving), run**power]
    for i, given in inputs.items():
        for power in _POWERS:
            columns.append(through_model(given**power, i))
    for i, j in combinations(inputs, 2):
        product = inputs[i] * inputs[j]
        columns += [product, through_model(product, i), through_model(product, j)]
    return np.column_stack(columns)


def _standardised(values: FloatArray) -> FloatArray:
    if np.ptp(values) == 0.0:
        return np.zeros_like(values)
    return (values - np.mean(values)) / np.std(values)


def what_is_missing(fit: IdentifiedModel, records: Sequence[SignalRecord], adequate: bool) -> str:
    """Describe what a continuous model is missing; empty if nothing is.

    That is a nonlinearity where the fitted records show it, else linear dynamics if the model is
    not adequate: past inputs explain part of its residuals. Either may be rounding alone.
    """
    found = _what_explains(fit, records, adequate)
    readings = (np.diff(np.unique(record.output)) for record in records)
    pairs = zip(fit.trials, readings, strict=True)
    if found and all(score.rms <= 0.5 * float(np.min(steps)) for score, steps in pairs):
        found += (
            "; the residuals are no larger than half a step of the output's readings, so that"
            " rounding may explain this"
        )
    return found


def _what_explains(fit: IdentifiedModel, records: Sequence[SignalRecord], adequate: bool) -> str:
    """What explains part of the residuals, as a sentence; empty if nothing does."""
    try:
        test = residual_nonlinearity(fit, records)
    except InputError:
        return "" if adequate else "past inputs explain part of the residuals"
    if test.p_value < _NONLINEAR:
        return (
            "the plant is not linear: powers of input and output explain part of the residuals"
            f" ({test.shown}); no linear model describes these records completely"
        )
    if adequate:
        return ""
    return (
        "past inputs explain part of the residuals, powers of input and output do not"
        f" ({test.shown}): dynamics are missing that no fitted structure has, or another input acts"
    )
