"""Force and volume of a muscle without memory: two derivatives of one potential.

``m`` are the parameters of one actuator, see `pamsim.physics.record`. The functions are compiled as
they stand, as those of `pamsim.physics.kernel`.
"""

from __future__ import annotations

import math

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.physics.chain import chain_length
from pamsim.physics.chosen_law import (
    law_derivatives,
    law_force,
    law_pushes,
    law_volume,
    law_volume_varies,
    law_work,
)
from pamsim.physics.force_laws.force_law import GAUSS
from pamsim.physics.learned_tension import (
    learned_area,
    learned_derivatives,
    learned_gain,
    learned_pull,
    learned_work,
    learns_tension,
)
from pamsim.physics.passive import locking_force, tube_energy_and_slope, tube_force
from pamsim.physics.record import Parameters, States
from pamsim.physics.tension import effective_pressure, force_left, pressure_reaching, taut

_HIGHER = 10.0  # step of a difference quotient by pressure [Pa]


def length_at_muscle(m: Parameters, s: States, tendon_length: float) -> float:
    """Tendon length at the muscle [m]: behind the teeth, plus the shift, minus the extension."""
    length = chain_length(m.chain, tendon_length)
    if m.chain.backlash > 0.0:
        length = length + s.shift
    if m.chain.compliance > 0.0:
        length = length - s.extension
    return length


def muscle_length(m: Parameters, tendon_length: float) -> float:
    """Length of the muscle l [m] from the tendon length at the muscle [m]."""
    return m.mounting.length_at_zero + tendon_length


def contraction(m: Parameters, tendon_length: float) -> float:
    """Contraction kappa = 1 - l/l0 [-] from the length of the tendon [m]."""
    return 1.0 - muscle_length(m, tendon_length) / m.braid.nominal_length


def active_force(m: Parameters, pressure: float, contraction: float) -> float:
    """Signed force of the active law with its scale [N], at the pressure in the braid [Pa]."""
    return m.force.scale * law_force(m, pressure, contraction)


