"""What every hysteresis operator shares: its card, its parameters, how its output enters the force.

An operator gives a pure number w, about in [-1, 1], that *leads* the contraction: over a closed
cycle the integral of w d(kappa) is not negative. It enters the muscle force as
F = F_static - (force + force_per_pressure p + force_share F_static) w, so with these three factors
positive a cycle costs energy and never yields any.

A spring that is loaded at low pressure and unloaded at high pressure would give energy. So what the
memory holds, (force + force_per_pressure p) l0 psi with psi the operator's energy, belongs to the
muscle's energy G(l, p), and the volume has the part -dG/dp = -force_per_pressure l0 psi. A
force_share has no such part: a cycle can yield up to force_share times its swings of pressure and
volume and the largest |w|.

An operator stiffens the muscle: its loop climbs along a chord. A force law that was fitted to the
mean of the branches holds that stiffness already, so the output is w - chord kappa, and psi loses
chord kappa^2 / 2: a spring, which takes and gives no energy over a cycle.

Three functions per operator run inside the engine. ``h`` is the operator's group, or the record of
its fields in a muscle's row; ``z[0:state_count]`` is the whole memory, and zeros are a valid start.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableSequence, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, TypeAlias

from pamsim.core.errors import InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.core.units import FloatArray

Row: TypeAlias = Sequence[float] | FloatArray
MutableRow: TypeAlias = MutableSequence[float] | FloatArray

Output: TypeAlias = Callable[[Any, Row, float], float]
Rates: TypeAlias = Callable[[Any, Row, MutableRow, float, float, float], None]


class Hysteresis(ParameterGroup, group="hysteresis"):
    """The three factors of an operator's output, all zero turns it off; and where its loop lies."""

    count_field: ClassVar[str] = ""
    """Field that counts elements with a state each; empty if the number of states is fixed."""
    usual: ClassVar[Mapping[str, float]] = MappingProxyType({})
    """The operator's own fields [SI] where a muscle gets it without stating them; of operators
    that a search may put into any muscle."""
    force: float = quantity("[0, 1e3] N", "force per output, without pressure", 0.0)
    force_per_pressure: float = quantity(
        "[0, 1e-2] N/Pa", "force per output and gauge pressure", 0.0
    )
    force_share: float = quantity("[0, 1]", "share of the static force per output", 0.0)
    chord: float = quantity(
        "[0, 1e3]",
        "output per contraction taken off, so that the loop lies about the static curve",
        0.0,
    )

    def __post_init__(self) -> None:
        """Check every field, and that the counting one is a whole number.

        Raises:
            ParameterError: naming field, value and what is allowed.
        """
        super().__post_init__()
        value = getattr(self, self.count_field) if self.count_field else 0.0
        if value != round(value):
            name = f"{self.group}.{self.count_field}"
            raise ParameterError(f"{name} = {value:g} is not a whole number")

    @property
    def state_count(self) -> int:
        """Number of states of this instance."""
        return int(getattr(self, self.count_field)) if self.count_field else self.states


@dataclass(frozen=True, kw_only=True)
class Operator:
    """One operator.

    Attributes:
        name: as in ``group.law``.
        title: for people.
        equation: in plain text.
        source: paper and equation, or standard literature.
        group: its parameters.
        output: of (h, z, x), w at contraction x, the memory brought up to date with x but not
            written.
        energy: of (h, z, x), psi [contraction], the part of the integral of w dx that the memory
            still holds: along any path w dx is never less than what it gains.
        rates: of (h, z, dz, x, x_rate, timestep), writes to dz what one explicit Euler step [s]
            must add per second for the memory to be brought up to date with x, which changes at
            x_rate [1/s].
        rate_independent: whether only the path of the input counts, not its speed.
        odd: whether the mirrored input, about the middle of the span where the group has one, gives
            the mirrored output.
        notes: what else a user must know.
    """

    name: str
    title: str
    equation: str
    source: str
    group: type[Hysteresis]
    output: Output
    energy: Output
    rates: Rates
    rate_independent: bool
    odd: bool
    notes: str = ""

    def __post_init__(self) -> None:
        """Check the group.

        Raises:
            InputError: if it is not one of an operator of this name.
        """
        if Hysteresis not in self.group.__mro__ or self.group.law != self.name:
            raise InputError(
                f"{self.group.__name__}: the parameters of the operator {self.name!r} derive from"
                f" Hysteresis and have law = {self.name!r}"
            )

    @property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """The functions that the kernel calls."""
        return self.output, self.energy, self.rates
