"""ARX and output-error models of any orders from general inputs, several trials at once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import scipy.signal

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.arx import UnderdeterminedError
from pamsim.identification.discrete_structure import (
    DiscreteStructure,
    centred_regression,
    from_differences,
)
from pamsim.identification.identified_model import (
    NOT_SETTLED,
    FitStatus,
    IdentifiedModel,
    pooled_fit_percent,
    score_trials,
)
from pamsim.identification.noise_weighted_fit import noise_weighted_fit
from pamsim.identification.optimum import Optimum, student_quantile
from pamsim.identification.separable_fit import column_scale
from pamsim.identification.signal_record import SignalRecord, checked_records, time_range
from pamsim.inference.estimate import Estimate
from pamsim.inference.trial_noise import TrialNoise, fit_trial_noise

_lfilter: Any = scipy.signal.lfilter

_SAME_RATE = 1e-3
_ROUNDS = 8
_LAGS = 5
_LOST = 5.0  # points of fit percent from prediction to free run


def fit_arx_records(
    records: Sequence[SignalRecord], *, na: int, nb: int, nk: int
) -> IdentifiedModel:
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

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equations (25)-(29).
    """
    trials, interval = _one_rate(records)
    structure = DiscreteStructure("arx", na, nb, nk, interval)
    pairs = [(record.output, record.input) for record in trials]
    theta, covariance, residuals = _stacked_least_squares(pairs, na, nb, nk)
    freedom = sum(r.size for r in residuals) - theta.size - len(trials)
    variance = sum(float(r @ r) for r in residuals) / freedom
    at = Optimum(theta, variance * covariance, student_quantile(freedom))
    ahead = [
        (r.output[r.output.size - e.size :], r.output[r.output.size - e.size :] - e)
        for r, e in zip(trials, residuals, strict=True)
    ]
    noise = fit_trial_noise(residuals, [interval] * len(trials))
    return _identified(structure, at, trials, noise, one_step=pooled_fit_percent(ahead))


def fit_oe(records: Sequence[SignalRecord], *, nb: int, nf: int, nk: int) -> IdentifiedModel:
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
    structure = DiscreteStructure("oe", nf, nb, nk, interval)
    constant, matrix = from_differences(nf)
    to_x: Any = np.linalg.inv(matrix)
    starts = [to_x @ (f - constant) for f in _search_starts(trials, interval, nb, nf, nk)]
    fit = noise_weighted_fit(structure.problem(trials), starts)
    transform = np.eye(nf + nb)
    transform[:nf, :nf] = matrix
    at = Optimum(
        np.concatenate([constant + matrix @ fit.solution.x, fit.solution.theta]),
        None if fit.covariance is None else transform @ fit.covariance @ transform.T,
        fit.quantile,
    )
    search = {"settled": fit.solution.settled, "evaluations": fit.solution.evaluations}
    return _identified(structure, at, trials, fit.noise, weighted=fit.weighted, **search)


def _identified(
    structure: DiscreteStructure,
    at: Optimum,
    trials: Sequence[SignalRecord],
    noise: TrialNoise,
    *,
    one_step: float | None = None,
    settled: bool = True,
    **facts: Any,
) -> IdentifiedModel:
    scores = score_trials(structure, at.coordinates, trials)
    lost = 0.0 if one_step is None else one_step - scores["fit_percent"]
    status, sentence = _status(structure, at, settled, lost)
    unit_gain = f"{trials[0].unit_output}/{trials[0].units_input[0]}"
    return IdentifiedModel(
        **vars(at),
        **scores,
        **facts,
        structure=structure,
        estimates=discrete_estimates(structure, at, unit_gain),
        fit_percent_one_step=one_step,
        noise=noise,
        status=status,
        sentence=sentence,
    )


