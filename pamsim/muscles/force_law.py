"""What a force law is to the rest of the package: one signature for all of them.

A law is a set of scalar functions in its own file, which the actuator kernel calls and the engine
compiles. Here they are wrapped so that all take ``(pressure, contraction, coefficients, braid)``:
``coefficients`` are the fields of the law's parameter group in declared order, the scale first, and
``braid`` is the muscle's geometry, which some laws do not use. All scalar functions of a law
take their arguments in the same order: pressure (or force), contraction, the group's fields after
the scale, the braid numbers of `ForceLaw.braid_fields`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import TypeAlias

from pamsim.core.parameters import ParameterGroup
from pamsim.muscles.braid import Braid

Range: TypeAlias = tuple[float, float]
Scalars: TypeAlias = Callable[..., float]
"""A law's own function of scalars; each law has its own number of arguments."""
Uniform: TypeAlias = Callable[[float, float, Sequence[float], Braid], float]
"""The one signature of the catalog."""


@dataclass(frozen=True, kw_only=True)
class ForceLaw:
    """A force law: equation, source, range of validity, and functions.

    Attributes:
        title: name for a reader.
        equation: the law in plain text.
        source: paper and equation.
        group: parameter group; its ``law`` is the law's name.
        force_function: scalar force.
        dp_function: scalar dF/dp.
        dkappa_function: scalar dF/dkappa.
        pressure_function: scalar inverse p(F, kappa), or None if there is none.
        braid_fields: fields of `Braid` that the scalar functions take after the coefficients.
        pressure_range: gauge pressures for which the source claims validity [Pa]; None if the law
            holds at the one pressure it was fitted at.
        limits: contractions for which the source claims validity, from coefficients and braid.
        notes: what a user must know before relying on the law.
    """

    title: str
    equation: str
    source: str
    group: type[ParameterGroup]
    force_function: Scalars
    dp_function: Scalars
    dkappa_function: Scalars
    pressure_function: Scalars | None = None
    braid_fields: tuple[str, ...] = ()
    pressure_range: Range | None
    limits: Callable[[Sequence[float], Braid], Range]
    notes: str

    @property
    def name(self) -> str:
        """Name of the law in files."""
        return self.group.law

    @property
    def needs_braid(self) -> bool:
        """Whether the law uses the braid."""
        return bool(self.braid_fields)

    def force(
        self, pressure: float, contraction: float, coefficients: Sequence[float], braid: Braid
    ) -> float:
        """Force [N], positive when the muscle pulls, not limited to tension.

        Args:
            pressure: gauge pressure [Pa].
            contraction: kappa = 1 - l/l0 [-].
            coefficients: fields of `group` in declared order, the scale first [SI].
            braid: geometry.
        """
        rest = self._rest(coefficients, braid)
        return coefficients[0] * self.force_function(pressure, contraction, *rest)

    def force_dp(
        self, pressure: float, contraction: float, coefficients: Sequence[float], braid: Braid
    ) -> float:
        """Derivative dF/dp [N/Pa] of `force`, whose arguments it takes."""
        rest = self._rest(coefficients, braid)
        return coefficients[0] * self.dp_function(pressure, contraction, *rest)

    def force_dkappa(
        self, pressure: float, contraction: float, coefficients: Sequence[float], braid: Braid
    ) -> float:
        """Derivative dF/dkappa [N] of `force` at constant pressure, whose arguments it takes."""
        rest = self._rest(coefficients, braid)
        return coefficients[0] * self.dkappa_function(pressure, contraction, *rest)

    @property
    def inverse(self) -> Uniform | None:
        """Gauge pressure [Pa] from ``(force, contraction, coefficients, braid)``.

        None if the law has no inverse; the function itself gives NaN where it has none.
        """
        function = self.pressure_function
        if function is None:
            return None

        def pressure(
            force: float, contraction: float, coefficients: Sequence[float], braid: Braid
        ) -> float:
            rest = self._rest(coefficients, braid)
            return function(force / coefficients[0], contraction, *rest)

        return pressure

    def contraction_range(self, coefficients: Sequence[float], braid: Braid) -> Range:
        """Contractions for which the source claims validity, lowest and highest [-]."""
        return self.limits(coefficients, braid)

    def _rest(self, coefficients: Sequence[float], braid: Braid) -> tuple[float, ...]:
        geometry = (float(getattr(braid, name)) for name in self.braid_fields)
        return (*coefficients[1:], *geometry)


def coefficients_of(group: ParameterGroup) -> tuple[float, ...]:
    """A law's fields in declared order and in SI, as the functions of the catalog take them."""
    return astuple(group)
