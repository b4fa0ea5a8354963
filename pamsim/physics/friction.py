"""Friction at the joint as forces on the tendon: one that sticks, and a smooth one at low speed.

Dry friction that sticks is the force of bristles which bend before they slip (Dahl 1968; LuGre of
Canudas de Wit et al. 1995). Its memory is that force f, a state of the muscle:

    f' = k (v - |v| f / g),   g = C + m T + B exp(-(v/v_s)^2) + D b,   k = (C + m T + B + D) / d

C is the same at every speed, B the breakaway force lost in sliding (Stribeck 1902), m the share of
the muscle's tension T, d the travel in which friction builds up. On the tendon acts f + t f' with
the damping time t of the bristles. With B = D = m = t = 0 this is Dahl's model. For constant v, T
and b a step is solved exactly.

Breakaway also grows with the time of rest, towards D more: of the bonds between the surfaces a
share b has formed, another state. They form as Kato et al. (1972) measured at rest, exponentially,
and break over a travel d_D, in which the contacts are renewed (Dieterich 1979):

    b' = (1 - b) / t_D - |v| b / d_D

In steady sliding b = 1 / (1 + t_D |v| / d_D) is left. As the first bonds break while the bristles
still bend, the joint breaks loose at less than C + D: at C + 0.6 D for C = 2 D and d_D = 5 d.

Two muscles of one chain on sprockets of radius r share the joint's friction: together they brake it
by the sum of r g. Dry friction at a joint of its own is ``frictionloss``, which the engine solves.

The smooth force at low speed has no memory and does not stick:

    f = F (v/v_s) exp((1 - (v/v_s)^2) / 2)

with its peak F at the speed v_s. At constant tension and with t = 0 all only dissipate energy.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity


class Friction(ParameterGroup, group="friction"):
    """Sizes of the friction; with its forces and its share 0 there is none."""

    stribeck_force: float = quantity("[0, 1e4] N", "F, peak of the friction at low speed", 0.0)
    stribeck_velocity: float = quantity(
        "[1e-5, 10] m/s", "v_s, tendon speed of the peak; limits the time step", 1e-2
    )
    coulomb_force: float = quantity("[0, 1e4] N", "C, dry friction at every speed", 0.0)
    breakaway_force: float = quantity(
        "[0, 1e4] N", "B, additional dry friction at rest, lost in sliding at v_s", 0.0
    )
    tension_share: float = quantity("[0, 1]", "m, dry friction per tension of the muscle", 0.0)
    dwell_force: float = quantity(
        "[0, 1e4] N", "D, additional dry friction after a long rest, lost over the travel d_D", 0.0
    )
    dwell_time: float = quantity(
        "[1e-3, 1e4] s", "t_D, time constant with which it grows at rest", 1.0
    )
    # Dieterich (1979) found 2e-6 to 1e-4 m, the more, the rougher the surfaces.
    dwell_travel: float = quantity(
        "[1e-8, 1e-2] m", "d_D, travel of the tendon that renews the contacts", 1e-4
    )
    presliding: float = quantity(
        "[1e-8, 1e-2] m",
        "d, travel of the tendon in which dry friction builds up; limits the time step",
        2e-5,
    )
    bristle_time: float = quantity(
        "[0, 1] s", "t, damping of the presliding travel over its stiffness", 0.0
    )

    @property
    def acts(self) -> bool:
        """Whether there is any friction along the tendon."""
        return self.stribeck_force > 0.0 or rubs(self)


def rubs(friction: Friction) -> bool:
    """Whether any of the friction is dry."""
    forces = friction.coulomb_force + friction.breakaway_force + friction.dwell_force
    return forces + friction.tension_share > 0.0


def bond_rate(friction: Friction, bonds: float, velocity: float, timestep: float) -> float:
    """Rate b' [1/s] which takes the bonds to where they are exactly after a time step [s]."""
    forming = 1.0 / friction.dwell_time
    changing = forming + abs(velocity) / friction.dwell_travel
    return (forming / changing - bonds) * -math.expm1(-changing * timestep) / timestep


def dry_friction(
    friction: Friction,
    force: float,
    pull: float,
    velocity: float,
    timestep: float,
    bonds: float = 0.0,
) -> float:
    """Force f of the bristles after a time step [N], that of the exact solution.

    0 where nothing is left to rub; not further from 0 than before or than the friction in sliding.
    Of f before the step [s], and in it the pull of the muscle, whose size is T [N], the velocity v
    of the tendon, positive where it lengthens [m/s], and the bonds b.
    """
    always = friction.coulomb_force + friction.tension_share * abs(pull)
    resting = always + friction.breakaway_force + friction.dwell_force
    if resting <= 0.0:
        return 0.0
    share = velocity / friction.stribeck_velocity
    sliding = always + friction.breakaway_force * math.exp(-share * share)
    sliding += friction.dwell_force * bonds
    if sliding <= 0.0:
        return 0.0
    slipped = -math.expm1(-resting / (sliding * friction.presliding) * abs(velocity) * timestep)
    if velocity < 0.0:
        sliding = -sliding
    return force + (sliding - force) * slipped


def stribeck_friction(friction: Friction, velocity: float) -> float:
    """Smooth force against the tendon's motion [N], of the sign of its velocity [m/s]."""
    share = velocity / friction.stribeck_velocity
    return friction.stribeck_force * share * math.exp(0.5 * (1.0 - share * share))


def stribeck_damping(friction: Friction) -> float:
    """Slope F sqrt(e) / v_s of the smooth friction at rest, its largest [N s/m]."""
    return friction.stribeck_force * math.exp(0.5) / friction.stribeck_velocity


def tendon_friction(
    friction: Friction,
    before: float,
    pull: float,
    velocity: float,
    timestep: float,
    bonds: float = 0.0,
) -> float:
    """All friction along the tendon against its lengthening [N], at the end of a time step.

    Dry friction at its beginning would give the bristles energy. Arguments as `dry_friction`.
    """
    force = 0.0
    if friction.stribeck_force > 0.0:
        force = stribeck_friction(friction, velocity)
    if rubs(friction):
        after = dry_friction(friction, before, pull, velocity, timestep, bonds)
        force += after + friction.bristle_time * (after - before) / timestep
    return force
