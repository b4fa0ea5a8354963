"""A small law of the printed end positions: which difference of pressures holds which angle.

p1 - p2 = k1 b + k5 b^5 - t m [+ c (p1 + p2) b] [+ o], pressures in 100 kPa, b in rad, m in kg. The
first three terms are odd and do not know the sum of pressures; c asks whether co-contraction
stiffens the joint, o whether the two directions differ. Angles are fitted, not pressures.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR
from pamsim.papers.numerics import curve_fit, root
from pamsim.store.printed import PrintedStep, distinct_steps

FloatArray = NDArray[np.float64]

_NAMES = ("k1", "k5", "t", "c", "o")
_START = {"k1": 3.0, "k5": 25.0, "t": 0.0, "c": 0.0, "o": 0.0}


@dataclass(frozen=True, kw_only=True)
class TorqueLaw:
    """Fitted law.

    Attributes:
        coefficients: name -> value, 100 kPa per the power of rad or kg.
        half_interval: name -> half the linearised 95 % interval.
        rms_deg: of the fitted angles [deg].
        left_out_rms_deg: of each angle predicted from all rest [deg].
        residual_deg: row number -> fitted minus measured angle [deg].
    """

    coefficients: dict[str, float]
    half_interval: dict[str, float]
    rms_deg: float
    left_out_rms_deg: float
    residual_deg: dict[int, float]


@functools.cache
def printed_rows_law(*extra: str) -> TorqueLaw:
    """The law of the 21 distinct printed rows.

    What it leaves at rows held out in turn is taken as the scatter of the printed rows: three
    coefficients without a muscle behind them describe the rows to that.

    Args:
        extra: as for `fit_torque_law`.
    """
    return fit_torque_law(distinct_steps(), extra)


def fit_torque_law(steps: tuple[PrintedStep, ...], extra: tuple[str, ...] = ()) -> TorqueLaw:
    """Least squares of the angles.

    Args:
        steps: printed rows.
        extra: terms beside k1, k5 and t: ``c``, ``o``.

    Returns:
        The law.
    """
    names = ("k1", "k5", "t", *extra)
    start = np.array([_START[name] for name in names])
    values, covariance = _fit(steps, names, start)
    residual = _misfit(steps, names, values)
    half = float(stdtrit(len(steps) - len(names), 0.975)) * np.sqrt(np.diag(covariance))
    left_out = [_left_out(steps, index, names, values) for index in range(len(steps))]
    return TorqueLaw(
        coefficients=dict(zip(names, map(float, values), strict=True)),
        half_interval=dict(zip(names, map(float, half), strict=True)),
        rms_deg=float(np.sqrt(np.mean(residual**2))),
        left_out_rms_deg=float(np.sqrt(np.mean(np.square(left_out)))),
        residual_deg={step.row: float(r) for step, r in zip(steps, residual, strict=True)},
    )


def _fit(
    steps: tuple[PrintedStep, ...], names: tuple[str, ...], start: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients and their covariance."""
    return curve_fit(
        lambda _, *values: _misfit(steps, names, np.array(values)),
        None,
        np.zeros(len(steps)),
        start,
        method="trf",
        x_scale="jac",
    )


def _left_out(
    steps: tuple[PrintedStep, ...], index: int, names: tuple[str, ...], start: FloatArray
) -> float:
    rest = steps[:index] + steps[index + 1 :]
    return float(_misfit(steps[index : index + 1], names, _fit(rest, names, start)[0])[0])


def _misfit(
    steps: tuple[PrintedStep, ...], names: tuple[str, ...], values: FloatArray
) -> FloatArray:
    law = dict.fromkeys(_NAMES, 0.0) | dict(zip(names, map(float, values), strict=True))
    return np.array([(_angle(step, law) - step.angle) * DEG_PER_RAD for step in steps])


def _angle(step: PrintedStep, law: dict[str, float]) -> float:
    first, second = (pressure / PA_PER_BAR for pressure in step.pressure)
    linear = law["k1"] + law["c"] * (first + second)
    push = first - second + law["t"] * step.load - law["o"]
    # Odd and, for all values the fit passes, rising: one root.
    return root(lambda b: linear * b + law["k5"] * b**5 - push, -3.0, 3.0, 1e-11)
