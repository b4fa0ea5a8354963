"""Force and volume of a muscle without memory: two derivatives of one potential.

Every function takes the parameter row ``par`` of one actuator in the layout of
`pamsim.physics.layout`, and is compiled as it stands, as in `pamsim.physics.kernel`.
"""

from __future__ import annotations

import math

from pamsim.physics.braid import pressurised_contraction
from pamsim.physics.end_shape import force_left, force_left_slope
from pamsim.physics.force_laws.dispatch import (
    chosen_derivatives,
    chosen_force,
    chosen_volume,
    chosen_work,
    pushes,
    volume_depends_on_pressure,
)
from pamsim.physics.force_laws.swept_volume import GAUSS
from pamsim.physics.layout import Row, slot
from pamsim.physics.passive import locking_force, tube_energy, tube_force
from pamsim.physics.tension import effective_pressure, taut

_FORCE_LAW = slot("force.law")
_FORCE_SCALE = slot("force.0")
_FORCE_COEFFICIENTS = _FORCE_SCALE + 1
_LENGTH_AT_ZERO = slot("mounting.length_at_zero")
_NOMINAL_LENGTH = slot("braid.nominal_length")
_DIAMETER = slot("braid.diameter")
_EXTENSIBILITY = slot("braid.extensibility")
_PASSIVE_STIFFNESS = slot("passive.stiffness")
_PASSIVE_SOFTENING = slot("passive.softening")
_PASSIVE_SLACK = slot("passive.slack_contraction")
_PASSIVE_LOCKING = slot("passive.locking")
_THRESHOLD = slot("threshold.pressure")
_END_LOSS = slot("end_shape.loss")
_END_ONSET = slot("end_shape.onset")
_DEAD_VOLUME = slot("chamber.dead_volume")
_HIGHER = 10.0  # step of a difference quotient by pressure [Pa]


def muscle_length(par: Row, tendon_length: float) -> float:
    """Length of the muscle l [m] from the tendon length at the muscle [m]."""
    return par[_LENGTH_AT_ZERO] + tendon_length


def contraction(par: Row, tendon_length: float) -> float:
    """Contraction kappa = 1 - l/l0 [-] from the length of the tendon [m]."""
    return 1.0 - muscle_length(par, tendon_length) / par[_NOMINAL_LENGTH]


def active_force(par: Row, pressure: float, contraction: float) -> float:
    """Signed force of the muscle's active law, its scale included [N].

    Args:
        par: parameter row.
        pressure: gauge pressure that reaches the braid [Pa].
        contraction: kappa [-].
    """
    return par[_FORCE_SCALE] * chosen_force(
        par[_FORCE_LAW], par, _FORCE_COEFFICIENTS, _NOMINAL_LENGTH, pressure, contraction
    )


def _active_pull(par: Row, pressure: float, contraction: float) -> float:
    """Signed active force [N] that the ends leave, from the pressure that reaches the braid."""
    active = active_force(par, pressure, contraction)
    if par[_END_LOSS] > 0.0 and active > 0.0:
        active *= force_left(contraction, par[_END_LOSS], par[_END_ONSET])
    return active


def static_force(par: Row, tendon_length: float, pressure: float) -> float:
    """Signed muscle force without hysteresis [N] at a gauge pressure [Pa]."""
    kappa = pressurised_contraction(
        muscle_length(par, tendon_length), par[_NOMINAL_LENGTH], par[_EXTENSIBILITY], pressure
    )
    locked = locking_force(
        contraction(par, tendon_length),
        par[_PASSIVE_STIFFNESS],
        par[_PASSIVE_SLACK],
        par[_PASSIVE_LOCKING],
    )
    tube = tube_force(kappa, par[_PASSIVE_STIFFNESS], par[_PASSIVE_SOFTENING], par[_PASSIVE_SLACK])
    effective = effective_pressure(pressure, par[_THRESHOLD])
    if pushes(par[_FORCE_LAW]):
        effective = pressure
    return _active_pull(par, effective, kappa) + tube + locked


