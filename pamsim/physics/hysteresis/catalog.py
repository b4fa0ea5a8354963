"""Every hysteresis operator: its card."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from pamsim.core.catalog import Catalog
from pamsim.core.errors import InputError
from pamsim.physics.hysteresis.arctangent import (
    Arctangent,
    arctangent_energy,
    arctangent_output,
    arctangent_rates,
)
from pamsim.physics.hysteresis.bouc_wen import (
    BoucWen,
    bouc_wen_energy,
    bouc_wen_output,
    bouc_wen_rates,
)
from pamsim.physics.hysteresis.fractional_maxwell import (
    FractionalMaxwell,
    fractional_maxwell_energy,
    fractional_maxwell_output,
    fractional_maxwell_rates,
)
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Row
from pamsim.physics.hysteresis.maxwell_slip import (
    MaxwellSlip,
    maxwell_slip_energy,
    maxwell_slip_output,
    maxwell_slip_rates,
)
from pamsim.physics.hysteresis.pleated_factor import (
    PleatedFactor,
    pleated_factor_energy,
    pleated_factor_output,
    pleated_factor_rates,
)
from pamsim.physics.hysteresis.prandtl_ishlinskii import (
    PrandtlIshlinskii,
    prandtl_ishlinskii_energy,
    prandtl_ishlinskii_output,
    prandtl_ishlinskii_rates,
)
from pamsim.physics.hysteresis.preisach import (
    Preisach,
    preisach_energy,
    preisach_output,
    preisach_rates,
)

Output: TypeAlias = Callable[[Any, Row, float], float]
"""Output w [-] of fields h, memory z and input x, see `pamsim.physics.hysteresis.group`."""

Rates: TypeAlias = Callable[[Any, Row, MutableRow, float, float, float], None]
"""Writes the rates of the memory [1/s]: of h, z, dz, x, its rate and the time step."""


@dataclass(frozen=True, kw_only=True)
class Operator:
    """One operator.

    Attributes:
        name: as in ``group.law``.
        title: for people.
        equation: in plain text.
        source: paper and equation, or standard literature.
        group: its parameters.
        output: see `Output`.
        energy: integral of w dx that the memory still holds [contraction], arguments as `Output`:
            along any path w dx is never less than what it gains.
        rates: see `Rates`.
        rate_independent: whether only the path of the input counts, not its speed.
        odd: whether the mirrored input, about the middle of the span where the group has one, gives
            the mirrored output.
        notes: what else a user must know. Of all operators: force and force_per_pressure yield no
            energy over any closed cycle; force_share may, as much as
            `pamsim.physics.hysteresis.group` states.
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
        derived = Hysteresis in self.group.__mro__
        if not derived or self.group.law != self.name:
            raise InputError(
                f"{self.group.__name__}: the parameters of the operator {self.name!r} derive from"
                f" Hysteresis and have law = {self.name!r}"
            )

    @property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """The functions that the kernel calls."""
        return self.output, self.energy, self.rates


_ALL = (
    Operator(
        name="bouc_wen",
        title="Bouc-Wen",
        equation="dz/dt = x'/D (1 - |z|^n (sigma sign(z x') + 1 - sigma)), w = z",
        source="Ikhouane and Rodellar 2007, normalised form",
        group=BoucWen,
        output=bouc_wen_output,
        energy=bouc_wen_energy,
        rates=bouc_wen_rates,
        rate_independent=True,
        odd=True,
        notes="Small loops inside a large one do not close, they drift: no return-point memory and"
        " no wiping-out. Explicit Euler is rate-independent only as far as its steps are small"
        " against D.",
    ),
    Operator(
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
    ),
    Operator(
        name="prandtl_ishlinskii",
        title="Prandtl-Ishlinskii",
        equation="w = inverse of P[w] = w_0 w + sum w_k play(w; r_k) at the scaled contraction",
        source="Krejci and Kuhnen 2001; Kuhnen 2003",
        group=PrandtlIshlinskii,
        output=prandtl_ishlinskii_output,
        energy=prandtl_ishlinskii_energy,
        rates=prandtl_ishlinskii_rates,
        rate_independent=True,
        odd=True,
        notes="Does not saturate: it contains a spring, and beyond span w grows above 1.",
    ),
    Operator(
        name="preisach",
        title="Preisach",
        equation="w = (middle of the major loop - W) / its half width in the centre",
        source="Van Damme 2008, (5); Mayergoyz 2003",
        group=Preisach,
        output=preisach_output,
        energy=preisach_energy,
        rates=preisach_rates,
        rate_independent=True,
        odd=True,
        notes="The output goes in steps of the grid; odd but for inputs that hit a level exactly.",
    ),
    Operator(
        name="pleated_factor",
        title="Pleated-muscle factor",
        equation="w = W_fit(eps_s) - W[eps_s], eps_s = 2 (eps - low)/(high - low) - 1",
        source="Van Damme 2008, (5) to (7)",
        group=PleatedFactor,
        output=pleated_factor_output,
        energy=pleated_factor_energy,
        rates=pleated_factor_rates,
        rate_independent=True,
        odd=True,
        notes="force_share is the paper's delta; the paper trusts it for 7 % to 20 % contraction."
        " A cycle can yield up to delta |w| times its swings of pressure and volume.",
    ),
    Operator(
        name="arctangent",
        title="Arctangent branches",
        equation="y = k_0 atan(k_1 p + k_2) + k_3 on each branch; w = (middle - y) / half width",
        source="Alraouf 2025, (1) to (4); partial loops by Madelung's rules",
        group=Arctangent,
        output=arctangent_output,
        energy=arctangent_energy,
        rates=arctangent_rates,
        rate_independent=True,
        odd=False,
        notes="Zero memory is a muscle that comes from its lower end. Inner loops are images of the"
        " major one at their own scale, hence not congruent. A reversal beyond the remembered"
        " number of turning points runs back along its own branch.",
    ),
    Operator(
        name="fractional_maxwell",
        title="Fractional Maxwell",
        equation="F + beta^a D^a F = K_e beta^a D^a x as a sum of Maxwell branches",
        source="Nguyen 2024, (8) and (9); Gorenflo and Mainardi 1997",
        group=FractionalMaxwell,
        output=fractional_maxwell_output,
        energy=fractional_maxwell_energy,
        rates=fractional_maxwell_rates,
        rate_independent=False,
        odd=True,
        notes="Linear, so not limited to [-1, 1]: w = 1 is the instantaneous response to span.",
    ),
)

OPERATORS = Catalog(Operator, _ALL, slot="hysteresis.law", first=1)
"""Every operator by its name."""
