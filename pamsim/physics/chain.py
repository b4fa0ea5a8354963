"""Compliance and backlash of the chain and the end fittings in series with a muscle.

The compliance C is a spring with a parallel damper (Kelvin-Voigt): under a tension T its extension
approaches C T with a time constant, which does not matter at rest. The extension is a state, so no
equation has to be solved for the tension in a time step. Links and fittings that seat themselves
make it stiffer under tension: it gives C / (1 + h T) per tension, and extends by C ln(1 + h T) / h.

Between sprocket and chain there may be a backlash g. The chain that two muscles pull from both
sides is then shifted by s on the teeth, |s| <= g/2: one muscle is longer by s, the other shorter.
It slides towards the stronger pull, with viscous damping, and rests where a tooth stops it:

    s' = (T_other - T) / b

The power lost between muscles and joint is (T - T_other)^2 / b or, at a tooth, zero. Teeth and
their seats may give by c per tension. The chain then slides on beyond g/2 against their spring, at
s' = (T_other - T - (s -+ g/2) / c) / b.

A chain lies on its sprocket as on a polygon. Over a pitch p of its travel x the muscle's length
runs ahead and falls back by an amplitude a, and the force on the sprocket changes with it, so that
no work is lost:

    x_muscle = x + a sin(2 pi x / p + phase)
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity


class Chain(ParameterGroup, group="chain"):
    """Compliance and backlash of chain and end fittings; 0 turns each of them off."""

    compliance: float = quantity("[0, 1e-3] m/N", "C, extension per tension", 0.0)
    hardening: float = quantity(
        "[0, 1] 1/N", "h, reciprocal tension at which the compliance is halved; 0 never", 0.0
    )
    relaxation_time: float = quantity(
        "[1e-3, 10] s",
        "in which the extension follows the tension; several time steps at least",
        5e-3,
    )
    backlash: float = quantity("[0, 2e-2] m", "g, lost travel of the sprocket", 0.0)
    seating_damping: float = quantity(
        "[1, 1e9] N*s/m",
        "b, difference of the two pulls over the speed of the chain within the backlash",
        1e3,
    )
    tooth_compliance: float = quantity(
        "[0, 1e-3] m/N", "c, travel beyond the backlash per difference of pulls", 0.0
    )
    ripple: float = quantity(
        "[0, 5e-3] m", "a, by which the travel on the sprocket's teeth ripples", 0.0
    )
    ripple_pitch: float = quantity("[1e-4, 1] m", "p, travel per tooth", 9.525e-3)
    ripple_phase: float = quantity("[-7, 7] rad", "of the ripple at tendon length 0", 0.0)


def chain_length(chain: Chain, tendon_length: float) -> float:
    """Tendon length behind the sprocket's teeth [m], from that before them [m]."""
    if chain.ripple == 0.0:
        return tendon_length
    wave = 2.0 * math.pi / chain.ripple_pitch
    return tendon_length + chain.ripple * math.sin(wave * tendon_length + chain.ripple_phase)


def chain_ratio(chain: Chain, tendon_length: float) -> float:
    """Derivative of `chain_length` [-], also the force on the tendon over the muscle's pull."""
    if chain.ripple == 0.0:
        return 1.0
    wave = 2.0 * math.pi / chain.ripple_pitch
    return 1.0 + chain.ripple * wave * math.cos(wave * tendon_length + chain.ripple_phase)


def steady_extension(chain: Chain, tension: float) -> float:
    """Extension of the chain [m] that a tension T [N] leads to."""
    felt = tension
    if chain.hardening > 0.0:
        felt = math.log(1.0 + chain.hardening * tension) / chain.hardening
    return chain.compliance * felt


def extension_rate(chain: Chain, extension: float, tension: float) -> float:
    """Rate of the chain's extension [m/s] at an extension [m] and a tension T [N]."""
    return (steady_extension(chain, tension) - extension) / chain.relaxation_time


def shift_rate(
    chain: Chain, shift: float, tension: float, opposing: float, timestep: float
) -> float:
    """Rate of the chain's shift s on the sprocket over an Euler step [m/s].

    One step leaves the shift within half the backlash, exactly at a tooth where one stops it, or
    beyond it as implicit Euler does against elastic teeth. Of the shift [m], by which the muscle is
    longer than its tendon, its tension T and that of the muscle at the chain's other end, 0 if
    there is none [N], and the step [s].
    """
    after = shift - timestep * (tension - opposing) / chain.seating_damping
    half = 0.5 * chain.backlash
    reach = chain.seating_damping * chain.tooth_compliance
    given = reach / (reach + timestep)
    if after > half:
        after = half + given * (after - half)
    elif after < -half:
        after = -half + given * (after + half)
    return (after - shift) / timestep