def limited(par: Row, force: float) -> float:
    """A signed force [N] limited to tension, unless the law of the actuator may push."""
    if pushes(par[_FORCE_LAW]):
        return force
    return taut(force)


def static_volume(par: Row, tendon_length: float, pressure: float) -> float:
    """Volume of the air [m^3]: tubing, and the muscle's under its force law, without hysteresis.

    The muscle without losses has one energy G(l, p) with F = dG/dl and V = -dG/dp, so the volume
    changes with length as the force does with pressure, dV/dl = -dF/dp, from the braid's volume at
    nominal length on. The air then does the work that the muscle gives.

    Args:
        par: parameter row.
        tendon_length: at the muscle [m].
        pressure: gauge pressure [Pa]; without influence if the force is linear in it.
    """
    kappa = contraction(par, tendon_length)
    return volume_at_nominal_length(par) + volume_since_nominal(par, kappa, pressure)


def volume_varies(par: Row) -> bool:
    """Whether the volume depends on the pressure, so that this must be searched for."""
    return par[_EXTENSIBILITY] > 0.0 or volume_depends_on_pressure(par[_FORCE_LAW])


def volume_at_nominal_length(par: Row) -> float:
    """Tubing, and the cylinder that the braid is at nominal length [m^3].

    A pushing actuator is empty where its stroke is zero.
    """
    if pushes(par[_FORCE_LAW]):
        return par[_DEAD_VOLUME] - rigid_volume(par, 1.0, 0.0)
    diameter = par[_DIAMETER]
    return par[_DEAD_VOLUME] + 0.25 * math.pi * diameter * diameter * par[_NOMINAL_LENGTH]


def volume_since_nominal(par: Row, kappa: float, pressure: float) -> float:
    """Volume gained since nominal length [m^3], the first of `volume_and_slope`."""
    return volume_and_slope(par, kappa, pressure)[0]


def rigid_volume(par: Row, kappa: float, pressure: float) -> float:
    """Volume gained since nominal length if the braid were inextensible [m^3]."""
    return par[_NOMINAL_LENGTH] * _active_gain(
        par, effective_pressure(pressure, par[_THRESHOLD]), kappa
    )


def volume_and_slope(par: Row, kappa: float, pressure: float) -> tuple[float, float]:
    """Volume gained since nominal length [m^3] and its derivative by pressure [m^3/Pa].

    Active force and tube know the contraction q against the length s l0 that the pressurised muscle
    has when free, s = 1 + e p. The integral of d F(p, q(p, kappa)) / dp by kappa is s times that of
    dF/dp by q, and, with dq/dp = e (1 - q) / s, e times that of (1 - q) dF/dq by q, by parts.
    """
    nominal, extensibility = par[_NOMINAL_LENGTH], par[_EXTENSIBILITY]
    effective = effective_pressure(pressure, par[_THRESHOLD])
    grown = 1.0 + extensibility * pressure
    free, strained = 1.0 - 1.0 / grown, 1.0 - (1.0 - kappa) / grown
    above = 1.0 if pressure > par[_THRESHOLD] else 0.0
    slope = 0.0
    if above > 0.0 and volume_depends_on_pressure(par[_FORCE_LAW]):
        for sign, at in ((1.0, strained), (-1.0, free)):
            higher = _active_gain(par, effective + _HIGHER, at)
            slope += sign * grown * (higher - _active_gain(par, effective, at)) / _HIGHER
    if extensibility == 0.0:
        return rigid_volume(par, kappa, pressure), nominal * slope
    gain, work, swell, rise = _gain_and_work(par, effective, strained)
    gain_free, work_free, swell_free, rise_free = _gain_and_work(par, effective, free)
    volume = grown * (gain - gain_free) + extensibility * (work - work_free)
    slope += extensibility * (1.0 + above) * (swell - swell_free)
    slope += extensibility * extensibility / grown * (rise - rise_free)
    return nominal * volume, nominal * slope


