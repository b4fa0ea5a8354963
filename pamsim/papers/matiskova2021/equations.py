"""Matiskova 2021, the equations of its section 3: what misprints would mean, and stiffness.

They are taken at the MAS-20 rig's muscle at rest, as identified and as an ideal one.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.claim import Recomputed, agreeing, recomputes
from pamsim.papers.numerics import derivative, half_unit, rms, root
from pamsim.papers.torque_law import printed_rows_law
from pamsim.physics.antagonist import (
    Stiffness,
    antagonist_torque,
    joint_stiffness,
    muscle_stiffness,
    pressure_slope,
)
from pamsim.physics.braid import max_contraction, volume_slope
from pamsim.physics.chamber_pressure import gauge_pressure
from pamsim.physics.force_laws.force_law import ForceParameters
from pamsim.physics.force_laws.mckibben import IdealMcKibben, ideal_force
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.physics.muscle import Mounting, Muscle, build_muscle
from pamsim.physics.passive import PassiveSpring
from pamsim.physics.record import COMMON, Parameters, parameters, split_states
from pamsim.physics.rest_state import charged_air_state
from pamsim.physics.static_muscle import muscle_length, static_force
from pamsim.physics.tension import Threshold
from pamsim.recordings.printed import Printed, PrintedStep, distinct_steps, mas20_steps
from pamsim.recordings.rig_file import read_rig

MILLIMETRE = 1e-3
"""[m]."""

_HAIR = 1e-6
"""Pull that moves nothing [N]."""

_STRIDE = 4.0 * MILLIMETRE

_FULL = 487.0 * PA_PER_KPA  # Table 1, row 1
_LOW, _HIGH = 100.0 * PA_PER_KPA, 490.0 * PA_PER_KPA  # that the rows span
_POINTS = 40


_file = functools.cache(lambda: read_rig("mas20_arm"))


@functools.cache
def rig_muscle() -> Muscle:
    """Either muscle of the rig; its numbers and their sources stand in its ``params.toml``."""
    return build_muscle(_file().muscle, where="mas20_arm")


@functools.cache
def ideal_muscle() -> Muscle:
    """The rig's braid and air with the ideal law alone, at half its stroke where the angle is 0.

    That is the reference point E of equation (1), with its minus restored.
    """
    braid = rig_muscle().braided
    length = braid.nominal_length * (1.0 - 0.5 * max_contraction(braid.fibre_angle))
    return dataclasses.replace(_with_force(IdealMcKibben(), length), threshold=Threshold())


def _with_force(force: ForceParameters, length: float) -> Muscle:
    """The rig's muscle with another force alone, mounted at a length [m]."""
    muscle = rig_muscle()
    return dataclasses.replace(
        muscle,
        mounting=Mounting(length_at_zero=length),
        braid=dataclasses.replace(muscle.braided, extensibility=0.0),
        force=force,
        passive=PassiveSpring(),
        hysteresis=None,
    )


def sprocket_radius() -> float:
    """Radius of the rig's sprocket [m]; assumed, the paper prints none."""
    return _file().native["tendon.chain_1.coef"].si("m")


def stroke(muscle: Muscle) -> float:
    """Largest shortening of the ideal law [m]."""
    return muscle.braided.nominal_length * max_contraction(muscle.braided.fibre_angle)


def rest_travel(muscle: Muscle, pressures: tuple[float, float]) -> float:
    """How far muscle 1 has shortened and muscle 2 lengthened where they balance without load [m].

    Two slack muscles hold nothing: the travel is that at which the driving one goes slack. The
    pressures are gauge [Pa].
    """
    pair = (parameters(muscle), parameters(muscle))
    way = 1.0 if pressures[0] > pressures[1] else -1.0

    def drive(travel: float) -> float:
        return way * antagonist_torque(pair, 1.0, way * travel, pressures) - _HAIR

    far = 0.0
    while drive(far) > 0.0:  # the first balance: a law may have others where it no longer holds
        far += _STRIDE
    return way * root(drive, max(far - _STRIDE, 0.0), far, 1e-9) if far else 0.0


@recomputes("matiskova2021-17")
def _rest_length() -> Recomputed:
    muscle = ideal_muscle()
    longest, way = muscle.braided.nominal_length, stroke(muscle)
    middle = longest - way / 2.0
    return Recomputed(
        longest * way / 2.0,
        **agreeing(middle),
        longest=longest / MILLIMETRE,
        fibre_angle=muscle.braided.fibre_angle * DEG_PER_RAD,
        middle=middle,
    )


def mounted(length: float) -> tuple[float, float]:
    """RMS miss [rad] of the distinct rows by published muscles mounted at a length [m].

    They have the rig's braid and the force map of a DMSP-20-200. Travel does not depend on the
    radius of the sprocket, so the best radius [m], the second number, is one least squares.
    """
    muscle, steps = _with_force(PUBLISHED["DMSP-20-200"], length), distinct_steps()
    travel = np.array([rest_travel(muscle, step.pressure) for step in steps])
    angle = np.array([step.angle for step in steps])
    per_travel = float(travel @ angle / (travel @ travel))
    return rms(per_travel * travel - angle), 1.0 / per_travel


