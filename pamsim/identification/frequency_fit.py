"""Continuous models from a measured frequency response, by least squares of the relative error.

Poles and dead time are searched, the numerator is solved for; starts come from the linear problem
in which the error is multiplied by the denominator, solved again with that of the last round
(Sanathanan and Koerner, IEEE Trans. Automatic Control 8, 1963).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous_fit import (
    contains_zero,
    continuous_estimates,
    vague_parameter,
)
from pamsim.identification.continuous_structure import ContinuousStructure
from pamsim.identification.identified_model import NOT_SETTLED, SINGULAR, FitStatus, IdentifiedModel
from pamsim.identification.optimum import Optimum, student_quantile
from pamsim.identification.separable_fit import Separable, linearise, minimise, sandwich_covariance
from pamsim.inference.record_checks import finite_samples
from pamsim.inference.trial_noise import WHITE, fit_trial_noise

ComplexArray = NDArray[np.complex128]

FEWEST_FREQUENCIES = 8
_BEYOND = 10.0  # how far beyond the measured frequencies a pole may lie
_ROUNDS = 6
_FOLLOWED = 2
_APART = 1.0  # rad at the highest frequency, between dead times to start from
_MOST_STARTS = 20
_LEAST_DAMPING = 0.02  # of a start


def fit_frequency_response(
    frequency: ArrayLike, response: ArrayLike, *, real_lags: bool = False, **which: Any
) -> IdentifiedModel:
    """Fit one linear model to a complex frequency response at rising frequencies [rad/s].

    Every frequency has the same weight, by its relative error: the fit is 100 % less its RMS.
    Intervals allow for errors that are correlated from one frequency to the next, as those of a
    structure that is not quite right. Order, zeros and dead time are as in `ContinuousStructure`.
    """
    structure = ContinuousStructure(real_lags=real_lags, **which)
    zeros = structure.zeros
    w, g = _checked(frequency, response)
    unknowns = structure.searched + zeros + 1
    if 2 * w.size < 3 * unknowns:
        raise InputError(
            f"{w.size} frequencies are too few for {unknowns} unknowns; lower the order"
        )
    delays = _dead_times(w, g, zeros) if structure.dead_time else np.zeros(1)
    weight = 1.0 / np.abs(g)
    parts = (np.real, np.imag)

    def columns(x: FloatArray, part: int) -> FloatArray:
        s = 1j * w
        below = np.polyval(structure.denominator(x), s) * np.exp(s * structure.delay(x))
        powers = s[:, np.newaxis] ** np.arange(zeros + 1)
        return parts[part](powers * (weight / below)[:, np.newaxis])

    none = np.zeros((w.size, 0))
    low, high = np.log(1.0 / (_BEYOND * w[-1])), np.log(_BEYOND / w[0])
    # Somewhat wider than what is believed, so that the search does not end on it.
    lower, upper = structure.pole_bounds(low - 1.0, high + 1.0, 1e-4)
    if structure.dead_time:
        lower, upper = [*lower, -0.1 / w[-1]], [*upper, 1.1 * delays[-1]]
    problem = Separable(
        outputs=tuple(part(weight * g) for part in parts),
        shared=columns,
        own=lambda x, part: none,
        lower=np.array(lower),
        upper=np.array(upper),
        sample_times=(1.0, 1.0),  # both parts: from one frequency to the next
    )
    starts = [_start(structure, w, g, float(delay)) for delay in delays]
    found = minimise(problem, starts, refined=_FOLLOWED)
    line = linearise(problem, found.x, found.theta, WHITE)
    noise = fit_trial_noise(line.residuals, problem.sample_times)
    total, free = 2 * w.size, found.coordinates.size
    # The residuals of a fit are smaller than the errors.
    covariance = sandwich_covariance(line, noise.scaled(total / (total - free)))
    quantile = student_quantile(total - free)
    at = Optimum(found.coordinates, covariance, quantile)
    status, sentence = _status(structure, at, found.settled, w)
    error = structure.frequency_response(at.coordinates, w) / g - 1.0
    return IdentifiedModel(
        **vars(at),
        structure=structure,
        estimates=continuous_estimates(structure, at, "-", ("-",), {}),
        trials=(),
        fit_percent=100.0 * (1.0 - float(np.sqrt(np.mean(np.abs(error) ** 2)))),
        noise=noise,
        status=status,
        sentence=sentence,
        evaluations=found.evaluations,
    )


def _checked(frequency: ArrayLike, response: ArrayLike) -> tuple[FloatArray, ComplexArray]:
    w, g = finite_samples(frequency, "frequency"), np.asarray(response, np.complex128)
    if g.shape != w.shape:
        raise InputError(f"{w.size} frequencies, but a response of shape {g.shape}")
    if w.size < FEWEST_FREQUENCIES:
        raise InputError(f"{w.size} frequencies are too few; give {FEWEST_FREQUENCIES} or more")
    if w[0] <= 0.0 or np.any(np.diff(w) <= 0.0):
        raise InputError("frequencies must be above 0 and rise; sort them and drop repeated ones")
    if not np.all(np.isfinite(g)) or np.any(g == 0.0):
        raise InputError("the response is 0 or not finite at some frequency; leave that out")
    return w, g


def _dead_times(w: FloatArray, g: ComplexArray, zeros: int) -> FloatArray:
    """Dead times to start from, close enough together for the highest frequency [s]."""
    phase = np.unwrap(np.angle(g))
    # Each zero may lead by a quarter turn and so hide as much of the delay.
    lag = max(float(phase[0] - phase[-1]), 0.0) + 0.5 * np.pi * (zeros + 1)
    count = min(int(lag / _APART) + 2, _MOST_STARTS)
    return np.linspace(0.0, lag / float(w[-1]), count)


def _start(
    structure: ContinuousStructure, w: FloatArray, g: ComplexArray, delay: float
) -> FloatArray:
    """Coordinates of poles and dead time by the linear problem, unstable poles reflected."""
    scale = float(np.sqrt(w[0] * w[-1]))
    s, target = 1j * w / scale, g * np.exp(1j * w * delay)
    above = s[:, np.newaxis] ** np.arange(structure.zeros + 1)
    below = s[:, np.newaxis] ** np.arange(1, structure.order + 1)
    denominator = np.ones(structure.order)
    last = np.ones_like(s)
    for _ in range(_ROUNDS):
        weight = (1.0 / np.abs(target * last))[:, np.newaxis]
        design = np.hstack([above, -target[:, np.newaxis] * below]) * weight
        wanted = target * weight[:, 0]
        stacked = np.vstack([design.real, design.imag])
        norms = np.linalg.norm(stacked, axis=0)
        solved = np.linalg.lstsq(stacked / norms, np.append(wanted.real, wanted.imag), rcond=None)
        denominator = (solved[0] / norms)[structure.zeros + 1 :]
        last = 1.0 + below @ denominator
    poles = scale * np.roots(np.append(denominator[::-1], 1.0))
    poles = np.concatenate([poles, np.full(structure.order - poles.size, 1e3 * w[-1])])
    coordinates = _coordinates(structure, poles)
    return np.append(coordinates, delay) if structure.dead_time else coordinates


def _coordinates(structure: ContinuousStructure, poles: ComplexArray) -> FloatArray:
    """Logarithms that stand for poles; complex ones become equal lags where lags are real."""
    size = np.maximum(np.abs(poles), 1e-300)
    if not structure.pairs:
        # Apart, since the cost has a saddle where time constants are equal.
        return np.asarray(0.05 * np.arange(size.size) - np.log(np.sort(size)), np.float64)
    upper = poles[poles.imag > 1e-9 * size]
    result: list[float] = []
    for pole in upper:
        damping = max(abs(pole.real) / abs(pole), _LEAST_DAMPING)
        result += [float(np.log(abs(pole))), float(np.log(damping))]
    real = np.sort(size[np.abs(poles.imag) <= 1e-9 * size])
    for one, other in zip(real[0 : len(real) // 2 * 2 : 2], real[1::2], strict=True):
        wn = float(np.sqrt(one * other))
        result += [float(np.log(wn)), float(np.log(0.5 * (one + other) / wn))]
    if len(real) % 2:
        result.append(-float(np.log(real[-1])))
    return np.array(result)


def _status(
    structure: ContinuousStructure, at: Optimum, settled: bool, w: FloatArray
) -> tuple[FitStatus, str]:
    """Whether to trust a fit, and why."""
    if not settled:
        return NOT_SETTLED
    if at.covariance is None:
        return SINGULAR
    sizes = np.abs(structure.poles(at.coordinates))
    outside = [p for p in sizes if not w[0] / _BEYOND < p < w[-1] * _BEYOND]
    if outside:
        return FitStatus.DEGENERATE, (
            f"a pole at {outside[0]:.3g} rad/s lies far outside the measured frequencies"
            f" ({w[0]:.3g} to {w[-1]:.3g} rad/s): lower the order, or measure there"
        )
    if structure.dead_time and structure.delay(at.coordinates) <= 0.0:
        return FitStatus.DEGENERATE, "no dead time is detected: leave it out"
    gain = structure.coefficients().start
    unknown = vague_parameter(structure, at)
    if contains_zero(at, gain):
        unknown = "K", float(at.coordinates[gain]), "-"
    if unknown is not None:
        return FitStatus.DEGENERATE, (
            f"{unknown[0]} = {unknown[1]:.3g} is hardly known: more poles or zeros than the"
            " response shows, lower the order"
        )
    return FitStatus.CONVERGED, "converged inside the bounds"
