"""Maxwell-slip friction: springs in parallel, each dragging a block with Coulomb friction.

Element k stretches with the input until its deflection reaches its slip limit Delta_k, and then
drags its block along: force share_k (x - x_k) / Delta_k, with the block's position x_k a play
operator of threshold Delta_k (Iwan 1966; Goldfarb and Celanovic 1997; for pneumatic muscles Vo-Minh
et al. 2011). It is rate-independent, has return-point memory, obeys Masing's rules and is passive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

from pamsim.core.parameters import parameter
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Row
from pamsim.physics.hysteresis.play import play


@dataclass(frozen=True, kw_only=True)
class MaxwellSlip(Hysteresis):
    """Slip limits Delta_k = full_slip k/n, force shares in the ratio 1 : decay : decay^2 ..."""

    law: ClassVar[str] = "maxwell_slip"
    count_field: ClassVar[str] = "elements"
    usual: ClassVar[Mapping[str, float]] = MappingProxyType({"elements": 8.0, "full_slip": 0.01})
    elements: float = parameter(unit="1", low=1.0, high=64.0, doc="number n of elements")
    full_slip: float = parameter(
        unit="1", low=0.0, high=0.5, low_open=True, doc="contraction at which every block slips"
    )
    decay: float = parameter(
        unit="1",
        low=0.1,
        high=10.0,
        doc="ratio of the shares of neighbours, late slipping over early",
        default=1.0,
    )


def slip_output(elements: int, full_slip: float, decay: float, z: Row, at: int, x: float) -> float:
    """Sum of the elements' forces over the largest possible (Iwan 1966).

    Args:
        elements: number n of them.
        full_slip: contraction at which every block slips [-].
        decay: ratio of the shares of neighbours, late slipping over early.
        z: states, among them the positions of the blocks x_k [contraction].
        at: place of the first block's in them.
        x: contraction [-].

    Returns:
        w in [-1, 1]; 1 once every block slips forward.
    """
    limit = full_slip / elements
    share = 1.0
    shares = 0.0
    total = 0.0
    for k in range(elements):
        slip = limit * (k + 1)
        total += share * (x - play(x, z[at + k], slip)) / slip
        shares += share
        share *= decay
    return total / shares


def slip_rates(
    elements: int,
    full_slip: float,
    z: Row,
    dz: MutableRow,
    at: int,
    x: float,
    timestep: float,
) -> None:
    """Write the rates that drag every block to where input x leaves it.

    Args:
        elements: number n of them.
        full_slip: contraction at which every block slips [-].
        z: states, among them the positions of the blocks [contraction].
        dz: of all states [1/s], of which the blocks' are written.
        at: place of the first block's.
        x: contraction [-].
        timestep: of the explicit Euler step [s].
    """
    limit = full_slip / elements
    for k in range(elements):
        dz[at + k] = (play(x, z[at + k], limit * (k + 1)) - z[at + k]) / timestep


def slip_energy(elements: int, full_slip: float, decay: float, z: Row, at: int, x: float) -> float:
    """Energy in the springs [contraction]; the arguments are those of `slip_output`."""
    limit = full_slip / elements
    share = 1.0
    shares = 0.0
    total = 0.0
    for k in range(elements):
        slip = limit * (k + 1)
        stretch = x - play(x, z[at + k], slip)
        total += 0.5 * share * stretch * stretch / slip
        shares += share
        share *= decay
    return total / shares


def maxwell_slip_output(h: MaxwellSlip, z: Row, x: float) -> float:
    """Output w in [-1, 1], see `slip_output` and `pamsim.physics.hysteresis.group`.

    Args:
        h: parameters.
        z: positions of the blocks [contraction].
        x: contraction [-].
    """
    return slip_output(int(h.elements), h.full_slip, h.decay, z, 0, x)


def maxwell_slip_rates(
    h: MaxwellSlip, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the blocks' dz, see `slip_rates`.

    Args:
        h: parameters.
        z: positions of the blocks [contraction].
        dz: (elements,) written [1/s].
        x: contraction [-].
        x_rate: not used; the operator does not know time.
        timestep: of the explicit Euler step [s].
    """
    slip_rates(int(h.elements), h.full_slip, z, dz, 0, x, timestep)


def maxwell_slip_energy(h: MaxwellSlip, z: Row, x: float) -> float:
    """Energy in the springs [contraction]; the arguments are those of `maxwell_slip_output`."""
    return slip_energy(int(h.elements), h.full_slip, h.decay, z, 0, x)
