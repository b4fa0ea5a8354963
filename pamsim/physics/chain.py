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

A cam or a pulley off its axis has an arm that changes by a share A(x), learned from data as a curve
without a formula (`pamsim.physics.spline`). The muscle's length is its integral, x_muscle = x + int
A dx from 0 on, and no work is lost either.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.spline import curve_of_8, integral_of_8

CONTROLS = 8
"""Control values of a learned change of the moment arm: bends in a seventh of the travel."""


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
    learned_low: float = quantity("[-10, 10] m", "tendon length at which a curve begins", 0.0)
    learned_high: float = quantity("[-10, 10] m", "tendon length at which it ends", 0.0)
    learned_1: float = quantity(
        "[-20, 20]", "control value of a learned change of the moment arm, as a share, first", 0.0
    )
    learned_2: float = quantity("[-20, 20]", "second", 0.0)
    learned_3: float = quantity("[-20, 20]", "third", 0.0)
    learned_4: float = quantity("[-20, 20]", "fourth", 0.0)
    learned_5: float = quantity("[-20, 20]", "fifth", 0.0)
    learned_6: float = quantity("[-20, 20]", "sixth", 0.0)
    learned_7: float = quantity("[-20, 20]", "seventh", 0.0)
    learned_8: float = quantity("[-20, 20]", "eighth", 0.0)


def chain_ripples(chain: Chain) -> bool:
    """Whether the force on the tendon is another than the muscle's."""
    return chain.ripple > 0.0 or learns_arm(chain)


def learns_arm(chain: Chain) -> bool:
    """Whether there is a learned change of the moment arm."""
    return chain.learned_high > chain.learned_low


def chain_length(chain: Chain, tendon_length: float) -> float:
    """Tendon length behind the sprocket [m], from that of the round one before it [m]."""
    length = tendon_length
    if chain.ripple > 0.0:
        wave = 2.0 * math.pi / chain.ripple_pitch
        length += chain.ripple * math.sin(wave * tendon_length + chain.ripple_phase)
    if learns_arm(chain):
        length += _cam_travel(chain, tendon_length) - _cam_travel(chain, 0.0)
    return length


def chain_ratio(chain: Chain, tendon_length: float) -> float:
    """Derivative of `chain_length` [-], also the force on the tendon over the muscle's pull."""
    ratio = 1.0
    if chain.ripple > 0.0:
        wave = 2.0 * math.pi / chain.ripple_pitch
        ratio += chain.ripple * wave * math.cos(wave * tendon_length + chain.ripple_phase)
    if learns_arm(chain):
        ratio += curve_of_8(
            tendon_length,
            chain.learned_low,
            chain.learned_high,
            chain.learned_1,
            chain.learned_2,
            chain.learned_3,
            chain.learned_4,
            chain.learned_5,
            chain.learned_6,
            chain.learned_7,
            chain.learned_8,
        )
    return ratio


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


def _cam_travel(chain: Chain, tendon_length: float) -> float:
    return integral_of_8(
        tendon_length,
        chain.learned_low,
        chain.learned_high,
        chain.learned_1,
        chain.learned_2,
        chain.learned_3,
        chain.learned_4,
        chain.learned_5,
        chain.learned_6,
        chain.learned_7,
        chain.learned_8,
    )
