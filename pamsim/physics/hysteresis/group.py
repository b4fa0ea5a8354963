"""What every hysteresis operator shares: how its output enters the force, and its row of numbers.

An operator gives a pure number w, about in [-1, 1], that *leads* the contraction: over a closed
cycle the integral of w d(kappa) is not negative. It enters the muscle force as
F = F_static - (force + force_per_pressure p + force_share F_static) w, so with these three factors
positive a cycle costs energy and never yields any. Models that lag (Preisach, arctangent) are
reversed in their own files.

The pressure works on the volume, so a width that grows with pressure must show in it: a spring that
is loaded at low pressure and unloaded at high pressure would give energy. What the memory holds,
(force + force_per_pressure p) l0 psi with psi the operator's energy, belongs to the muscle's energy
G(l, p), and the volume has the part -dG/dp = -force_per_pressure l0 psi. No cycle of length and
pressure then yields energy. A force_share has no such part: a cycle can yield up to force_share
times its swings of pressure and volume and the largest |w|.

An operator stiffens the muscle: its loop climbs along a chord. A force law that was fitted to the
mean of the branches holds that stiffness already, so the output is w - chord kappa, and psi loses
chord kappa^2 / 2: a spring, which takes and gives no energy over a cycle.

Three functions per operator run inside the engine. ``h`` is the operator's group, or the record of
its fields in a muscle's row; ``z[0:state_count]`` is the whole memory, and zeros are a valid start:

- ``<op>_output(h, z, x)``: w at input x, the memory brought up to date with x but not written;
- ``<op>_energy(h, z, x)``: psi, the part of the integral of w dx that is held there;
- ``<op>_rates(h, z, dz, x, x_rate, timestep)``: what one explicit Euler step of ``timestep`` must
  add per second for the memory to be brought up to date with x.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import ParameterError
from pamsim.core.parameters import ParameterGroup, parameter

Row: TypeAlias = Sequence[float] | NDArray[np.float64]
MutableRow: TypeAlias = MutableSequence[float] | NDArray[np.float64]

COMMON_FIELDS = 4
"""Fields in front of an operator's own: force, force_per_pressure, force_share, chord."""


@dataclass(frozen=True, kw_only=True)
class Hysteresis(ParameterGroup):
    """The three factors of an operator's output, all zero turns it off; and where its loop lies."""

    group: ClassVar[str] = "hysteresis"
    count_field: ClassVar[str] = ""
    """Field that counts elements with a state each; empty if the number of states is fixed."""
    usual: ClassVar[Mapping[str, float]] = MappingProxyType({})
    """The operator's own fields [SI] where a muscle gets it without stating them; of operators
    that a search may put into any muscle."""
    force: float = parameter(
        unit="N", low=0.0, high=1e3, doc="force per output, without pressure", default=0.0
    )
    force_per_pressure: float = parameter(
        unit="N/Pa", low=0.0, high=1e-2, doc="force per output and gauge pressure", default=0.0
    )
    force_share: float = parameter(
        unit="1", low=0.0, high=1.0, doc="share of the static force per output", default=0.0
    )
    chord: float = parameter(
        unit="1",
        low=0.0,
        high=1e3,
        doc="output per contraction taken off, so that the loop lies about the static curve",
        default=0.0,
    )

    def __post_init__(self) -> None:
        """Check every field, and that the counting one is a whole number.

        Raises:
            ParameterError: naming field, value and what is allowed.
        """
        super().__post_init__()
        if self.count_field:
            value = float(getattr(self, self.count_field))
            if value != round(value):
                name = f"{self.group}.{self.count_field}"
                raise ParameterError(f"{name} = {value:g} is not a whole number")

    @property
    def state_count(self) -> int:
        """Number of states of this instance: one for each of what `count_field` counts."""
        return int(getattr(self, self.count_field)) if self.count_field else self.states
