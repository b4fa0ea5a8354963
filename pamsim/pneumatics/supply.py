"""Flow from a supply whose pressure falls with the flow drawn, in closed form.

The supply pressure falls in proportion to the flow, P_s = P_0 - R mdot, and the valve behind it
follows ISO 6358, mdot = G P_s phi(P / P_s) (see `pamsim.pneumatics.orifice`). Choked and laminar
flow are linear in P_s. On the ellipse between them

    (1 - b)^2 mdot^2 = G^2 (P_s - P) ((1 - 2 b) P_s + P),

a quadratic equation in mdot. Upstream pressure plus R times its flow grows with the upstream
pressure, so exactly one of the three pieces holds its own solution.
"""

from __future__ import annotations

import math

from pamsim.pneumatics.orifice import flow_function, mass_flow


def drawn_flow(
    supply_abs: float,
    resistance: float,
    chamber_abs: float,
    conductance: float,
    critical_ratio: float,
    laminar_ratio: float,
    temperature: float,
) -> float:
    """Mass flow from a supply that sags into a chamber.

    Args:
        supply_abs: P_0, absolute pressure of the supply while nothing is drawn [Pa].
        resistance: R [Pa s/kg]; 0 for a supply that does not sag.
        chamber_abs: P, absolute pressure in the chamber [Pa].
        conductance: sonic conductance C of the valve as far as it is open [m^3/(s Pa)].
        critical_ratio: b [-].
        laminar_ratio: see `pamsim.pneumatics.orifice.flow_function` [-].
        temperature: of the air [K].

    Returns:
        mdot [kg/s]. Flow back into the supply meets its pressure at rest.
    """
    orifice = critical_ratio, laminar_ratio, temperature
    stiff = mass_flow(supply_abs, chamber_abs, conductance, *orifice)
    if resistance == 0.0 or not stiff > 0.0:
        return stiff
    gain = mass_flow(1.0, 0.0, conductance, *orifice)  # G: choked flow per upstream pressure
    load = resistance * gain
    sagged = supply_abs / (1.0 + load)
    if chamber_abs <= critical_ratio * sagged:
        return gain * sagged
    # The straight piece G s (P_s - P) near equal pressures, solved for P_s.
    slope = flow_function(laminar_ratio, critical_ratio, laminar_ratio) / (1.0 - laminar_ratio)
    flow = gain * slope * (supply_abs - chamber_abs) / (1.0 + load * slope)
    if chamber_abs >= laminar_ratio * (supply_abs - resistance * flow):
        return flow
    return _elliptic_flow(supply_abs, resistance, chamber_abs, gain, critical_ratio)


def _elliptic_flow(
    supply: float, resistance: float, chamber: float, gain: float, critical: float
) -> float:
    """The root at which more flow would be more than the valve passes."""
    skew = 1.0 - 2.0 * critical
    above, sum_ = supply - chamber, skew * supply + chamber
    load = gain * resistance
    square = (1.0 - critical) * (1.0 - critical) - skew * load * load
    linear = gain * load * (sum_ + skew * above)
    constant = -gain * gain * above * sum_
    root = math.sqrt(max(linear * linear - 4.0 * square * constant, 0.0))
    if linear >= 0.0:
        return -2.0 * constant / (linear + root)
    return (root - linear) / (2.0 * square)