def discrete_estimates(
    structure: DiscreteStructure, at: Optimum, unit_gain: str
) -> tuple[Estimate, ...]:
    """Return K, the time constants if all poles are those of lags, a1..., b1... with intervals.

    Intervals of time constants are symmetric in the logarithm.
    """
    na, nb = structure.na, structure.nb
    a, b = np.split(at.coordinates, [na])
    static, gain = 1.0 + float(np.sum(a)), structure.static_gain(at.coordinates)
    if np.isfinite(gain):
        gradient = np.concatenate([np.full(na, -gain / static), np.full(nb, 1.0 / static)])
        result = [at.estimate("K", unit_gain, gain, gradient)]
    else:
        result = [Estimate(name="K", unit=unit_gain, value=gain, interval95=None)]
    poles = structure.poles(at.coordinates)
    lags = all(z.imag == 0.0 and 0.0 < z.real < 1.0 for z in poles)
    if lags and len(set(poles)) == na:
        for k, z in enumerate(sorted(z.real for z in poles)):
            # d ln T / dz = -1 / (z ln z), and A(z) = 0 gives dz/da.
            slope = np.polyval(np.polyder(structure.denominator(at.coordinates)), z)
            to_pole = -(z ** np.arange(na - 1, -1, -1)) / slope
            gradient = np.concatenate([-to_pole / (z * np.log(z)), np.zeros(nb)])
            constant = -structure.sample_time / float(np.log(z))
            name = f"T{k + 1}" if na > 1 else "T"
            result.append(at.estimate(name, "s", constant, gradient, positive=True))
    result += [at.estimate(f"a{i + 1}", "-", float(a[i]), at.unit(i)) for i in range(na)]
    result += [at.estimate(f"b{i + 1}", unit_gain, float(b[i]), at.unit(na + i)) for i in range(nb)]
    return tuple(result)


def _status(
    structure: DiscreteStructure, at: Optimum, settled: bool, lost: float
) -> tuple[FitStatus, str]:
    """Whether to trust a fit whose free run fits ``lost`` points worse than its prediction."""
    if not settled:
        return NOT_SETTLED
    if any(abs(z) >= 1.0 for z in structure.poles(at.coordinates)):
        return FitStatus.DEGENERATE, (
            "a pole lies on or outside the unit circle: the free run does not settle"
        )
    if at.covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: coefficients are not identifiable"
    notes: list[str] = []
    if lost > _LOST:
        notes.append(
            f"the free run fits {lost:.0f} points worse than the one-step prediction: the noise is "
            "not that of ARX and biases the poles, prefer output error"
        )
    if None in structure.continuous_poles(at.coordinates):
        notes.append("a pole <= 0 has no continuous equivalent (often noise, or too high an order)")
    return FitStatus.CONVERGED, "; ".join(["converged", *notes])


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


def _stacked_least_squares(
    pairs: Sequence[tuple[FloatArray, FloatArray]], na: int, nb: int, nk: int
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Return theta, ``(phi^T phi)^-1`` and residuals; each trial's mean absorbs its offset."""
    blocks = [centred_regression(y, u, na=na, nb=nb, delay=nk) for y, u in pairs]
    design = np.concatenate([phi for phi, _ in blocks])
    target = np.concatenate([y for _, y in blocks])
    scale = column_scale(design)
    orthogonal, triangle = np.linalg.qr(design / scale)
    left, sizes, vt = np.linalg.svd(triangle)
    if sizes[-1] <= design.shape[0] * np.finfo(float).eps * sizes[0]:
        raise UnderdeterminedError(
            f"records do not determine ARX na={na}, nb={nb}: directions are not excited; give an "
            "input that changes more often, or lower the order"
        )
    half = vt.T / sizes / scale[:, np.newaxis]
    theta = half @ (left.T @ (orthogonal.T @ target))
    return theta, half @ half.T, [y - phi @ theta for phi, y in blocks]


def _search_starts(
    trials: Sequence[SignalRecord], interval: float, nb: int, nf: int, nk: int
) -> list[FloatArray]:
    """Return F's coefficients f1..fnf from which the search starts."""
    starts: list[FloatArray] = []
    raw = [(r.output - r.output[0], r.input - r.input[0]) for r in trials]
    pairs = raw
    for _ in range(_ROUNDS):
        try:
            f = _stable(_stacked_least_squares(pairs, nf, nb, nk)[0][:nf])
        except InputError:
            break
        starts.append(f)
        pairs = [
            tuple(_lfilter([1.0], np.append(1.0, f), signal) for signal in pair) for pair in raw
        ]
    _, longest = time_range(trials)
    lags = np.geomspace(3.0 * interval, max(0.3 * longest, 30.0 * interval), max(_LAGS, nf + 1))
    for constants in combinations(lags, nf):
        grid: Any = np.poly(np.exp(-interval / np.array(constants)))
        starts.append(grid[1:])
    return starts


def _stable(f: FloatArray) -> FloatArray:
    """Mirror poles on or outside the unit circle to its inside."""
    poles = np.roots(np.append(1.0, f))
    size = np.abs(poles)
    mirrored: Any = np.poly(np.where(size < 1.0, poles, 0.999 * poles / size**2))
    return np.real(mirrored)[1:]
