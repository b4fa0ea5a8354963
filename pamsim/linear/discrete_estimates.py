"""Intervals of a discrete model's coefficients, gain and time constants; whether to trust it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamsim.linear.arx import ArxModel
from pamsim.linear.estimate import Estimate
from pamsim.linear.step_fit import FitStatus

FloatArray = NDArray[np.float64]

_LOST = 5.0  # points of fit percent from prediction to free run


def discrete_estimates(
    model: ArxModel, covariance: FloatArray | None, quantile: float, unit_gain: str
) -> tuple[Estimate, ...]:
    """Return K, the time constants if all poles are those of lags, a1..., b1... with intervals.

    Args:
        model: the discrete model.
        covariance: of (a1..., b1...), shape ``(k, k)``, or None.
        quantile: half width of an interval in standard errors.
        unit_gain: output unit per input unit.

    Returns:
        The estimates. Intervals of time constants are symmetric in the logarithm.
    """
    na, nb = len(model.a), len(model.b)

    def half(gradient: FloatArray) -> float | None:
        if covariance is None:
            return None
        return quantile * float(np.sqrt(max(float(gradient @ covariance @ gradient), 0.0)))

    def plain(name: str, unit: str, value: float, gradient: FloatArray) -> Estimate:
        width = half(gradient)
        sides = None if width is None else (value - width, value + width)
        return Estimate(name, unit, value, sides)

    dc = 1.0 + sum(model.a)
    gain = model.static_gain
    if not np.isfinite(gain):
        result = [Estimate("K", unit_gain, gain, None)]
    else:
        gradient = np.concatenate([np.full(na, -gain / dc), np.full(nb, 1.0 / dc)])
        result = [plain("K", unit_gain, gain, gradient)]
    lags = all(z.imag == 0.0 and 0.0 < z.real < 1.0 for z in model.poles)
    if lags and len(set(model.poles)) == na:
        rising = sorted(z.real for z in model.poles)
        for k, z in enumerate(rising):
            constant = -model.sample_time / float(np.log(z))
            # d ln T / dz = -1 / (z ln z), and F(z, a) = 0 gives dz/da.
            slope = np.polyval(np.polyder(np.array([1.0, *model.a])), z)
            to_pole = -(z ** np.arange(na - 1, -1, -1)) / slope
            gradient = np.concatenate([-to_pole / (z * np.log(z)), np.zeros(nb)])
            width = half(gradient)
            sides = None
            if width is not None:
                with np.errstate(over="ignore"):
                    factor = float(np.exp(width))
                sides = (constant / factor, constant * factor)
            result.append(Estimate(f"T{k + 1}" if na > 1 else "T", "s", constant, sides))
    unit = np.eye(na + nb)
    result += [plain(f"a{i + 1}", "-", v, unit[i]) for i, v in enumerate(model.a)]
    result += [plain(f"b{i + 1}", unit_gain, v, unit[na + i]) for i, v in enumerate(model.b)]
    return tuple(result)


def continuous_pole(pole: complex, sample_time: float) -> complex | None:
    """Return ``log(z) / Ts``, or None where no continuous pole is sampled to z [rad/s].

    Args:
        pole: discrete pole z [-].
        sample_time: Ts [s].
    """
    if pole.imag == 0.0 and pole.real <= 0.0:
        return None
    return complex(np.log(complex(pole)) / sample_time)


def discrete_status(
    model: ArxModel, covariance: FloatArray | None, settled: bool, lost: float
) -> tuple[FitStatus, str]:
    """Return whether to trust a discrete fit, and why.

    Args:
        model: the discrete model.
        covariance: of its coefficients, or None.
        settled: whether the search converged.
        lost: fit of the one-step prediction minus fit of the free run [%].
    """
    if not settled:
        return FitStatus.NOT_CONVERGED, "the solver ran out of evaluations before it settled"
    if any(abs(z) >= 1.0 for z in model.poles):
        return FitStatus.DEGENERATE, (
            "a pole lies on or outside the unit circle: the free run does not settle"
        )
    if covariance is None:
        return FitStatus.DEGENERATE, "the Jacobian is singular: coefficients cannot be told apart"
    lonely = [z for z in model.poles if continuous_pole(z, model.sample_time) is None]
    notes: list[str] = []
    if lost > _LOST:
        notes.append(
            f"the free run fits {lost:.0f} points worse than the one-step prediction: the noise is "
            "not that of ARX and biases the poles, prefer output error"
        )
    if lonely:
        notes.append("a pole <= 0 has no continuous equivalent (often noise, or too high an order)")
    return FitStatus.CONVERGED, "; ".join(["converged", *notes])
