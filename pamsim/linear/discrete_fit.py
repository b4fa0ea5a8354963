"""ARX and output-error models of any orders from general inputs, several trials at once."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.signal
import scipy.special
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise
from pamsim.linear.arx import ArxModel
from pamsim.linear.discrete_estimates import (
    continuous_pole,
    discrete_estimates,
    discrete_status,
)
from pamsim.linear.discrete_result import DiscreteFit as DiscreteFit
from pamsim.linear.estimate import pooled_fit_percent, trial_score
from pamsim.linear.noise_weighted_fit import noise_weighted_fit
from pamsim.linear.oe_search import (
    from_differences,
    oe_problem,
    search_starts,
    stacked_least_squares,
)
from pamsim.linear.signal_record import SignalRecord, checked_records

FloatArray = NDArray[np.float64]
_lfilter: Any = scipy.signal.lfilter
_student_quantile: Any = scipy.special.stdtrit

_SAME_RATE = 1e-3


def fit_arx_records(records: Sequence[SignalRecord], *, na: int, nb: int, nk: int) -> DiscreteFit:
    """Estimate one ARX model from all trials by least squares, with an offset for each trial.

    Nothing is assumed about what went before a record.

    Args:
        records: the trials, all with one sample time.
        na: number of output coefficients, >= 0.
        nb: number of input coefficients, >= 1.
        nk: samples between the input and its first effect, >= 0.

    Returns:
        The model. Its intervals hold only if the equation error is white: a sensor's noise on
        the output is not, and biases the poles towards 0.

    Raises:
        InputError: bad orders, no records, sample times that differ, a record too short.
        UnderdeterminedError: the records do not determine the coefficients.

    Source: Matiskova 2021, equations (25)-(29).
    """
    trials, interval = _one_rate(records)
    pairs = [(record.output, record.input) for record in trials]
    theta, covariance, residuals = stacked_least_squares(pairs, na, nb, nk)
    freedom = sum(r.size for r in residuals) - theta.size - len(trials)
    variance = sum(float(r @ r) for r in residuals) / freedom
    count = sum(r.size for r in residuals)
    model = _model(theta, na, nk, interval, variance, count)
    noise = fit_ar_noise(residuals)
    start = max(na, nk + nb - 1)
    ahead = [
        (r.output[start:], r.output[start:] - e) for r, e in zip(trials, residuals, strict=True)
    ]
    return _finished(
        "arx",
        trials,
        model,
        variance * covariance,
        noise,
        ahead,
        quantile=float(_student_quantile(freedom, 0.975)),
    )


def fit_oe(records: Sequence[SignalRecord], *, nb: int, nf: int, nk: int) -> DiscreteFit:
    """Fit one output-error model ``y = B/F u + offset + noise`` to the free run of all trials.

    Before a record its input is taken to have been ``input[0]``, with the output at rest. The
    search starts from ARX, from the iterations of Steiglitz and McBride, and from a grid of lags.

    Args:
        records: the trials, all with one sample time.
        nb: number of input coefficients, >= 1.
        nf: number of poles, >= 1.
        nk: samples between the input and its first effect, >= 0.

    Returns:
        The model with intervals that hold under coloured noise.

    Raises:
        InputError: bad orders, no records, sample times that differ, a record too short.

    Source: Steiglitz and McBride, IEEE Trans. Automatic Control 1965 (starts).
    """
    if nb < 1 or nf < 1 or nk < 0:
        raise InputError(f"orders nb={nb}, nf={nf}, nk={nk}; give nb >= 1, nf >= 1, nk >= 0")
    trials, interval = _one_rate(records)
    to_f = from_differences(nf)
    problem = oe_problem(trials, nb=nb, nf=nf, nk=nk)
    to_x: Any = np.linalg.inv(to_f[1])
    starts = [to_x @ (f - to_f[0]) for f in search_starts(trials, interval, nb, nf, nk)]
    fit = noise_weighted_fit(problem, starts)
    turn = np.zeros((nf + nb, nf + nb))
    turn[:nf, :nf], turn[nf:, nf:] = to_f[1], np.eye(nb)
    covariance = None if fit.covariance is None else turn @ fit.covariance @ turn.T
    theta = np.concatenate([to_f[0] + to_f[1] @ fit.solution.x, fit.solution.theta])
    count = sum(record.output.size for record in trials)
    model = _model(theta, nf, nk, interval, fit.noise.autocovariance(1)[0], count)
    return _finished(
        "oe",
        trials,
        model,
        covariance,
        fit.noise,
        None,
        weighted=fit.weighted,
        settled=fit.solution.settled,
        quantile=fit.quantile,
    )


def free_run(model: ArxModel, record: SignalRecord) -> tuple[FloatArray, FloatArray]:
    """Simulate a discrete model from rest at the first input, its offset fitted to the output.

    Args:
        model: the discrete model.
        record: a trial with the model's sample time.

    Returns:
        Output, shape ``(n,)``, not finite if the model explodes, and ``[offset]``.
    """
    numerator = [*np.zeros(model.delay), *model.b]
    with np.errstate(over="ignore", invalid="ignore"):
        forced = _lfilter(numerator, [1.0, *model.a], record.input - record.input[0])
        offset = np.mean(record.output - forced)
    return forced + offset, np.array([offset])


def _one_rate(records: Sequence[SignalRecord]) -> tuple[tuple[SignalRecord, ...], float]:
    trials = checked_records(records)
    interval = trials[0].sample_time
    for record in trials[1:]:
        if abs(record.sample_time - interval) > _SAME_RATE * interval:
            raise InputError(
                f"record {record.name} is sampled every {record.sample_time:g} s but "
                f"{trials[0].name} every {interval:g} s; resample, or fit a continuous model"
            )
    return trials, interval


def _model(
    theta: FloatArray, na: int, nk: int, interval: float, variance: float, count: int
) -> ArxModel:
    return ArxModel(
        a=tuple(map(float, theta[:na])),
        b=tuple(map(float, theta[na:])),
        delay=nk,
        sample_time=interval,
        residual_variance=float(variance),
        n=count,
    )


def _finished(
    kind: str,
    trials: Sequence[SignalRecord],
    model: ArxModel,
    covariance: FloatArray | None,
    noise: ArNoise,
    ahead: Sequence[tuple[FloatArray, FloatArray]] | None,
    *,
    weighted: bool = False,
    settled: bool = True,
    quantile: float = 1.96,
) -> DiscreteFit:
    runs = [free_run(model, record) for record in trials]
    free = pooled_fit_percent([(r.output, y) for r, (y, _) in zip(trials, runs, strict=True)])
    one_step = free if ahead is None else pooled_fit_percent(ahead)
    status, sentence = discrete_status(model, covariance, settled, one_step - free)
    units = trials[0].unit_input, trials[0].unit_output
    return DiscreteFit(
        kind=kind,
        model=model,
        covariance=covariance,
        estimates=discrete_estimates(model, covariance, quantile, f"{units[1]}/{units[0]}"),
        trials=tuple(trial_score(r, *run) for r, run in zip(trials, runs, strict=True)),
        fit_percent=free,
        fit_percent_one_step=one_step,
        continuous_poles=tuple(continuous_pole(z, model.sample_time) for z in model.poles),
        noise=noise,
        weighted=weighted,
        status=status,
        sentence=sentence,
        unit_input=units[0],
        unit_output=units[1],
    )