def static_force(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Signed muscle force without hysteresis [N] at a gauge pressure [Pa].

    Pressure stretches the fibres, which weakens soft braids by up to 70 % (Actuators 2022, 11,
    219). To first order the length at which the muscle is free grows in proportion, to
    l0 (1 + e p), and active force and tube take their contraction from it.
    """
    free = m.braid.nominal_length * (1.0 + m.braid.extensibility * pressure)
    kappa = 1.0 - muscle_length(m, tendon_length) / free
    effective = pressure if law_pushes(m) else _in_braid(m, pressure)
    active = active_force(m, effective, kappa)
    if m.end_shape.loss > 0.0 and active > 0.0:
        active *= force_left(m.end_shape, kappa)[0]
    locked = locking_force(m.passive, contraction(m, tendon_length))
    if learns_tension(m.learned_tension):
        active += effective * learned_area(m.learned_tension, kappa)
        active += learned_pull(m.learned_tension, kappa)
    return active + tube_force(m.passive, kappa) + locked


def _in_braid(m: Parameters, pressure: float) -> float:
    """Gauge pressure that reaches the braid [Pa]."""
    return effective_pressure(pressure, m.threshold.pressure, m.threshold.width)


def limited(m: Parameters, force: float) -> float:
    """A signed force [N] limited to tension, unless the law of the actuator may push."""
    return force if law_pushes(m) else taut(force)


def static_volume(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3] in tubing and muscle at a gauge pressure [Pa], without hysteresis.

    It changes with length as the force does with pressure, dV/dl = -dF/dp, from the braid's volume
    at nominal length on: the air does the work that the muscle gives. A threshold of the pressure
    (`Threshold`) does not change it, so that the two differ below one, and near one with a width.
    """
    kappa = contraction(m, tendon_length)
    return volume_at_nominal_length(m) + volume_and_slope(m, kappa, pressure)[0]


def volume_varies(m: Parameters) -> bool:
    """Whether the volume depends on the pressure, so that this must be searched for."""
    return m.braid.extensibility > 0.0 or law_volume_varies(m)


def volume_at_nominal_length(m: Parameters) -> float:
    """Tubing and the braid's cylinder [m^3]; a pushing actuator is empty where its stroke is 0."""
    if law_pushes(m):
        return m.chamber.dead_volume - rigid_volume(m, 1.0, 0.0)
    diameter = m.braid.diameter
    return m.chamber.dead_volume + 0.25 * math.pi * diameter * diameter * m.braid.nominal_length


def rigid_volume(m: Parameters, kappa: float, pressure: float) -> float:
    """Volume gained since nominal length if the braid were inextensible [m^3]."""
    effective = _in_braid(m, pressure)
    return m.braid.nominal_length * _active_gain(m, effective, kappa)


def volume_and_slope(m: Parameters, kappa: float, pressure: float) -> tuple[float, float]:
    """Volume gained since nominal length [m^3] and its derivative by pressure [m^3/Pa].

    Active force and tube know the contraction q against the length s l0 that the pressurised muscle
    has when free, s = 1 + e p. The integral of d F(p, q(p, kappa)) / dp by kappa is s times that of
    dF/dp by q, and, with dq/dp = e (1 - q) / s, e times that of (1 - q) dF/dq by q, by parts.
    """
    nominal, extensibility = m.braid.nominal_length, m.braid.extensibility
    effective = _in_braid(m, pressure)
    grown = 1.0 + extensibility * pressure
    free, strained = 1.0 - 1.0 / grown, 1.0 - (1.0 - kappa) / grown
    above = pressure_reaching(pressure, m.threshold.pressure, m.threshold.width)
    slope = 0.0
    if above > 0.0 and law_volume_varies(m):
        for sign, at in ((1.0, strained), (-1.0, free)):
            higher = _active_gain(m, effective + _HIGHER, at)
            slope += above * sign * grown * (higher - _active_gain(m, effective, at)) / _HIGHER
    if extensibility == 0.0:
        return rigid_volume(m, kappa, pressure), nominal * slope
    gain, work, swell, rise = _gain_and_work(m, effective, strained)
    gain_free, work_free, swell_free, rise_free = _gain_and_work(m, effective, free)
    volume = grown * (gain - gain_free) + extensibility * (work - work_free)
    slope += extensibility * (1.0 + above) * (swell - swell_free)
    slope += extensibility * extensibility / grown * (rise - rise_free)
    return nominal * volume, nominal * slope


def _gain_and_work(
    m: Parameters, pressure: float, contraction: float
) -> tuple[float, float, float, float]:
    """What volume and slope are made of, from the active force and the tube's, F, at one place.

    Integral of dF/dp from nominal length [m^2]; (1 - q) F plus the integral of F, up to a constant
    [N]; their derivatives, the first plus (1 - q) dF/dp [m^2] and (1 - q)^2 dF/dq [N].
    """
    scale = m.force.scale
    active, rise, per_pressure, gain, work = law_derivatives(m, pressure, contraction)
    if m.end_shape.loss > 0.0:
        gain, work = _left_by_ends(m, pressure, contraction)
        if active > 0.0:  # where the muscle pushes the derivatives leave the ends out
            left, left_slope = force_left(m.end_shape, contraction)
            rise = left * rise + left_slope * active
            active, per_pressure = left * active, left * per_pressure
    tube = tube_force(m.passive, contraction)
    stored, tube_slope = tube_energy_and_slope(m.passive, contraction, tube)
    gain, work = scale * gain, scale * work - stored
    force, rise, per_pressure = (
        scale * active + tube,
        scale * rise + tube_slope,
        scale * per_pressure,
    )
    if learns_tension(m.learned_tension):
        learned = m.learned_tension
        area, swept = learned_area(learned, contraction), learned_gain(learned, contraction)
        area_slope, pull_slope = learned_derivatives(learned, contraction)
        gain, per_pressure = gain + swept, per_pressure + area
        work += pressure * swept + learned_work(learned, contraction)
        force += pressure * area + learned_pull(learned, contraction)
        rise += pressure * area_slope + pull_slope
    length = 1.0 - contraction
    return gain, length * force + work, gain + length * per_pressure, length * length * rise


def _active_gain(m: Parameters, pressure: float, contraction: float) -> float:
    """Integral of the active force's slope by pressure from nominal length [m^2]."""
    learned = 0.0
    if learns_tension(m.learned_tension):
        learned = learned_gain(m.learned_tension, contraction)
    if m.end_shape.loss > 0.0:
        return m.force.scale * _left_by_ends(m, pressure, contraction)[0] + learned
    return m.force.scale * law_volume(m, pressure, contraction) + learned


def _left_by_ends(m: Parameters, pressure: float, contraction: float) -> tuple[float, float]:
    """Integrals of the slope by pressure [m^2] and of the force [N] that the ends leave, unscaled.

    Where they leave a share s an integral is, by parts, s times that without ends, less the
    integral of s' times it, for which ten points by Gauss suffice. Exact where the force pulls.
    """
    onset, left = m.end_shape.onset, force_left(m.end_shape, contraction)[0]
    inner = law_volume(m, pressure, contraction)
    gain, work = left * inner, left * law_work(m, pressure, contraction, inner)
    low, high = max(onset, 0.0), max(contraction, onset)
    if low == high:
        return gain, work
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    lost_gain, lost_work = 0.0, 0.0
    for node, weight in GAUSS:
        for at in (middle - half * node, middle + half * node):
            share = weight * half * force_left(m.end_shape, at)[1]
            inner = law_volume(m, pressure, at)
            lost_gain += share * inner
            lost_work += share * law_work(m, pressure, at, inner)
    return gain - lost_gain, work - lost_work


def work_ratio(m: Parameters, pressure: float, contraction: float) -> float:
    """Mechanical over pneumatic work of a cycle, without hysteresis [-]; 1 if no energy is made.

    The muscle shortens at a gauge pressure [Pa] from minus to plus a contraction, is vented,
    lengthens without pressure and is filled again. Its force does the integral of F dl, its air
    that of p dV.
    """
    # The trapezium rule is right to 1e-6 with 401 points on each side.
    stroke = np.linspace(-contraction, contraction, 401)
    filling, still = np.linspace(0.0, pressure, 401), np.ones(401)
    kappa = np.concatenate([stroke, contraction * still, stroke[::-1], -contraction * still])
    held = np.concatenate([pressure * still, filling[::-1], 0.0 * still, filling])
    length: FloatArray = (1.0 - kappa) * m.braid.nominal_length
    tendon: FloatArray = length - m.mounting.length_at_zero
    places = list(zip(tendon.tolist(), held.tolist(), strict=True))
    given = -np.trapezoid([static_force(m, *place) for place in places], length)
    return float(given / np.trapezoid(held, [static_volume(m, *place) for place in places]))
