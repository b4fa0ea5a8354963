"""Paper D, sections III.D and III.E: the relative error (6), the force (7) and delta."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import stdtrit

from pamsim.muscles.pleated_fit import SLENDERNESS_6
from pamsim.muscles.pleated import pleated_function
from pamsim.store.printed_number import printed_number, printed_values
from pamsim.workflows.replication.claim import Claim, Verdict, compare, holds
from pamsim.workflows.replication.paper_d_numbers import (
    PERCENT,
    largest,
    length,
    pressures,
    value,
)
from pamsim.workflows.replication.paper_d_preisach import output, relay_history, weight_table

FloatArray = NDArray[np.float64]

_SHARE = 0.01
"""Relative deviation that counts as recovered."""
_NOISE = 0.02
"""Of the force, one standard deviation over the force itself."""
_SEEDS = 40
_GENERATED = (
    "a generated record of (7) with two loops from 5 to 35 % and smaller ones inside, in place of"
    " the measured curves, which are not printed"
)


def claims() -> list[Claim]:
    """Claims D-17 to D-26."""
    return [
        _mapping(),
        _line(),
        _loses_energy(),
        _pressure_independent(),
        _measured_delta("D-21", 40),
        _measured_delta("D-22", 25),
        _recovered(),
        _covered(),
        _less_pronounced(),
        _good_range(),
    ]


@functools.cache
def _path() -> FloatArray:
    """Contractions of the generated record [-]."""
    turns = [0.05, 0.35, 0.05, 0.35, 0.1, 0.3, 0.12, 0.25, 0.07, 0.2, 0.07, 0.2]
    return np.interp(np.linspace(0.0, len(turns) - 1, 600), np.arange(len(turns)), turns)


def _scaled(contraction: FloatArray) -> FloatArray:
    """eps_s of (6)."""
    return 2.0 * contraction / largest() - 1.0


@functools.cache
def _history() -> FloatArray:
    return relay_history(_scaled(_path()))


@functools.cache
def _major() -> tuple[FloatArray, FloatArray]:
    """Input and relays of one major loop, both branches."""
    rise = np.linspace(-1.0, 1.0, 201)
    u = np.concatenate([[1.0, -1.1], rise, rise[::-1]])
    return u[2:], relay_history(u)[2:]


def _relative_error(values: FloatArray, history: FloatArray, u: FloatArray) -> FloatArray:
    """e of (6) for (delta, c, d)."""
    weights = weight_table(float(values[1]), float(values[2]))
    u_major, major = _major()
    slope, start = np.polyfit(u_major, output(major, weights), 1)
    return values[0] * (output(history, weights) - (slope * u + start))


def _truth(fibres: int) -> FloatArray:
    return np.array([value(f"delta_{fibres}"), value("weight_c"), value("weight_d")])


def _static() -> FloatArray:
    law = SLENDERNESS_6
    return np.array(
        [
            pleated_function(eps, law.f0, law.f1, law.f2, law.f3, law.f4)
            for eps in _path().tolist()
        ]
    )


def _force(fibres: int, pressure: float) -> FloatArray:
    """Force (7) along the record [N]."""
    error = _relative_error(_truth(fibres), _history(), _scaled(_path()))
    return pressure * length() ** 2 * _static() * (1.0 + error)


def _mapping() -> Claim:
    ends = _scaled(np.array([0.0, largest()]))
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
        what="W_fit is a straight line through both branches of the major loop: slope and intercept",
        printed="drawn in Figure 11, not printed",
        recomputed=(float(slope), float(start)),
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="least squares, samples evenly spaced in the input; the paper does not say how they"
        " were spaced (a sine has most at the ends), and prints no coefficients",
    )


def _loses_energy() -> Claim:
    u, major = _major()
    error = _relative_error(_truth(40), major, u)
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
    loops = [_force(40, p) / (p * length() ** 2) for p in pressures()]
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


def _measured_delta(id: str, fibres: int) -> Claim:
    return Claim(
        id=id,
        what=f"delta of the muscle with {fibres} fibres, by least squares from its measured loop",
        printed=value(f"delta_{fibres}"),
        recomputed=None,
        unit="1",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="neither the measured loop nor f0 to f4 of its fit is printed",
    )


def _fit(measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """delta, c, d from a relative error of the force, and half their 95 % intervals."""
    u = _scaled(_path())

    def miss(values: FloatArray) -> FloatArray:
        return _relative_error(values, _history(), u) - measured

    solved = least_squares(miss, [0.2, -0.3, -0.7], bounds=([0.0, -1.0, -1.9], [1.0, 0.5, 0.0]))
    freedom = measured.size - 3
    covariance = np.linalg.inv(solved.jac.T @ solved.jac) * (2.0 * solved.cost / freedom)
    return solved.x, stdtrit(freedom, 0.975) * np.sqrt(np.diag(covariance))


def _recovered() -> Claim:
    told: list[float] = []
    found: list[float] = []
    for fibres in (40, 25):
        scaled = _force(fibres, pressures()[1]) / (pressures()[1] * length() ** 2)
        told += _truth(fibres).tolist()
        found += _fit(scaled / _static() - 1.0)[0].tolist()
    return compare(
        "D-23",
        "least squares determines the model from a loop: delta, c, d of N = 40, then of N = 25",
        told,
        found,
        [_SHARE * abs(number) for number in told],
        unit="1",
        reason=f"{_GENERATED}; no noise, 1.5 bar, same grid of relays. The paper fits delta alone"
        " and takes c and d from elsewhere",
    )


def _covered() -> Claim:
    clean = _force(40, pressures()[1]) / (pressures()[1] * length() ** 2) / _static()
    truth, inside = _truth(40), np.zeros(3)
    half = np.zeros(3)
    for seed in range(_SEEDS):
        noise = np.random.default_rng(seed).standard_normal(clean.size)
        values, width = _fit(clean * (1.0 + _NOISE * noise) - 1.0)
        inside += np.abs(values - truth) <= width
        half += width / _SEEDS
    shares = inside / _SEEDS
    return Claim(
        id="D-24",
        what="95 % intervals of delta, c and d hold the planted numbers at 2 % noise; share of"
        f" {_SEEDS} records",
        printed=value("delta_40"),
        recomputed=tuple(shares.tolist()),
        unit="1",
        verdict=holds(bool(np.all(shares >= 0.85)), Verdict.NOT_REPRODUCIBLE),
        reason=f"{_GENERATED}; at least 85 % counted. Half intervals on average"
        f" {half[0]:.4f}, {half[1]:.4f}, {half[2]:.4f}: the three printed digits of delta need"
        f" {printed_number('D', 'delta_40').half_unit:g}, which one such record does not give",
        tolerance=0.10,
    )


def _width(fibres: int) -> float:
    """Largest gap between the branches of e over the major loop [%]."""
    u, major = _major()
    error = _relative_error(_truth(fibres), major, u)
    half = len(u) // 2
    return float(np.max(error[half:][::-1] - error[:half])) / PERCENT


def _less_pronounced() -> Claim:
    wide, narrow = _width(40), _width(25)
    return Claim(
        id="D-25",
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
    inside = (_path() >= low) & (_path() <= high)
    error = _relative_error(_truth(40), _history(), _scaled(_path()))[inside]
    return Claim(
        id="D-26",
        what="model and measurement agree well for 7 % <= eps <= 20 %",
        printed="good",
        recomputed=None,
        unit="",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="no measured point and no error is printed. In that range the hysteresis changes the"
        f" force of the model by {np.min(error) / PERCENT:+.1f} to"
        f" {np.max(error) / PERCENT:+.1f} %",
    )
