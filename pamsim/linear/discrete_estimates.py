"""Intervals of a discrete model's coefficients, gain and time constants; whether to trust it."""

from __future__ import annotations

import numpy as np

from pamsim.inference.estimate import Estimate
from pamsim.linear.discrete_structure import DiscreteStructure
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.optimum import Optimum

_LOST = 5.0  # points of fit percent from prediction to free run


def discrete_estimates(
    structure: DiscreteStructure, at: Optimum, unit_gain: str
) -> tuple[Estimate, ...]:
    """Return K, the time constants if all poles are those of lags, a1..., b1... with intervals.

    Args:
        structure: what was fitted.
        at: the optimum.
        unit_gain: output unit per input unit.

    Returns:
        The estimates. Intervals of time constants are symmetric in the logarithm.
    """
    na, nb = structure.na, structure.nb
    a, b = np.split(at.coordinates, [na])
    static = 1.0 + float(np.sum(a))
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = float(np.divide(np.sum(b), static))
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


def discrete_status(
    structure: DiscreteStructure, at: Optimum, settled: bool, lost: float
) -> tuple[FitStatus, str]:
    """Return whether to trust a discrete fit, and why.

    Args:
        structure: what was fitted.
        at: the optimum.
        settled: whether the search converged.
        lost: fit of the one-step prediction minus fit of the free run [%].
    """
    if not settled:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it converged"
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