@recomputes("matiskova2021-44")
def _half_stroke() -> Recomputed:
    longest = ideal_muscle().braided.nominal_length
    middle = longest - stroke(ideal_muscle()) / 2.0
    miss, radius = mounted(middle)
    nominal, _ = mounted(longest)
    lengths = np.linspace(middle, longest, 12).tolist()
    least, _, best = min((*mounted(length), length) for length in lengths)
    return Recomputed(
        miss * DEG_PER_RAD,
        high=printed_rows_law().left_out_rms_deg,
        middle=middle / MILLIMETRE,
        radius=radius / MILLIMETRE,
        longest=longest / MILLIMETRE,
        nominal=nominal * DEG_PER_RAD,
        least=least * DEG_PER_RAD,
        best=best / MILLIMETRE,
        slack=(longest - middle) / sprocket_radius() * DEG_PER_RAD,
        rows_deg=printed_rows_law().left_out_rms_deg,
    )


@recomputes("matiskova2021-18")
def _longer_and_stronger() -> Recomputed:
    law = parameters(rig_muscle())
    short, long, pressure = -10.0 * MILLIMETRE, 0.0, 300.0 * PA_PER_KPA
    force = static_force(law, short, pressure)
    equal = root(lambda p: static_force(law, long, p) - force, 0.0, pressure, 1e-3)
    return Recomputed(equal / PA_PER_KPA, low=pressure / PA_PER_KPA)


@recomputes("matiskova2021-20")
def _sign_rule() -> Recomputed:
    """Of the fully vented rows with a negative angle, those in which muscle 2 is the vented one."""
    vented = [step for step in mas20_steps() if min(step.pressure) == 0.0 and step.angle < 0.0]
    second = sum(step.pressure[1] == 0.0 for step in vented)
    return Recomputed(float(second), printed=Printed(float(len(vented)), 0.0))


@recomputes("matiskova2021-21")
def _radius() -> Recomputed:
    largest = max(abs(step.angle) for step in mas20_steps())
    way = stroke(ideal_muscle())
    return Recomputed(
        way / 2.0 / largest / MILLIMETRE,
        angle=largest * DEG_PER_RAD,
        stroke=way / MILLIMETRE,
    )


def ideal_stiffness(m: Parameters, tendon_length: float, pressure: float) -> Stiffness:
    """Stiffness of one shut muscle if its force were F = -p dV/dl (Matiskova 2021, equation (5)).

    Its parts are -dP/dV (dV/dl)^2 and -p d2V/dl2 [N/m], at a tendon length [m] and a gauge
    pressure [Pa]. The muscle has the ideal law, so that its volume is the braid's.
    """
    length = muscle_length(m, tendon_length)
    braid = m.braid.nominal_length, m.braid.diameter, m.braid.fibre_angle
    per_pressure = -volume_slope(length, *braid)
    return Stiffness(
        compressibility=per_pressure * pressure_slope(m, tendon_length, pressure),
        geometric=derivative(lambda at: ideal_force(pressure, at, *braid), length),
    )


def _pair(each: Stiffness) -> Stiffness:
    """Stiffness of a joint with two such muscles [N m/rad]."""
    return joint_stiffness([each, each], [sprocket_radius()] * 2)


def _parts(pressure: float) -> Stiffness:
    """Parts of (5) at the reference point with both muscles at one pressure [N m/rad]."""
    return _pair(ideal_stiffness(parameters(ideal_muscle()), 0.0, pressure))


def rig_stiffness(pressure: float) -> Stiffness:
    """Stiffness of the rig's joint at the reference point, both muscles at one pressure [N m/rad].

    Its geometric part is what is left where valves hold the pressures, the total that of shut
    chambers.
    """
    return _pair(muscle_stiffness(parameters(rig_muscle()), 0.0, pressure))


def stiffness_over_pressure() -> dict[str, list[float]]:
    """Joint stiffness [N m/rad] at the reference point over the sum of two equal pressures.

    It is that of the rig and of the ideal pair, by (5) with its last sign mended, at held pressures
    and with the chambers shut.
    """
    pressures = [float(p) for p in np.linspace(_LOW, _HIGH, _POINTS)]
    rig, ideal = [rig_stiffness(p) for p in pressures], [_parts(p) for p in pressures]
    return {
        "sum_kpa": [2.0 * p / PA_PER_KPA for p in pressures],
        "held": [each.geometric for each in rig],
        "shut": [each.total for each in rig],
        "ideal_held": [each.geometric for each in ideal],
        "ideal_shut": [each.total for each in ideal],
    }


def _shut_stiffness(pressure: float) -> float:
    """The same by turning the arm with both chambers shut [N m/rad]."""
    muscle, radius, h = parameters(ideal_muscle()), sprocket_radius(), 1e-4
    s, z = split_states([0.0] * COMMON)
    s.air = charged_air_state(muscle, z, 0.0, pressure)

    def torque(angle: float) -> float:
        ways = -radius * angle, radius * angle
        first, second = (gauge_pressure(muscle, s, z, way) for way in ways)
        return antagonist_torque((muscle, muscle), radius, angle, (first, second))

    return -(torque(h) - torque(-h)) / (2.0 * h)


