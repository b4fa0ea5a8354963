"""Statements on stiffness: equation (5), the sum of pressures, symmetry."""

from __future__ import annotations

import functools
import math

from pamsim.actuator.antagonist import (
    Stiffness,
    antagonist_torque,
    joint_stiffness,
    pressure_slope,
)
from pamsim.actuator.kernel import Row, gauge_pressure, muscle_length
from pamsim.actuator.layout import slot
from pamsim.actuator.rest_state import charged_air_state
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.muscles.braid import volume_slope
from pamsim.muscles.mckibben import ideal_force
from pamsim.papers.antagonistic_pair import (
    ideal_muscle,
    rest_angle,
    row,
    sprocket_radius,
)
from pamsim.papers.claim import Recomputed, Verdict, recomputes
from pamsim.papers.numerics import derivative
from pamsim.papers.torque_law import TorqueLaw, fit_torque_law
from pamsim.store.printed import PrintedStep, distinct_steps

_FULL = 487.0 * PA_PER_KPA  # Table 1, row 1
_AGREEMENT = 1e-6  # relative, of a closed form with finite differences


def ideal_stiffness(par: Row, tendon_length: float, pressure: float) -> Stiffness:
    """Stiffness of one shut muscle if its force were F = -p dV/dl (Matiskova 2021, equation (5)).

    Args:
        par: parameter row of a muscle with the ideal law, so that its volume is the braid's.
        tendon_length: [m].
        pressure: gauge [Pa].

    Returns:
        -dP/dV (dV/dl)^2 and -p d2V/dl2 [N/m].
    """
    length = muscle_length(par, tendon_length)
    braid = [par[slot(f"braid.{name}")] for name in ("nominal_length", "diameter", "fibre_angle")]
    per_pressure = -volume_slope(length, *braid)
    return Stiffness(
        compressibility=per_pressure * pressure_slope(par, tendon_length, pressure),
        geometric=derivative(lambda at: ideal_force(pressure, at, *braid), length),
    )


def _parts(pressure: float) -> Stiffness:
    """Parts of (5) at the reference point with both muscles at one pressure [N m/rad]."""
    muscle = row(ideal_muscle())
    each = ideal_stiffness(muscle, 0.0, pressure)
    return joint_stiffness([each, each], [sprocket_radius()] * 2)


def _shut_stiffness(pressure: float) -> float:
    """The same by turning the arm with both chambers shut [N m/rad]."""
    muscle, radius, h = row(ideal_muscle()), sprocket_radius(), 1e-4
    air = [charged_air_state(muscle, 0.0, pressure)]

    def torque(angle: float) -> float:
        ways = -radius * angle, radius * angle
        first, second = (gauge_pressure(muscle, air, way) for way in ways)
        return antagonist_torque((muscle, muscle), radius, angle, (first, second))

    return -(torque(h) - torque(-h)) / (2.0 * h)


@recomputes("matiskova2021-22")
def _printed_signs() -> Recomputed:
    each, shut = _parts(_FULL), _shut_stiffness(_FULL)
    # -P1 V1'' + P2 V2'' as printed: at equal pressures the geometric parts cancel.
    as_printed = each.compressibility
    return Recomputed(
        "- P1 V1'' - P2 V2''",
        holds=abs(as_printed - shut) <= _AGREEMENT * shut,
        as_printed=as_printed,
        shut=shut,
        geometric=100.0 * each.geometric / shut,
    )


@recomputes("matiskova2021-23")
def _both_parts() -> Recomputed:
    each, shut = _parts(_FULL), _shut_stiffness(_FULL)
    return Recomputed(
        (each.compressibility, each.geometric),
        holds=abs(each.total - shut) <= _AGREEMENT * shut,
        tolerance=_AGREEMENT * shut,
        total=each.total,
        shut=shut,
        agreement=_AGREEMENT,
    )


