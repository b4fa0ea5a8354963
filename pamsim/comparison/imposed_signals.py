"""Measured signals as inputs of a simulation: smoothed as far as their own noise asks for.

Imposed as they were read, a motion and a pressure would bring their noise along: at 100 Hz, noise
of 0.05 deg is a rate of 5 deg/s whose sign changes at every second sample, and every change moves
friction and hysteresis on.

The smoothing is a cubic regression spline. FITPACK puts knots where the signal bends (Dierckx,
Curve and Surface Fitting with Splines, 1993, chapter 5): few in a hold, many where a valve opens.
How many there are is not tuned. Of the splines on offer the one with the least estimated risk is
taken, Mallows' C_p (Technometrics 15, 1973): squared residual over the noise's variance plus twice
the number of coefficients. That knots are placed where the signal asks for them is not counted: too
little smoothing is noise, which repeats show, too much is an error that they share. The noise is
what the signal itself shows from sample to sample, so that slower drift is imposed as motion.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_lsq_spline, splrep

from pamsim.core.units import FloatArray
from pamsim.recordings.step_metrics import rough_noise

_DEGREE = 3  # of the spline: the least whose rate has no corners

_SHARES = (1.0, 0.85, 0.7, 0.5)
"""Mean squared residuals of the splines on offer, in variances of the noise: from that of the
noise itself down to that of a coefficient for every second sample."""

_UNIFORM = np.sqrt(12.0)  # of a uniform distribution, in its standard deviations


def sample_noise(values: FloatArray) -> float:
    """Standard deviation of a signal's noise from sample to sample, rounding included.

    Args:
        values: (n,) evenly sampled, in any unit.
    """
    # Neighbouring values of a converter are a step apart, those of a finer record are not.
    step = float(np.min(np.diff(np.unique(values)), initial=np.inf))
    return max(rough_noise(values), step / _UNIFORM if np.isfinite(step) else 0.0)


def smoothed(time: FloatArray, values: FloatArray, noise: float | None = None) -> FloatArray:
    """A measured signal without the noise that its samples show.

    Args:
        time: (n,) increasing [s].
        values: (n,) in any unit.
        noise: standard deviation [that unit]; what `sample_noise` finds if left out.

    Returns:
        Shape (n,); the values themselves if they show no noise, or are too few for a spline.
    """
    noise = sample_noise(values) if noise is None else noise
    # Noise below rounding would ask for a knot at every sample.
    if values.size <= 2 * (_DEGREE + 1) or not noise > 1e-12 * float(np.ptp(values)):
        return values
    weight = np.full(values.size, 1.0 / noise)
    best, least = values, 2.0 * values.size  # as read: no residual, a coefficient for each sample
    for share in _SHARES:
        (knots, _, _), *_ = splrep(
            time, values, w=weight, k=_DEGREE, s=share * values.size, full_output=True, quiet=True
        )
        fitted = make_lsq_spline(time, values, knots, _DEGREE)(time)
        coefficients = knots.size - _DEGREE - 1
        risk = float(np.sum((weight * (values - fitted)) ** 2)) + 2.0 * coefficients
        if risk < least:
            best, least = fitted, risk
    return best
