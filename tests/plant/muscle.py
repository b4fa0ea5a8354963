"""Force and volume of a muscle, in equations of their own."""

from __future__ import annotations

import math

from pamsim.core.units import FloatArray
from tests.plant.records import PLAYS, STRAIN, Record

CHORD = 0.015
"""Amplitude of the cycle whose chord a Prandtl-Ishlinskii hysteresis leaves out [-]."""

_PANELS = 16
"""Of Simpson's rule for the volume of a muscle with ends or a braid that pressure lengthens."""

_STEP, _BIT = 1e3, 1e-6
"""Steps of the differences by pressure [Pa] and by contraction [-]."""


def pull_per_pressure(m: Record, kappa: float) -> float:
    """Active force per gauge pressure dF/dp [m^2] at a contraction [-]."""
    besides = 0.0
    if m.swell != 0.0:
        besides = m.swell * math.exp(-0.5 * ((kappa - m.swell_at) / m.swell_width) ** 2)
    if m.law == 0.0:
        return besides + m.scale * (m.a * math.exp(m.c * kappa) + m.d * kappa + m.e)
    tangent = math.tan(m.fibre_angle)
    ideal = 3.0 * (1.0 - kappa) ** 2 / tangent**2 - 1.0 / math.sin(m.fibre_angle) ** 2
    return besides + m.scale * 0.25 * math.pi * m.diameter**2 * ideal


def free_pull(m: Record, kappa: float) -> float:
    """Part of the active law that needs no pressure [N]."""
    return m.scale * (m.b * math.exp(m.c * kappa) + m.f) if m.law == 0.0 else 0.0


def gained(m: Record, kappa: float) -> float:
    """Integral of `pull_per_pressure` over the contraction from 0 [m^2]."""
    besides = 0.0
    if m.swell != 0.0:
        wide = math.sqrt(2.0) * m.swell_width
        here, start = math.erf((kappa - m.swell_at) / wide), math.erf(-m.swell_at / wide)
        besides = m.swell * m.swell_width * math.sqrt(0.5 * math.pi) * (here - start)
    if m.law == 0.0:
        grown = m.a / m.c * (math.exp(m.c * kappa) - 1.0)
        return besides + m.scale * (grown + 0.5 * m.d * kappa**2 + m.e * kappa)
    cube = (1.0 - (1.0 - kappa) ** 3) / math.tan(m.fibre_angle) ** 2
    ideal = cube - kappa / math.sin(m.fibre_angle) ** 2
    return besides + m.scale * 0.25 * math.pi * m.diameter**2 * ideal


def volume(m: Record, length: float, pressure: float) -> tuple[float, float, float]:
    """Volume of the air [m^3], its change with length [m^2] and with pressure [m^3/Pa].

    By virtual work: dV/dl = -dF/dp, from the volume of the braid at nominal length.
    """
    kappa = 1.0 - length / m.nominal_length
    more, by_pressure = swept(m, kappa, pressure), 0.0
    if m.extensibility > 0.0:
        by_pressure = swept(m, kappa, pressure + _STEP) - swept(m, kappa, pressure - _STEP)
        by_pressure *= m.nominal_length / (2.0 * _STEP)
    start = m.dead_volume + 0.25 * math.pi * m.diameter**2 * m.nominal_length
    return start + m.nominal_length * more, -pressure_slope(m, kappa, pressure), by_pressure


def swept(m: Record, kappa: float, pressure: float) -> float:
    """Integral of `pressure_slope` over the contraction from 0 [m^2]."""
    if m.end_loss == 0.0 and m.cone == 0.0 and m.extensibility == 0.0:
        return gained(m, kappa)
    more, part = 0.0, kappa / _PANELS
    for k in range(_PANELS + 1):
        weight = 1.0 if k in (0, _PANELS) else (4.0 if k % 2 else 2.0)
        more += weight * part / 3.0 * pressure_slope(m, k * part, pressure)
    return more


def pressure_slope(m: Record, kappa: float, pressure: float) -> float:
    """Change of the force without memory with gauge pressure [m^2] at a contraction."""
    grown = 1.0 + m.extensibility * pressure
    free = 1.0 - (1.0 - kappa) / grown
    slope = pull_per_pressure(m, free) * ends(m, free)
    if m.extensibility > 0.0:
        bent = loose_pull(m, free + _BIT, pressure) - loose_pull(m, free - _BIT, pressure)
        slope += bent / (2.0 * _BIT) * m.extensibility * (1.0 - free) / grown
    return slope


def spring(m: Record, stretch: float) -> float:
    """Tube without pressure [N]: lets go when contracted."""
    force = m.passive_stiffness * stretch
    if stretch < 0.0:
        force = m.passive_stiffness / m.passive_softening
        force *= math.exp(m.passive_softening * stretch) - 1.0
    if m.cubic != 0.0:
        force += m.cubic * stretch * (1.0 + (stretch / m.cubic_at) ** 2)
    if m.sinh != 0.0:
        force += m.sinh * m.sinh_at * math.sinh(stretch / m.sinh_at)
    return force


def locked(m: Record, stretch: float) -> float:
    """What a stretched braid adds to the tube as it locks [N]."""
    if stretch <= 0.0 or m.passive_locking == 0.0:
        return 0.0
    inside = min(stretch, 0.95 / m.passive_locking)
    room = (1.0 - inside * m.passive_locking) * (1.0 + inside * m.passive_locking)
    slope = (2.0 - room) / room**2  # derivative of x / (1 - (x/x_lock)^2)
    return m.passive_stiffness * (inside / room + slope * (stretch - inside) - stretch)


