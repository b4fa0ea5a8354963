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
from pamsim.physics.force_laws.swept_volume import GAUSS
from pamsim.physics.passive import locking_force, tube_energy, tube_force
from pamsim.physics.record import Parameters, States
from pamsim.physics.tension import effective_pressure, force_left, taut

_HIGHER = 10.0  # step of a difference quotient by pressure [Pa]
_POINTS = 401  # on each side of a cycle; the trapezium rule is right to 1e-6 there


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

    Pressure stretches the fibres; a model with rigid ones overestimates the force, by up to 70 %
    for soft braids (Actuators 2022, 11, 219). To first order the length at which the muscle is free
    grows in proportion, to l0 (1 + e p), and active force and tube take their contraction from it.
    """
    free = m.braid.nominal_length * (1.0 + m.braid.extensibility * pressure)
    kappa = 1.0 - muscle_length(m, tendon_length) / free
    threshold = m.threshold.pressure
    effective = pressure if law_pushes(m) else effective_pressure(pressure, threshold)
    active = active_force(m, effective, kappa)
    if m.end_shape.loss > 0.0 and active > 0.0:
        active *= force_left(m.end_shape, kappa)[0]
    locked = locking_force(m.passive, contraction(m, tendon_length))
    return active + tube_force(m.passive, kappa) + locked


def limited(m: Parameters, force: float) -> float:
    """A signed force [N] limited to tension, unless the law of the actuator may push."""
    return force if law_pushes(m) else taut(force)


def static_volume(m: Parameters, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3] in tubing and muscle at a gauge pressure [Pa], without hysteresis.

    The muscle without losses has one energy G(l, p) with F = dG/dl and V = -dG/dp, so the volume
    changes with length as the force does with pressure, dV/dl = -dF/dp, from the braid's volume at
    nominal length on. The air then does the work that the muscle gives. The pressure is without
    influence if the force is linear in it.
    """
    kappa = contraction(m, tendon_length)
    return volume_at_nominal_length(m) + volume_and_slope(m, kappa, pressure)[0]


def volume_varies(m: Parameters) -> bool:
    """Whether the volume depends on the pressure, so that this must be searched for."""
    return m.braid.extensibility > 0.0 or law_volume_varies(m)


def volume_at_nominal_length(m: Parameters) -> float:
    """Tubing, and the cylinder that the braid is at nominal length [m^3].

    A pushing actuator is empty where its stroke is zero.
    """
    if law_pushes(m):
        return m.chamber.dead_volume - rigid_volume(m, 1.0, 0.0)
    diameter = m.braid.diameter
    return m.chamber.dead_volume + 0.25 * math.pi * diameter * diameter * m.braid.nominal_length


def rigid_volume(m: Parameters, kappa: float, pressure: float) -> float:
    """Volume gained since nominal length if the braid were inextensible [m^3]."""
    effective = effective_pressure(pressure, m.threshold.pressure)
    return m.braid.nominal_length * _active_gain(m, effective, kappa)


def volume_and_slope(m: Parameters, kappa: float, pressure: float) -> tuple[float, float]:
    """Volume gained since nominal length [m^3] and its derivative by pressure [m^3/Pa].

    Active force and tube know the contraction q against the length s l0 that the pressurised muscle
    has when free, s = 1 + e p. The integral of d F(p, q(p, kappa)) / dp by kappa is s times that of
    dF/dp by q, and, with dq/dp = e (1 - q) / s, e times that of (1 - q) dF/dq by q, by parts.
    """
    nominal, extensibility = m.braid.nominal_length, m.braid.extensibility
    effective = effective_pressure(pressure, m.threshold.pressure)
    grown = 1.0 + extensibility * pressure
    free, strained = 1.0 - 1.0 / grown, 1.0 - (1.0 - kappa) / grown
    above = 1.0 if pressure > m.threshold.pressure else 0.0
    slope = 0.0
    if above > 0.0 and law_volume_varies(m):
        for sign, at in ((1.0, strained), (-1.0, free)):
            higher = _active_gain(m, effective + _HIGHER, at)
            slope += sign * grown * (higher - _active_gain(m, effective, at)) / _HIGHER
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

    Returns:
        Integral of dF/dp from nominal length [m^2]; (1 - q) F plus the integral of F, up to a
        constant [N]; their derivatives, the first plus (1 - q) dF/dp [m^2] and (1 - q)^2 dF/dq [N].
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
    stored = tube_energy(m.passive, contraction, tube)
    rise = scale * rise - m.passive.stiffness - m.passive.softening * min(tube, 0.0)
    length = 1.0 - contraction
    return (
        scale * gain,
        length * (scale * active + tube) + scale * work - stored,
        scale * (gain + length * per_pressure),
        length * length * rise,
    )


def _active_gain(m: Parameters, pressure: float, contraction: float) -> float:
    """Integral of the active force's slope by pressure from nominal length [m^2]."""
    if m.end_shape.loss > 0.0:
        return m.force.scale * _left_by_ends(m, pressure, contraction)[0]
    return m.force.scale * law_volume(m, pressure, contraction)


def _left_by_ends(m: Parameters, pressure: float, contraction: float) -> tuple[float, float]:
    """Integrals from nominal length of what the ends leave of the force, without the scale.

    Where they leave a share s an integral is, by parts, s times that without ends, less the
    integral of s' times it, for which ten points by Gauss suffice. Exact where the force pulls.

    Returns:
        Integral of the slope by pressure [m^2], and of the force [N].
    """
    onset = m.end_shape.onset
    gain = law_volume(m, pressure, contraction)
    work = law_work(m, pressure, contraction, gain)
    left = force_left(m.end_shape, contraction)[0]
    gain, work = left * gain, left * work
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
    """Mechanical over pneumatic work of a cycle [-]; 1 if no energy is made or lost.

    A muscle that shortens at a pressure, is vented, lengthens without pressure and is filled again
    gives the difference of its force's work on the two ways. Its air does the integral of p dV.
    Hysteresis is left out.

    Args:
        m: parameters of a muscle.
        pressure: gauge, at which it shortens [Pa].
        contraction: it goes from minus to plus this [-].
    """
    stroke = np.linspace(-contraction, contraction, _POINTS)
    filling = np.linspace(0.0, pressure, _POINTS)
    still = np.ones(_POINTS)
    kappa = np.concatenate([stroke, contraction * still, stroke[::-1], -contraction * still])
    held = np.concatenate([pressure * still, filling[::-1], 0.0 * still, filling])
    length: FloatArray = (1.0 - kappa) * m.braid.nominal_length
    tendon: FloatArray = length - m.mounting.length_at_zero
    places = list(zip(tendon.tolist(), held.tolist(), strict=True))
    given = -np.trapezoid([static_force(m, *place) for place in places], length)
    return float(given / np.trapezoid(held, [static_volume(m, *place) for place in places]))
