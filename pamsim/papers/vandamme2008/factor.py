"""Van Damme 2008, sections III.D and III.E: the relative error (6) and the force (7)."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from pamsim.muscles.pleated import pleated_function
from pamsim.muscles.pleated_fit import SLENDERNESS_6
from pamsim.papers.claim import Claim, Verdict, compare, holds
from pamsim.papers.printed_number import printed_values
from pamsim.papers.vandamme2008.numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)
from pamsim.papers.vandamme2008.preisach import output, relay_history, weight_table

FloatArray = NDArray[np.float64]


def claims() -> list[Claim]:
    """Claims D-17 to D-22."""
    return [
        _mapping(),
        _line(),
        _loses_energy(),
        _pressure_independent(),
        _less_pronounced(),
        _good_range(),
    ]


@functools.cache
def path() -> FloatArray:
    """Contractions of the generated record [-]."""
    turns = [0.05, 0.35, 0.05, 0.35, 0.1, 0.3, 0.12, 0.25, 0.07, 0.2, 0.07, 0.2]
    return np.interp(np.linspace(0.0, len(turns) - 1, 300), np.arange(len(turns)), turns)


def scaled(contraction: FloatArray) -> FloatArray:
    """Scaled contraction eps_s of (6) [-]."""
    return 2.0 * contraction / largest() - 1.0


@functools.cache
def history() -> FloatArray:
    """Outputs of the relays along the generated record, from -1 to 1."""
    return relay_history(scaled(path()))


@functools.cache
def _major() -> tuple[FloatArray, FloatArray]:
    """Input and relays of one major loop, both branches."""
    rise = np.linspace(-1.0, 1.0, 121)
    u = np.concatenate([[1.0, -1.1], rise, rise[::-1]])
    return u[2:], relay_history(u)[2:]


def relative_error(values: FloatArray, relays: FloatArray, u: FloatArray) -> FloatArray:
    """Relative error (6) [-].

    Args:
        values: delta, c and d [-].
        relays: from `relay_history`.
        u: scaled contraction along the same path [-].
    """
    weights = weight_table(float(values[1]), float(values[2]))
    u_major, major = _major()
    slope, start = np.polyfit(u_major, output(major, weights), 1)
    return values[0] * (output(relays, weights) - (slope * u + start))


def truth(fibres: int) -> FloatArray:
    """Printed delta, c and d of the muscle with 40 or 25 fibres [-]."""
    return np.array([value(f"delta_{fibres}"), value("weight_c"), value("weight_d")])


def static() -> FloatArray:
    """Force function (2) along the generated record [-], f0 to f4 from the exact shape."""
    law = SLENDERNESS_6
    return np.array(
        [pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4) for eps in path().tolist()]
    )


def force(fibres: int, pressure: float) -> FloatArray:
    """Force (7) along the record [N]."""
    error = relative_error(truth(fibres), history(), scaled(path()))
    return pressure * length() ** 2 * static() * (1.0 + error)


def _mapping() -> Claim:
    ends = scaled(np.array([0.0, largest()]))
    return compare(
        "D-17",
        "(6) maps contractions from 0 to eps_max to -1 and 1",
        (-1.0, 1.0),
        ends.tolist(),
        1e-12,
        unit="1",
        reason="with eps_max = 35 %",
        otherwise=Verdict.INCONSISTENT,
    )


def _line() -> Claim:
    u, major = _major()
    w = output(major, weight_table(value("weight_c"), value("weight_d")))
    slope, start = np.polyfit(u, w, 1)
    return Claim(
        id="D-18",
        what="W_fit is a straight line through both branches of the major loop: slope, intercept",
        printed="drawn in Figure 11, not printed",
        recomputed=(float(slope), float(start)),
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="least squares, samples evenly spaced in the input; the paper does not say how they"
        " were spaced (a sine has most at the ends), and prints no coefficients",
    )


def _loses_energy() -> Claim:
    u, major = _major()
    error = relative_error(truth(40), major, u)
    half = len(u) // 2
    gap = error[half:][::-1] - error[:half]
    return Claim(
        id="D-19",
        what="sign of (7) with delta > 0: force on the way out above that on the way in, relative",
        printed="1 + delta (W - W_fit)",
        recomputed=(float(gap.min()), float(gap.max())),
        unit="1",
        verdict=holds(
            bool(np.min(gap) >= -1e-12) and bool(np.max(gap) > 0.0), Verdict.INCONSISTENT
        ),
        reason="smallest and largest gap between the branches of the major loop, N = 40; W lags the"
        " contraction, so the muscle pulls less while it shortens and the loop loses energy, as"
        " friction must",
    )


def _pressure_independent() -> Claim:
    loops = [force(40, p) / (p * length() ** 2) for p in pressures()]
    spread = max(float(np.max(np.abs(loop / loops[0] - 1.0))) for loop in loops)
    return Claim(
        id="D-20",
        what="the hysteresis of f_t0 is independent of the gauge pressure: spread of the model",
        printed="essentially pressure independent",
        recomputed=spread,
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="(7) has it by construction, so the model proves nothing; the statement is about the"
        " measured curves of Figures 5 and 6, of which no point is printed",
    )


def _width(fibres: int) -> float:
    """Largest gap between the branches of e over the major loop [%]."""
    u, major = _major()
    error = relative_error(truth(fibres), major, u)
    half = len(u) // 2
    return float(np.max(error[half:][::-1] - error[:half])) / PERCENT


def _less_pronounced() -> Claim:
    wide, narrow = _width(40), _width(25)
    return Claim(
        id="D-21",
        what="hysteresis is much less pronounced for 25 fibres than for 40: greatest width of the"
        " loop of the model over the force",
        printed="much less pronounced",
        recomputed=(narrow, wide),
        unit="%",
        verdict=holds(wide > 1.5 * narrow, Verdict.INCONSISTENT),
        reason=f"from the printed deltas, a factor of {wide / narrow:.2f}; above 1.5 counted as"
        " much. The widths of the measured loops are not printed",
    )


def _good_range() -> Claim:
    low, high = (number * PERCENT for number in printed_values("D", "good_range"))
    inside = (path() >= low) & (path() <= high)
    error = relative_error(truth(40), history(), scaled(path()))[inside]
    return Claim(
        id="D-22",
        what="model and measurement agree well for 7 % <= eps <= 20 %",
        printed="good",
        recomputed=None,
        unit="",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="no measured point and no error is printed. In that range the hysteresis changes the"
        f" force of the model by {np.min(error) / PERCENT:+.1f} to"
        f" {np.max(error) / PERCENT:+.1f} %",
    )