@recomputes("matiskova2021-22")
def _printed_signs() -> Recomputed:
    each, shut = _parts(_FULL), _shut_stiffness(_FULL)
    # -P1 V1'' + P2 V2'' as printed: at equal pressures the geometric parts cancel.
    return Recomputed(
        each.compressibility,
        **agreeing(shut),
        shut=shut,
        geometric=100.0 * each.geometric / shut,
    )


@recomputes("matiskova2021-24")
def _sum_in_theory() -> Recomputed:
    low, high = 200.0 * PA_PER_KPA, 400.0 * PA_PER_KPA
    parts, span = (_parts(high), _parts(low)), math.log(high / low)
    exponent = math.log(parts[0].total / parts[1].total) / span
    geometric = math.log(parts[0].geometric / parts[1].geometric) / span
    return Recomputed(exponent, **agreeing(1.0), geometric=geometric)


@recomputes("matiskova2021-25")
def _sum_in_tables() -> Recomputed:
    plain, law = printed_rows_law(), printed_rows_law("c")
    c, half = law.coefficients["c"], law.half_interval["c"]
    low, high = rig_stiffness(_LOW), rig_stiffness(_HIGH)
    return Recomputed(
        c,
        low=0.0,
        scatter=half,
        least=c - half,
        most=c + half,
        rms=law.rms_deg,
        held_out_rms=law.left_out_rms_deg,
        plain_rms=plain.rms_deg,
        plain_held_out_rms=plain.left_out_rms_deg,
        lowest=_LOW / PA_PER_KPA,
        highest=_HIGH / PA_PER_KPA,
        held_low=low.geometric,
        held_high=high.geometric,
        shut_low=low.total,
        shut_high=high.total,
    )


@recomputes("matiskova2021-26")
def _same_difference() -> Recomputed:
    pairs: list[tuple[PrintedStep, PrintedStep]] = []
    for first, second in itertools.combinations(distinct_steps(), 2):
        near = abs(_difference(first) - _difference(second)) <= 1.0 * PA_PER_KPA
        ratio = sum(second.pressure) / sum(first.pressure)
        if near and max(ratio, 1.0 / ratio) > 1.5:
            pairs.append((first, second))
    apart = [Printed(abs(a.angle - b.angle) * DEG_PER_RAD, 2.0 * half_unit(2)) for a, b in pairs]
    named = "; ".join(
        f"rows {a.row} and {b.row}: sums {sum(a.pressure) / PA_PER_KPA:.0f} and"
        f" {sum(b.pressure) / PA_PER_KPA:.0f} kPa, {a.angle * DEG_PER_RAD:.2f} and"
        f" {b.angle * DEG_PER_RAD:.2f} deg"
        for a, b in pairs
    )
    # Of the difference of two rows with equal scatter.
    half = 1.96 * math.sqrt(2.0) * printed_rows_law().left_out_rms_deg
    return Recomputed(apart, high=0.0, scatter=[half] * len(apart), named=named, half=half)


def _stiffness_ratio(
    muscle: Muscle, stiffness: Callable[[Parameters, float, float], Stiffness]
) -> float:
    """Joint stiffness with muscle 2 vented to 0.6 of muscle 1's pressure, over that at E [-]."""
    par, radius = parameters(muscle), sprocket_radius()
    limit = 0.5 * stroke(muscle) / radius

    def total(share: float) -> float:
        pressures = _FULL, share * _FULL
        way = radius * root(
            lambda angle: antagonist_torque((par, par), radius, angle, pressures),
            -limit, limit, 1e-12,
        )  # fmt: skip
        pair = [stiffness(par, -way, pressures[0]), stiffness(par, way, pressures[1])]
        return joint_stiffness(pair, [radius] * 2).total

    return total(0.6) / total(1.0)


@recomputes("matiskova2021-27")
def _stiffest() -> Recomputed:
    rows = {step.row: step for step in distinct_steps()}
    near, far = rows[19], rows[1]
    scale = PA_PER_KPA * DEG_PER_RAD
    ratios = [
        _stiffness_ratio(ideal_muscle(), ideal_stiffness),
        _stiffness_ratio(rig_muscle(), muscle_stiffness),
    ]
    return Recomputed(
        ratios,
        high=1.0,
        first=_difference(near) / near.angle / scale,
        second=(_difference(far) - _difference(near)) / (far.angle - near.angle) / scale,
        vented=0.6 * _FULL / PA_PER_KPA,
    )


@recomputes("matiskova2021-28")
def _symmetric() -> Recomputed:
    plain, law = printed_rows_law(), printed_rows_law("o")
    offset, half = law.coefficients["o"], law.half_interval["o"]
    per_unit = DEG_PER_RAD / plain.coefficients["k1"]
    return Recomputed(
        Printed(100.0 * offset, 2.0 * half_unit(0)),
        low=0.0,
        high=0.0,
        scatter=100.0 * half,
        half=100.0 * half,
        shift=half * per_unit,
    )


def _difference(step: PrintedStep) -> float:
    return step.pressure[0] - step.pressure[1]
