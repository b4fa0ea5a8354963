"""A small law of the printed end positions: which difference of pressures holds which angle.

p1 - p2 = k1 b + k5 b^5 - t m [+ c (p1 + p2) b] [+ o], pressures in 100 kPa, b in rad, m in kg. The
first three terms are odd and do not know the sum of pressures; c asks whether co-contraction
stiffens the joint, o whether the two directions differ. Angles are fitted, not pressures.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pamsim.core.encoding import NOT_IN_JSON, json_key
from pamsim.core.units import DEG_PER_RAD, PA_PER_BAR, FloatArray
from pamsim.papers.numerics import least_squares, rms, root
from pamsim.recordings.printed import PrintedStep, distinct_steps

EXTRA_TERMS = ((), ("c",), ("o",))
"""Terms beside k1, k5 and t of each law that is compared with a model of the muscles."""

_START = {"k1": 3.0, "k5": 25.0, "t": 0.0, "c": 0.0, "o": 0.0}


@dataclass(frozen=True, kw_only=True)
class TorqueLaw:
    """A fitted law.

    Its coefficients are in 100 kPa per the power of rad or kg, beside half their linearised 95 %
    intervals. RMS errors are those of the fitted angles, of each angle predicted from all rest
    (left out), and of the small steps by the law of the other rows: NaN if these do not determine
    a law in which the angle rises with the pressure difference.
    """

    coefficients: dict[str, float]
    half_interval: dict[str, float] = field(metadata=NOT_IN_JSON)
    rms_deg: float
    left_out_rms_deg: float = field(metadata=json_key("leave_one_out_rms_deg"))
    small_steps_rms_deg: float


@functools.cache
def printed_rows_law(*extra: str) -> TorqueLaw:
    """The law of the 21 distinct printed rows.

    What it leaves at rows held out in turn is taken as the scatter of the printed rows: three
    coefficients without a muscle behind them describe the rows to that.
    """
    return fit_torque_law(distinct_steps(), extra)


def torque_laws() -> tuple[TorqueLaw, ...]:
    """Every law of `EXTRA_TERMS`, of the 21 distinct printed rows."""
    return tuple(printed_rows_law(*extra) for extra in EXTRA_TERMS)


def best_torque_laws() -> dict[str, float]:
    """What a model of the muscles must reach: the least held-out errors of `torque_laws`.

    Each may be that of another law.
    """
    laws = torque_laws()
    small = [law.small_steps_rms_deg for law in laws if math.isfinite(law.small_steps_rms_deg)]
    least = min(law.left_out_rms_deg for law in laws)
    return {"leave_one_out_rms_deg": least, "small_steps_rms_deg": min(small)}


def fit_torque_law(steps: Sequence[PrintedStep], extra: tuple[str, ...] = ()) -> TorqueLaw:
    """Least squares of the angles of some rows; the extra terms are ``c`` and ``o``."""
    names = ("k1", "k5", "t", *extra)

    def named(values: Iterable[float]) -> dict[str, float]:
        return dict.fromkeys(_START, 0.0) | dict(zip(names, map(float, values), strict=True))

    def misfit(rows: Sequence[PrintedStep], *values: float) -> FloatArray:
        law = named(values)
        return np.array([(_angle(row, law) - row.angle) * DEG_PER_RAD for row in rows])

    def fit(rows: Sequence[PrintedStep], start: FloatArray) -> tuple[FloatArray, FloatArray]:
        zeros = np.zeros(len(rows))
        return least_squares(lambda *v: misfit(rows, *v), zeros, start, x_scale="jac")

    def left_out(*unseen: PrintedStep) -> FloatArray:
        """Errors at rows by the law of the others [deg]; NaN where that law does not rise."""
        law, _ = fit([row for row in steps if row not in unseen], values)
        if any(_linear(row, named(law)) <= 0.0 for row in steps):
            return np.full(len(unseen), math.nan)
        return misfit(unseen, *law)

    values, half = fit(steps, np.array([_START[name] for name in names]))
    small = [step for step in steps if step.size == "small"]
    return TorqueLaw(
        coefficients=dict(zip(names, map(float, values), strict=True)),
        half_interval=dict(zip(names, map(float, half), strict=True)),
        rms_deg=rms(misfit(steps, *values)),
        left_out_rms_deg=rms([left_out(step)[0] for step in steps]),
        small_steps_rms_deg=rms(left_out(*small)),
    )


def _linear(step: PrintedStep, law: Mapping[str, float]) -> float:
    """Slope of the pressure difference at zero angle [100 kPa/rad]."""
    return law["k1"] + law["c"] * sum(step.pressure) / PA_PER_BAR


def _angle(step: PrintedStep, law: Mapping[str, float]) -> float:
    """Angle that the law gives a row [rad]."""
    first, second = (pressure / PA_PER_BAR for pressure in step.pressure)
    push, linear = first - second + law["t"] * step.load - law["o"], _linear(step, law)
    # One root wherever the law rises; others only while a fit searches.
    return root(lambda b: linear * b + law["k5"] * b**5 - push, -3.0, 3.0, 1e-11)