def inside_pressure(m: Record, pressure: float) -> float:
    """Gauge pressure that reaches the braid [Pa]."""
    lost = m.threshold
    if m.lost_pressure > 0.0:
        lost += m.lost_pressure * (1.0 - math.exp(-pressure / m.lost_over))
    return max(pressure - lost, 0.0)


def ends(m: Record, kappa: float) -> float:
    """Share of a pulling active force that the ends leave [-]."""
    beyond = max(kappa - m.end_onset, 0.0) / 0.1
    left = 1.0 - m.end_loss + m.end_loss / (1.0 + beyond**2)
    if m.cone > 0.0:
        over = kappa - m.cone_onset
        left -= min(0.5 * m.cone * (over + math.sqrt(over**2 + m.cone_bend**2)), 1.0)
    return left


def reach_of(m: Record, k: int) -> float:
    """Contraction at which play operator k slips [-]."""
    return m.play_reach * (k + 1) / PLAYS


def played(position: float, kappa: float, reach: float) -> float:
    """Output of a play operator [-]: it follows its input no nearer than its reach."""
    return min(max(position, kappa - reach), kappa + reach)


def play_share(m: Record, plays: FloatArray, kappa: float) -> float:
    """Hysteresis of all play operators [-].

    Maxwell slip: 1 once all slip while the muscle shortens. Prandtl-Ishlinskii: about the chord of
    a cycle of `CHORD`, so that it adds loss and no stiffness.
    """
    total, all_ = 0.0, 0.0
    for k in range(PLAYS):
        reach = reach_of(m, k)
        share = (k + 1.0) if m.play_even > 0.0 else 0.7**k
        total += share * (kappa - played(plays[k], kappa, reach)) / reach
        if m.play_even > 0.0:
            total -= share * min(1.0 / reach, 1.0 / CHORD) * kappa
        all_ += share
    return total / all_


def creep_pull(m: Record, states: FloatArray, first: int) -> float:
    """Force that the relaxing branches take from the muscle's pull [N]."""
    at = first + STRAIN
    taken = m.creep_0 * states[at] + m.creep_1 * states[at + 1] + m.creep_2 * states[at + 2]
    return taken + m.creep_3 * states[at + 3] + m.creep_4 * states[at + 4]


def steady_pull(m: Record, length: float, pressure: float) -> float:
    """Signed force without memory [N] at a gauge pressure [Pa]."""
    kappa = 1.0 - length / m.nominal_length
    free = 1.0 - length / (m.nominal_length * (1.0 + m.extensibility * pressure))
    return loose_pull(m, free, pressure) + locked(m, m.passive_slack - kappa)


def loose_pull(m: Record, free: float, pressure: float) -> float:
    """Force without memory and locking [N], at a contraction against the pressurised muscle."""
    active = pull_per_pressure(m, free) * inside_pressure(m, max(pressure, 0.0))
    active += free_pull(m, free)
    if active > 0.0:
        active *= ends(m, free)
    if m.knot != 0.0:
        active += m.knot * math.exp(-0.5 * ((free - m.knot_at) / m.knot_width) ** 2)
    return active + spring(m, m.passive_slack - free)


def loop_pull(m: Record, plays: FloatArray, loop, duhem, kappa, above, steady) -> float:
    """Force that hysteresis takes from a steady force [N], of its variables, at a contraction.

    Of the gauge pressure [Pa] what lies ``above`` 0 counts.
    """
    taken = (m.loop_force + m.loop_per_pressure * above + m.loop_share * steady) * loop
    width = m.play_force + m.play_per_pressure * above
    if width > 0.0:
        taken += width * play_share(m, plays, kappa)
    return taken + m.duhem_per_pressure * above * duhem


def tension(m: Record, plays: FloatArray, states: FloatArray, first, length, speed, time) -> float:
    """Tension of a muscle [N] whose states begin at ``first``, and whose tendon lengthens [m/s]."""
    pressure = states[first] - m.atmosphere
    steady = steady_pull(m, length, pressure)
    if m.ageing != 0.0 and time > 0.0:
        steady *= 1.0 - m.ageing * (1.0 - math.exp(-time / m.ageing_time))
    kappa = 1.0 - length / m.nominal_length
    above = max(pressure, 0.0)
    pull = steady - loop_pull(m, plays, states[first + 2], states[first + 3], kappa, above, steady)
    pull += m.braid_rub * above * speed / m.nominal_length
    return max(pull - creep_pull(m, states, first), 0.0)


def loop_rate(m: Record, loop: float, shortening: float) -> float:
    """Rate of the Bouc-Wen variable [1/s] at a rate of the contraction [1/s]."""
    size = abs(loop) ** m.loop_sharpness
    sense = 1.0 if loop * shortening > 0.0 else -1.0
    blocked = size * (m.loop_sigma * sense + 1.0 - m.loop_sigma)
    return shortening / m.loop_yield * (1.0 - blocked)


def duhem_rate(m: Record, duhem: float, shortening: float) -> float:
    """Rate of the Duhem variable [1/s]: towards 1 while shortening, towards -1, slower, else."""
    if shortening > 0.0:
        return (1.0 + m.duhem_skew) * shortening / m.duhem_travel * (1.0 - duhem)
    return (1.0 - m.duhem_skew) * shortening / m.duhem_travel * (1.0 + duhem)


def rub_rate(m: Record, force: float, speed: float, pull: float) -> float:
    """Rate of the bristles' force along the tendon [N/s] (LuGre), at a speed [m/s] and tension."""
    always = m.rub + m.rub_share * pull
    if always + m.rub_static == 0.0:
        return 0.0
    sliding = always + m.rub_static * math.exp(-((speed / m.brake_speed) ** 2))
    return (always + m.rub_static) / m.rub_travel * (speed - abs(speed) * force / sliding)
