"""Valves, supply and air of a muscle, in equations of their own."""

from __future__ import annotations

import math

from pamsim.core.units import FloatArray
from tests.plant.records import Record

R_AIR = 287.05
"""Gas constant of air [J/(kg K)]."""

GAMMA = 1.4
"""Ratio of the heat capacities of air [-]."""

_DENSITY, _WARM = 1.185, 293.15
"""Air to which a sonic conductance refers (ISO 8778) [kg/m^3, K]."""


def ellipse(m: Record, ratio: float) -> float:
    """Share of the choked flow at a ratio of pressures by ISO 6358, straight close to 1 [-]."""
    b, near = m.critical, m.laminar
    if ratio <= b:
        return 1.0
    if ratio < near:
        return math.sqrt(1.0 - ((ratio - b) / (1.0 - b)) ** 2)
    return math.sqrt(1.0 - ((near - b) / (1.0 - b)) ** 2) * (1.0 - ratio) / (1.0 - near)


def isentropic(ratio: float, near: float) -> float:
    """Share of the choked flow by the isentropic nozzle (Saint-Venant, Wantzel) [-]."""
    choked = (2.0 / (GAMMA + 1.0)) ** (GAMMA / (GAMMA - 1.0))
    if ratio <= choked:
        return 1.0
    most = choked ** (2.0 / GAMMA) - choked ** ((GAMMA + 1.0) / GAMMA)
    held = min(ratio, near)
    share = math.sqrt((held ** (2.0 / GAMMA) - held ** ((GAMMA + 1.0) / GAMMA)) / most)
    return share if ratio <= near else share * (1.0 - ratio) / (1.0 - near)


def orifice(m: Record, conductance: float, up: float, down: float) -> float:
    """Mass flow [kg/s] between two absolute pressures [Pa]; negative if it runs back."""
    high, low = max(up, down), min(up, down)
    share = isentropic(low / high, m.laminar) if m.nozzle > 0.0 else ellipse(m, low / high)
    flow = conductance * _DENSITY * high * math.sqrt(_WARM / m.temperature) * share
    return flow if up >= down else -flow


def refilled(j: Record, fall: float) -> float:
    """Flow [kg/s] that refills a supply whose pressure has fallen [Pa]."""
    if j.refill_square == 0.0:
        return fall / j.refill
    root = math.sqrt(j.refill**2 + 4.0 * j.refill_square * abs(fall))
    return math.copysign((root - j.refill) / (2.0 * j.refill_square), fall)


def line_pressure(j: Record, muscles: Record, openings: FloatArray, inside: FloatArray) -> float:
    """Absolute pressure [Pa] at which a supply without volume gives what its muscles draw."""
    full = muscles[0].supply + muscles[0].atmosphere
    low, high = full, full
    for i in range(len(muscles)):
        if openings[i] > 0.0:
            low, high = min(low, inside[i]), max(high, inside[i])
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        more = -refilled(j, full - middle)
        for i in range(len(muscles)):
            if openings[i] > 0.0:
                m = muscles[i]
                more += orifice(m, openings[i] * m.fill_conductance, middle, inside[i])
        if more > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def opening(m: Record, command: float, by_pressure: bool, pressure: float, time: float) -> float:
    """Signed opening of the valves [-]: of a set point [Pa], by the regulator, or of a command."""
    wanted = command
    if by_pressure:
        error = command - pressure
        beyond = max(abs(error) - m.dead_band, 0.0) / m.band
        wanted = math.copysign(beyond, error)
    wanted = min(max(wanted, -1.0), 1.0)
    if wanted > 0.0:
        wanted = max(wanted - m.dead_zone_fill, 0.0) / (1.0 - m.dead_zone_fill)
    else:
        wanted = min(wanted + m.dead_zone_exhaust, 0.0) / (1.0 - m.dead_zone_exhaust)
    if m.lift > 0.0:
        wanted = math.copysign(lifted(abs(wanted), m.lift), wanted)
    if m.stuck_fills != 0.0 and time >= m.stuck_from and wanted * m.stuck_fills > m.stuck_at:
        wanted = m.stuck_at * m.stuck_fills
    return wanted


def lifted(share: float, over: float) -> float:
    """Share of a poppet valve's flow at a share of its lift [-]: little is gained in the end."""
    return math.tanh(share / over) / math.tanh(1.0 / over)


def flows(m: Record, wanted: float, inside: float, supply: float) -> tuple[float, float]:
    """Mass flows [kg/s] into a muscle through the fill valve, and out of it, at an opening."""
    into = 0.0
    out = orifice(m, m.leak, inside, m.atmosphere)
    out += m.laminar_leak * (inside - m.atmosphere)
    if wanted > 0.0:
        into = orifice(m, wanted * m.fill_conductance, supply, inside)
    elif wanted < 0.0:
        out += orifice(m, -wanted * m.exhaust_conductance, inside, m.atmosphere)
    return into, out


def pressure_rate(
    m: Record, inside: float, space: tuple[float, float], swept, warmth, into, out
) -> tuple[float, float]:
    """Rates of absolute pressure [Pa/s] and temperature [K/s] of a muscle's air.

    By the polytropic law, or, with a ``heat_time``, by the balance of energy of air that exchanges
    heat with walls at the rig's temperature. Of an absolute pressure [Pa], a volume [m^3] and its
    change with pressure [m^3/Pa], the rate at which it is swept [m^3/s], and flows [kg/s].
    """
    volume, by_pressure = space
    if m.heat_time == 0.0:
        supplied = R_AIR * m.temperature * (into - out)
        stiff = volume + m.polytropic * inside * by_pressure
        return m.polytropic * (supplied - inside * swept) / stiff, 0.0
    mass = inside * volume / (R_AIR * warmth)
    heat = mass * R_AIR / (GAMMA - 1.0) * (m.temperature - warmth) / m.heat_time
    enthalpy = GAMMA * R_AIR * (m.temperature * into - warmth * out)
    rate = (enthalpy - GAMMA * inside * swept + (GAMMA - 1.0) * heat) / (
        volume + GAMMA * inside * by_pressure
    )
    swept += by_pressure * rate
    return rate, warmth * (rate / inside + swept / volume - (into - out) / mass)