@recomputes("matiskova2021-24")
def _sum_in_theory() -> Recomputed:
    low, high = 200.0 * PA_PER_KPA, 400.0 * PA_PER_KPA
    exponent = math.log(_parts(high).total / _parts(low).total) / math.log(high / low)
    geometric = math.log(_parts(high).geometric / _parts(low).geometric) / math.log(high / low)
    return Recomputed(exponent, geometric=geometric)


@functools.cache
def _torque_law(*extra: str) -> TorqueLaw:
    return fit_torque_law(distinct_steps(), extra)


@recomputes("matiskova2021-25")
def _sum_in_tables() -> Recomputed:
    plain, law = _torque_law(), _torque_law("c")
    c, half = law.coefficients["c"], law.half_interval["c"]
    low, high = c - half, c + half
    return Recomputed(
        c,
        holds=low > 0.0,
        otherwise=Verdict.INCONSISTENT if high < 0.0 else Verdict.NOT_REPRODUCIBLE,
        low=low,
        high=high,
        rms=law.rms_deg,
        held_out_rms=law.left_out_rms_deg,
        plain_rms=plain.rms_deg,
        plain_held_out_rms=plain.left_out_rms_deg,
    )


@recomputes("matiskova2021-26")
def _same_difference() -> Recomputed:
    steps, plain = distinct_steps(), _torque_law()
    pairs: list[tuple[PrintedStep, PrintedStep]] = []
    for i, first in enumerate(steps):
        for second in steps[i + 1 :]:
            near = abs(_difference(first) - _difference(second)) <= 1.0 * PA_PER_KPA
            ratio = sum(second.pressure) / sum(first.pressure)
            if near and max(ratio, 1.0 / ratio) > 1.5:
                pairs.append((first, second))
    apart = [abs(a.angle - b.angle) * DEG_PER_RAD for a, b in pairs]
    named = "; ".join(
        f"rows {a.row} and {b.row}: sums {sum(a.pressure) / PA_PER_KPA:.0f} and"
        f" {sum(b.pressure) / PA_PER_KPA:.0f} kPa, {a.angle * DEG_PER_RAD:.2f} and"
        f" {b.angle * DEG_PER_RAD:.2f} deg"
        for a, b in pairs
    )
    return Recomputed(max(apart), tolerance=plain.rms_deg, named=named)


@recomputes("matiskova2021-27")
def _stiffest() -> Recomputed:
    steps = distinct_steps()
    near = next(step for step in steps if step.row == 19)
    far = next(step for step in steps if step.row == 1)
    first = _difference(near) / near.angle
    second = (_difference(far) - _difference(near)) / (far.angle - near.angle)
    muscle, radius = ideal_muscle(), sprocket_radius()
    along: list[float] = []
    for share in (1.0, 0.9, 0.8, 0.7, 0.6):
        pressures = _FULL, share * _FULL
        way = radius * rest_angle(muscle, pressures)
        pair = [
            ideal_stiffness(row(muscle), sign * way, pressure)
            for sign, pressure in zip((-1.0, 1.0), pressures, strict=True)
        ]
        along.append(joint_stiffness(pair, [radius] * 2).total)
    ideal = "falls" if along == sorted(along, reverse=True) else "does not fall steadily"
    scale = PA_PER_KPA * DEG_PER_RAD
    return Recomputed(
        (first / scale, second / scale),
        holds=first >= second,
        ideal=ideal,
        vented=0.6 * _FULL / PA_PER_KPA,
        first=along[0],
        last=along[-1],
    )


@recomputes("matiskova2021-28")
def _symmetric() -> Recomputed:
    plain, law = _torque_law(), _torque_law("o")
    offset, half = law.coefficients["o"], law.half_interval["o"]
    shift = offset / plain.coefficients["k1"] * DEG_PER_RAD
    return Recomputed(100.0 * offset, tolerance=100.0 * half, shift=shift)


def _difference(step: PrintedStep) -> float:
    return step.pressure[0] - step.pressure[1]