def _gain_and_work(
    par: Row, pressure: float, contraction: float
) -> tuple[float, float, float, float]:
    """What volume and slope are made of, from the active force and the tube's, F, at one place.

    Returns:
        Integral of dF/dp from nominal length [m^2]; (1 - q) F plus the integral of F, up to a
        constant [N]; their derivatives, the first plus (1 - q) dF/dp [m^2] and (1 - q)^2 dF/dq [N].
    """
    scale, loss, onset = par[_FORCE_SCALE], par[_END_LOSS], par[_END_ONSET]
    active, rise, per_pressure, gain, work = chosen_derivatives(
        par[_FORCE_LAW], par, _FORCE_COEFFICIENTS, _NOMINAL_LENGTH, pressure, contraction
    )
    if loss > 0.0:
        gain, work = _left_by_ends(par, pressure, contraction)
        if active > 0.0:  # where the muscle pushes the derivatives leave the ends out
            left = force_left(contraction, loss, onset)
            rise = left * rise + force_left_slope(contraction, loss, onset) * active
            active, per_pressure = left * active, left * per_pressure
    stiffness, softening = par[_PASSIVE_STIFFNESS], par[_PASSIVE_SOFTENING]
    tube = tube_force(contraction, stiffness, softening, par[_PASSIVE_SLACK])
    stored = tube_energy(contraction, tube, stiffness, softening, par[_PASSIVE_SLACK])
    rise = scale * rise - stiffness - softening * min(tube, 0.0)
    length = 1.0 - contraction
    return (
        scale * gain,
        length * (scale * active + tube) + scale * work - stored,
        scale * (gain + length * per_pressure),
        length * length * rise,
    )


def _active_gain(par: Row, pressure: float, contraction: float) -> float:
    """Integral of the active force's slope by pressure from nominal length [m^2]."""
    if par[_END_LOSS] > 0.0:
        return par[_FORCE_SCALE] * _left_by_ends(par, pressure, contraction)[0]
    return par[_FORCE_SCALE] * _whole_gain(par, pressure, contraction)


def _left_by_ends(par: Row, pressure: float, contraction: float) -> tuple[float, float]:
    """Integrals from nominal length of what the ends leave of the force, without the scale.

    Where they leave a share s an integral is, by parts, s times that without ends, less the
    integral of s' times it, for which ten points by Gauss suffice. Exact where the force pulls.

    Args:
        par: parameter row.
        pressure: that reaches the braid [Pa].
        contraction: [-].

    Returns:
        Integral of the slope by pressure [m^2], and of the force [N].
    """
    loss, onset = par[_END_LOSS], par[_END_ONSET]
    gain = _whole_gain(par, pressure, contraction)
    work = _whole_work(par, pressure, contraction, gain)
    left = force_left(contraction, loss, onset)
    gain, work = left * gain, left * work
    low, high = max(onset, 0.0), max(contraction, onset)
    if low == high:
        return gain, work
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    lost_gain, lost_work = 0.0, 0.0
    for node, weight in GAUSS:
        for at in (middle - half * node, middle + half * node):
            share = weight * half * force_left_slope(at, loss, onset)
            inner = _whole_gain(par, pressure, at)
            lost_gain += share * inner
            lost_work += share * _whole_work(par, pressure, at, inner)
    return gain - lost_gain, work - lost_work


def _whole_gain(par: Row, pressure: float, contraction: float) -> float:
    """Integral of the slope without ends and scale from nominal length [m^2]."""
    law, first, braid = par[_FORCE_LAW], _FORCE_COEFFICIENTS, _NOMINAL_LENGTH
    return chosen_volume(law, par, first, braid, pressure, contraction)


def _whole_work(par: Row, pressure: float, contraction: float, gain: float) -> float:
    """Integral of the force without ends and scale from nominal length [N]; its gain is known."""
    law, first, braid = par[_FORCE_LAW], _FORCE_COEFFICIENTS, _NOMINAL_LENGTH
    return chosen_work(law, par, first, braid, pressure, contraction, gain)
