"""Passive elasticity, creep, first stroke and softening of tube and braid.

The elasticity is a spring that locks on stretch and lets go on contraction. That of the
tube, with x = kappa_slack - kappa, the stretch beyond the slack point:

    x <= 0:  F = (k/h) (exp(h x) - 1)     the pressure-free part b exp(c kappa) + f of Sarosi (4)
    x > 0:   F = k x

Contracted, it resists with at most k/h, which is what a muscle must overcome before it pulls. Its
kappa is that against the length at which the pressurised muscle is free. Where the braid locks, at
a stretch x_lock of the muscle itself, it adds what makes the whole of an unpressurised muscle the
finitely extensible spring k x / (1 - (x/x_lock)^2) (Warner 1972). Thick rubber or a sleeve does not
let go. It is a spring in parallel that pulls as it pushes, at the same stretch, and may harden:

    F = K x (1 + (x/x_h)^2)

Creep is one or two Maxwell elements beside the muscle, which make it a standard linear solid: at a
sudden change of length it is stiffer by k, held there it relaxes, and under a held load it goes on
moving. The element's force is k (kappa - kappa_d), with the contraction kappa_d of its damper as
memory. A second one makes the relaxation faster at first and slower later, as rubber's is.

Rubber is softer in a second stroke than in the first (Mullins 1969), up to the furthest point of
the strokes before. What a muscle loses to that is the force of a spring of travel d with a ratchet,
which follows the contraction to its furthest point kappa_m and never comes back:

    F = F_1 clip(1 + (kappa - kappa_m) / d, 0, 1)

It takes work from every stroke that goes further than all before, and none from others.

A muscle that is worked softens, by its warmth or by its age. Its force without memory is then the
share 1 - c w of a fresh one's, with w from 0 to 1 in the time tau. That is an assumption; since the
volume stays, the work of the air is no longer that of the force.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity

_TANGENT = 0.95  # share of the locking stretch beyond which the force goes on along its tangent


class PassiveSpring(ParameterGroup, group="passive"):
    """Stiffness, softening, locking and slack point of the passive spring; stiffness 0 is none."""

    stiffness: float = quantity("[0, 1e6] N", "k = -dF/dkappa at the slack point", 0.0)
    softening: float = quantity("[0.1, 500]", "h, e-fold softening per unit of contraction", 1.0)
    slack_contraction: float = quantity(
        "[-0.3, 0.5]", "contraction at which the spring is free", 0.0
    )
    locking: float = quantity(
        "[0, 200]", "1/x_lock, reciprocal stretch at which the braid locks; 0 never", 0.0
    )
    parallel: float = quantity("[-1e6, 1e6] N", "K, stiffness of a spring in parallel", 0.0)
    hardening: float = quantity(
        "[0, 200]", "1/x_h, reciprocal stretch at which K is twice as strong; 0 never", 0.0
    )


class Creep(ParameterGroup, group="creep"):
    """Spring and time constant of each Maxwell element; stiffness 0 is none."""

    stiffness: float = quantity("[0, 1e6] N", "k, force per sudden change of contraction", 0.0)
    relaxation_time: float = quantity(
        "[1e-3, 1e4] s", "tau, in which the force of a held contraction dies away", 1.0
    )
    stiffness_2: float = quantity("[0, 1e6] N", "k of the second element", 0.0)
    relaxation_time_2: float = quantity("[1e-3, 1e4] s", "tau of the second element", 10.0)


class FirstStroke(ParameterGroup, group="first_stroke"):
    """Force lost to the first stroke; 0 is none."""

    force: float = quantity("[0, 1e3] N", "F_1, lost where no stroke went further", 0.0)
    travel: float = quantity(
        "[1e-4, 0.5]", "d, contraction before the furthest point over which it sets in", 5e-3
    )


class Softening(ParameterGroup, group="softening"):
    """Force lost in the course of a run; share 0 is none, below it the muscle hardens."""

    share: float = quantity("[-0.9, 0.9]", "c, part of the force that is lost in the end", 0.0)
    time: float = quantity("[0.1, 1e5] s", "tau, in which it is lost", 100.0)


def tube_force(spring: PassiveSpring, contraction: float) -> float:
    """Force of the tube [N]: positive when stretched beyond the slack point.

    Without a spring in parallel it is -k/h at least.
    """
    stretch = spring.slack_contraction - contraction
    force = spring.stiffness * stretch
    if stretch <= 0.0:
        force = spring.stiffness / spring.softening * math.expm1(spring.softening * stretch)
    if spring.parallel != 0.0:
        force += _parallel_force(spring, stretch)
    return force


def _parallel_force(spring: PassiveSpring, stretch: float) -> float:
    share = stretch * spring.hardening
    return spring.parallel * stretch * (1.0 + share * share)


def tube_energy_and_slope(
    spring: PassiveSpring, contraction: float, force: float
) -> tuple[float, float]:
    """Energy that the tube stores, per nominal length [N], and the slope of its force [N].

    The slope is that by contraction. ``force`` is `tube_force` there [N].
    """
    stretch = spring.slack_contraction - contraction
    stored, slope = 0.0, -spring.stiffness
    if spring.parallel != 0.0:
        share = stretch * spring.hardening
        force -= _parallel_force(spring, stretch)
        stored = spring.parallel * stretch * stretch * (0.5 + 0.25 * share * share)
        slope -= spring.parallel * (1.0 + 3.0 * share * share)
    if stretch <= 0.0:
        stored += (force - spring.stiffness * stretch) / spring.softening
        return stored, slope - spring.softening * force
    return stored + 0.5 * force * stretch, slope


def locking_force(spring: PassiveSpring, contraction: float) -> float:
    """Force of a stretched braid beyond that of the tube [N], from kappa = 1 - l/l0 [-]; else 0.

    Beyond 95 % of the locking stretch it goes on along its tangent, finite for any step.
    """
    stretch = spring.slack_contraction - contraction
    if stretch <= 0.0:
        return 0.0
    share = stretch * spring.locking
    if not share > _TANGENT:  # NaN stays NaN, with a braid that never locks as well
        return spring.stiffness * stretch * share * share / (1.0 - share * share)
    room = 1.0 - _TANGENT * _TANGENT
    edge = _TANGENT / spring.locking
    slope = (1.0 + _TANGENT * _TANGENT) / (room * room)
    return spring.stiffness * (edge / room + slope * (stretch - edge) - stretch)


def first_stroke_force(first: FirstStroke, contraction: float, furthest: float) -> float:
    """Force that a first stroke takes [N], at a contraction and its furthest before [-]."""
    share = 1.0 + (contraction - furthest) / first.travel
    if share > 1.0:
        return first.force
    return first.force * share if not share < 0.0 else 0.0  # NaN stays NaN


def creep_rate(
    contraction: float, relaxed_contraction: float, relaxation_time: float, timestep: float
) -> float:
    """Rate of a creep element's damper, kappa_d' = (kappa - kappa_d) / tau, over an Euler step.

    It takes kappa_d [-] in one step [s] to where it is exactly if kappa stays: stable for every
    relaxation time tau [s].
    """
    return (contraction - relaxed_contraction) * -math.expm1(-timestep / relaxation_time) / timestep


def softening_rate(softening: Softening, softened: float, timestep: float) -> float:
    """Rate of w, (1 - w) / tau [1/s], that takes an Euler step [s] to where it is exactly."""
    return (1.0 - softened) * -math.expm1(-timestep / softening.time) / timestep
