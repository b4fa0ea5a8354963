"""Continuous-time fit of G1 or G2 to a normalised step response by output (simulation) error."""

# scipy carries no types: what it returns is Any at this file's boundary.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.special
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.bounded_least_squares import Fit, bounded_least_squares, one_by_one
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.record_checks import increasing_time, varying_output
from pamsim.inference.trial_noise import TrialNoise
from pamsim.linear.continuous_estimates import continuous_estimates, merged_lags
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.first_second_order import unit_step
from pamsim.linear.identified_model import FitStatus, IdentifiedModel, trial_score
from pamsim.linear.optimum import Optimum
from pamsim.linear.separable_fit import inverse_information

_student_quantile: Any = scipy.special.stdtrit

# Splits of the 63 % time into (T1, T2): G2 has a mirror-symmetric cost with a saddle at T1 = T2,
# so starts lie on one side of it, from well separated to nearly merged.
_STARTS: dict[int, tuple[tuple[float, ...], ...]] = {
    1: ((0.5,), (1.0,), (2.0,)),
    2: ((0.02, 1.0), (0.15, 0.85), (0.4, 0.6)),
}
_SINGULAR = 1e-6  # smallest over largest singular value of the column-scaled Jacobian
_ROUNDING = 1e-20  # variance of a residual that is rounding alone, of a response of size 1


def fit_step(time: ArrayLike, response: ArrayLike, *, order: int) -> IdentifiedModel:
    """Fit G1 or G2 of gain 1 to a normalised step response, least squares of the simulated output.

    The step happens at ``time[0]``, from rest at 0. Time constants are sought as logarithms between
    a tenth of a sample and a hundred record lengths, from several fixed starts. A response with a
    gain, a dead time or an offset is a record: `pamsim.linear.continuous_fit.fit_continuous`.

    The 95 % intervals come from the Jacobian at the optimum and Student's t. They assume white
    residuals and the right model order. Residuals of a wrong order or of a sampled mechanism are
    strongly correlated (see ``residual_lag1`` of the trial), and then the intervals are far too
    narrow. They are None where the data do not determine the parameter.

    Args:
        time: increasing sample times, not necessarily uniform, shape ``(n,)`` [s].
        response: output over its final value, shape ``(n,)`` [-].
        order: 1 for G1, 2 for G2.

    Returns:
        The model with its status; do not quote the numbers unless that is ``converged``.

    Raises:
        InputError: bad order; short, constant, non-finite or unordered record; a response that ends
            where it began.

    Source: model of Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24); the paper itself
    names only ARX least squares, (25)-(29).
    """
    if order not in _STARTS:
        raise InputError(f"order = {order!r} is not known; give 1 for G1 or 2 for G2")
    t, y = increasing_time(time, response, minimum=8)
    varying_output(y)
    t = t - t[0]
    reached = np.flatnonzero(np.abs(y) >= 0.632 * abs(final_value(y)))
    reference = max(float(t[reached[0]]), float(t[1]))
    interval = float(np.median(np.diff(t)))
    low, high = np.log(interval / 10.0), np.log(100.0 * float(t[-1]))
    found = bounded_least_squares(
        one_by_one(lambda x: unit_step(t, tuple(np.exp(x).tolist())) - y),
        [np.log(np.array(split) * reference) for split in _STARTS[order]],
        lower=np.full(order, low),
        upper=np.full(order, high),
        jacobian="3-point",
        x_scale=1.0,
        tolerance=1e-12,
        gradient_tolerance=1e-12,
        max_steps=200,
    )
    variance = found.cost / (t.size - order)
    inverse = inverse_information(found.jacobian, _SINGULAR)
    covariance = None if inverse is None else np.pad(variance * inverse, (0, 1))  # the gain is held
    structure = ContinuousStructure(order)
    quantile = float(_student_quantile(t.size - order, 0.975))
    at = Optimum(np.append(found.x, 1.0), covariance, quantile)
    status, sentence = _status(structure, at, found, (low, high), interval)
    if status not in (FitStatus.CONVERGED, FitStatus.DEGENERATE):
        at = replace(at, covariance=None)
    score = trial_score("step", y, y + found.residual)
    # Of a perfect match only rounding remains, whose correlation means nothing.
    if status is FitStatus.CONVERGED and score.residual_lag1 > 0.5 and variance > _ROUNDING:
        sentence += (
            f"; residuals are correlated (lag 1: {score.residual_lag1:.2f}), the intervals are too"
            " narrow"
        )
    gain, *lags = continuous_estimates(structure, at, "-", ("-",), {})
    return IdentifiedModel(
        structure=structure,
        coordinates=at.coordinates,
        covariance=at.covariance,
        quantile=at.quantile,
        estimates=(replace(gain, interval95=None), *lags),
        trials=(score,),
        fit_percent=score.fit_percent,
        noise=TrialNoise((ArNoise((), variance),)),
        status=status,
        sentence=sentence,
        evaluations=found.evaluations,
    )


def _status(
    structure: ContinuousStructure,
    at: Optimum,
    found: Fit,
    bounds: tuple[float, float],
    interval: float,
) -> tuple[FitStatus, str]:
    shortest, longest = np.min(found.x), np.max(found.x)
    if not found.converged:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it converged"
    # The cost is flat towards a vanishing lag, so the solver may stop short of the bound itself.
    if shortest < bounds[0] + np.log(2.0) or longest > bounds[1] - np.log(2.0):
        return FitStatus.AT_BOUND, (
            "a parameter is at its bound: the record shows no such lag, or is too short for it"
        )
    if np.exp(shortest) < interval:
        return FitStatus.DEGENERATE, (
            f"time constant {np.exp(shortest):.3g} s is shorter than one sample ({interval:.3g} s):"
            " the record does not resolve it"
        )
    if at.covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: parameters are not identifiable"
    if merged_lags(structure, at) is not None:
        return FitStatus.DEGENERATE, (
            "T1 and T2 merge within their uncertainty: the record shows a double lag or an "
            "oscillation, and does not determine two separate real lags"
        )
    return FitStatus.CONVERGED, "converged inside the bounds"


def final_value(response: FloatArray) -> float:
    """Return the mean of the last 2 % of the samples (at least one).

    Args:
        response: samples, shape ``(n,)`` [output unit].

    Returns:
        The final value [output unit].

    Raises:
        InputError: the final value is zero against the record's largest excursion.
    """
    count = max(1, response.size // 50)
    final = float(np.mean(response[-count:]))
    if abs(final) < 1e-3 * float(np.max(np.abs(response))):
        raise InputError(
            f"response ends where it began (final value {final:g}, mean of the last {count} "
            "samples): G1 and G2 describe a lasting step; cut the record before the return"
        )
    return final
