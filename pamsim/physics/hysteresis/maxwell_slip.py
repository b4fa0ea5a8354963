"""Maxwell-slip friction: springs in parallel, each dragging a block with Coulomb friction.

Element k stretches with the input until its deflection reaches its slip limit Delta_k, and then
drags its block along: force share_k (x - x_k) / Delta_k, with the block's position x_k a play
operator of threshold Delta_k (Iwan 1966; Goldfarb and Celanovic 1997; for pneumatic muscles Vo-Minh
et al. 2011). It is rate-independent, has return-point memory, obeys Masing's rules and is passive.

With springs that are not linear the sum is a Prandtl-Ishlinskii operator with dead zones on the
stops (Kuhnen 2003), whose loops need not be symmetric: over its relative stretch e, up to +-1, a
spring of dead zone r and asymmetry a pulls with

    s(e) = (1 + a sign(e)) max(|e| - r, 0) / (1 - r)

of the force that it would have at its limit. It stays passive, as every spring holds what it takes.

A muscle's own operator is what was fitted or assumed for its rig. Hysteresis that is missing beside
it adds to its force, whatever the formulas: `ParallelHysteresis`, whose blocks have places in every
muscle's state, so that it can be added to a compiled model.
"""

from __future__ import annotations

import math
from types import MappingProxyType

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row

BLOCKS = 5
"""Number of elements of the one in parallel."""


class MaxwellSlip(Hysteresis, law="maxwell_slip", count_field="elements"):
    """Slip limits Delta_k = full_slip k/n, force shares in the ratio 1 : decay : decay^2 ..."""

    usual = MappingProxyType({"elements": 8.0, "full_slip": 0.01})
    elements: float = quantity("[1, 64]", "number n of elements")
    full_slip: float = quantity("(0, 0.5]", "contraction at which every block slips")
    decay: float = quantity(
        "[0.1, 10]", "ratio of the shares of neighbours, late slipping over early", 1.0
    )


class ParallelHysteresis(ParameterGroup, group="parallel_hysteresis"):
    """Half-width of its loop, without and with pressure; both 0 turn it off."""

    force: float = quantity("[0, 1e3] N", "half-width of the loop, without pressure", 0.0)
    force_per_pressure: float = quantity("[0, 1e-2] N/Pa", "half-width per gauge pressure", 0.0)
    chord: float = quantity(
        "[0, 1e3]",
        "output per contraction taken off, so that the loop lies about the static curve",
        0.0,
    )
    full_slip: float = quantity("(0, 0.5]", "contraction at which every block slips", 0.01)
    decay: float = quantity(
        "[0.1, 10]", "ratio of the shares of neighbours, late slipping over early", 1.0
    )
    asymmetry: float = quantity(
        "[-0.9, 0.9]",
        "a: the springs pull 1 + a times as much against contraction, 1 - a times as much against"
        " lengthening",
        0.0,
    )
    dead_zone: float = quantity(
        "[0, 0.9]", "share of its slip limit by which a spring may be stretched without force", 0.0
    )


def play(x: float, held: float, threshold: float) -> float:
    """Output of the play operator (backlash), which is also its new memory, in the unit of x.

    The memory z follows the input x at a threshold r >= 0, half the dead travel:
    z+ = max(x - r, min(x + r, z)) (Krasnosel'skii and Pokrovskii 1989; Brokate and Sprekels 1996).
    x - z is the stop operator, an elastic-ideally plastic element. NaN stays NaN.
    """
    if held < x - threshold:
        return x - threshold
    if held > x + threshold:
        return x + threshold
    return x if math.isnan(x) else held


def slip_output_and_energy(
    elements: int, full_slip: float, decay: float, z: Row, at: int, x: float
) -> tuple[float, float]:
    """Sum of the elements' forces over the largest possible (Iwan 1966), and energy [contraction].

    The force is 1 once all slip forward. Of the fields of `MaxwellSlip`, states z that hold the
    positions of the blocks x_k [contraction], the place of the first, and the contraction x [-].
    """
    share, shares, force, energy = 1.0, 0.0, 0.0, 0.0
    for k in range(elements):
        slip = full_slip / elements * (k + 1)
        stretch = x - play(x, z[at + k], slip)
        force += share * stretch / slip
        energy += 0.5 * share * stretch * stretch / slip
        shares += share
        share *= decay
    return force / shares, energy / shares


def bent_slip_output_and_energy(
    elements: int,
    full_slip: float,
    decay: float,
    asymmetry: float,
    dead_zone: float,
    z: Row,
    at: int,
    x: float,
) -> tuple[float, float]:
    """`slip_output_and_energy` with springs of an asymmetry and a dead zone in [0, 1).

    The force is 1 + asymmetry once all slip forward, and minus 1 - asymmetry once all slip back, a
    share of the largest [-]; the energy is in [contraction].
    """
    share, shares, force, energy = 1.0, 0.0, 0.0, 0.0
    for k in range(elements):
        slip = full_slip / elements * (k + 1)
        stretch = (x - play(x, z[at + k], slip)) / slip
        pulled = max(abs(stretch) - dead_zone, 0.0) / (1.0 - dead_zone)
        side = 1.0 + asymmetry * math.copysign(1.0, stretch)
        force += share * side * math.copysign(pulled, stretch)
        energy += 0.5 * share * side * slip * (1.0 - dead_zone) * pulled * pulled
        shares += share
        share *= decay
    return force / shares, energy / shares


def slip_rates(
    elements: int, full_slip: float, z: Row, dz: MutableRow, at: int, x: float, timestep: float
) -> None:
    """Write to dz the rates [1/s] that drag every block to where x leaves it in a time step [s]."""
    for k in range(elements):
        slip = full_slip / elements * (k + 1)
        dz[at + k] = (play(x, z[at + k], slip) - z[at + k]) / timestep


def maxwell_slip_output(h: MaxwellSlip, z: Row, x: float) -> float:
    """Output w in [-1, 1], a pure number, of blocks at the positions z."""
    return slip_output_and_energy(int(h.elements), h.full_slip, h.decay, z, 0, x)[0]


def maxwell_slip_energy(h: MaxwellSlip, z: Row, x: float) -> float:
    """Energy in the springs [contraction]."""
    return slip_output_and_energy(int(h.elements), h.full_slip, h.decay, z, 0, x)[1]


def maxwell_slip_rates(
    h: MaxwellSlip, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the blocks' rates [1/s], see `slip_rates`."""
    slip_rates(int(h.elements), h.full_slip, z, dz, 0, x, timestep)


CARD = Operator(
    name="maxwell_slip",
    title="Maxwell slip",
    equation="w = sum share_k (x - play(x; Delta_k)) / Delta_k, Delta_k = full_slip k/n",
    source="Iwan 1966; Vo-Minh et al. 2011 for pneumatic muscles",
    group=MaxwellSlip,
    output=maxwell_slip_output,
    energy=maxwell_slip_energy,
    rates=maxwell_slip_rates,
    rate_independent=True,
    odd=True,
    notes="Zero memory is the state with every spring relaxed at x = 0.",
)
