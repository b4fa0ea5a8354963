"""What a force law is to the rest of the package: one card, with one signature, for all of them.

A law stands in a file of its own: parameter group, functions, and a card that the catalog lists. It
is two scalar functions, force and volume, which the actuator kernel calls and the engine compiles.
They belong together: a muscle without losses has one energy G(l, p) with F = dG/dl and V = -dG/dp,
so dV/dl = -dF/dp. A law may state the force alone: `swept_volume` and `swept_work` integrate it by
Gauss's rule with ten points, exact to rounding where the force is smooth in contraction.

The numbers of a law are pressure, contraction, the fields of the parameter group after the scale,
and those of `ForceLaw.braid_fields`. The force takes all of them in this order; other functions
take all, or some by their names. `ForceLaw.force` and `ForceLaw.volume` wrap them, so that every
law takes the same arguments.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Any, TypeAlias

from pamsim.core.errors import InputError
from pamsim.core.parameters import ParameterGroup, quantity, specs
from pamsim.physics.braid import Braid, volume

Range: TypeAlias = tuple[float, float]
Scalars: TypeAlias = Callable[..., float]
"""A law's own function of scalars; each law has its own number of arguments."""

FESTO_PRESSURES: Range = (0.0, 6e5)
"""Gauge pressures at which Festo's muscles were measured [Pa]."""

GAUSS = (
    (0.1488743389816312, 0.2955242247147529),
    (0.4333953941292472, 0.2692667193099963),
    (0.6794095682990244, 0.2190863625159820),
    (0.8650633666889845, 0.1494513491505806),
    (0.9739065285171717, 0.0666713443086881),
)
"""Nodes and weights of Gauss's rule with ten points on (-1, 1), those above 0."""

_APART = 10.0  # half of the step of a difference quotient by pressure [Pa]


class ForceParameters(ParameterGroup, group="force"):
    """What the parameters of every force law begin with."""

    scale: float = quantity("(0, 5]", "factor on the force", 1.0)


@dataclass(frozen=True, kw_only=True)
class ForceLaw:
    """A force law: equation, source, range of validity, and functions.

    Attributes:
        title: name for a reader.
        equation: the law in plain text.
        source: paper and equation.
        group: parameter group; its ``law`` is the law's name.
        force_function: scalar force.
        volume_function: scalar volume gained since nominal length, per nominal length [m^2]: the
            integral of dF/dp by contraction; if left out, `swept_volume` of the force.
        work_function: work of the force at one pressure from nominal length on, per nominal length
            [N]; without pressure times volume gained, which is added, where the force is linear in
            pressure. If left out there is no such part, or `swept_work` of a force that is not
            linear.
        derivatives_function: force, its derivatives by contraction and by pressure, volume and
            work, where they come cheaper together.
        braid_fields: fields of `Braid` that the scalar functions take after the coefficients.
        volume_varies: whether the volume changes with pressure at a held length, which it does
            unless the force is linear in pressure.
        pressure_range: gauge pressures for which the source claims validity [Pa]; None if the law
            holds at the one pressure it was fitted at.
        limits: contractions for which the source claims validity, or a function of coefficients
            and braid that gives them; 0 to 25 % if left out.
        notes: what a user must know before relying on the law.
        pushes: whether the force may push. Such an actuator is empty where its stroke is zero.
    """

    title: str
    equation: str
    source: str
    group: type[ParameterGroup]
    force_function: Scalars
    volume_function: Scalars = None  # pyright: ignore[reportAssignmentType]
    work_function: Scalars | None = None
    derivatives_function: Callable[..., tuple[float, float, float, float, float]] | None = None
    braid_fields: tuple[str, ...] = ()
    volume_varies: bool = True
    pressure_range: Range | None
    # Festo's DMSP muscles contract by 25 % at most (data sheet, Nguyen 2024, Sarosi).
    limits: Range | Callable[[Sequence[float], Braid], Range] = (0.0, 0.25)
    notes: str = ""
    pushes: bool = False

    def __post_init__(self) -> None:
        """Check the group, and integrate the volume from the force where it is not stated.

        Raises:
            InputError: if the group is not one of a force law, which begins with a scale, or the
                force takes the law's numbers in another order, or some of them alone.
        """
        first = next((name for name, _ in specs(self.group)), "")
        if self.group.group != "force" or not self.group.law or first != "scale":
            raise InputError(
                f"{self.group.__name__}: the parameters of a force law need group = 'force', a name"
                " as law, and scale as their first field"
            )
        taken = self.taken_by(self.force_function)
        if taken != self.numbers:
            raise InputError(
                f"{self.name}: the force takes {', '.join(taken)}; let it take"
                f" {', '.join(self.numbers)}, all in this order"
            )
        if self.volume_function is None:  # pyright: ignore[reportUnnecessaryComparison]
            object.__setattr__(self, "volume_function", swept_volume(self.force_function))
        if self.work_function is None and self.volume_varies:
            object.__setattr__(self, "work_function", swept_work(self.force_function))

    @property
    def functions(self) -> tuple[Scalars, ...]:
        """The functions that the kernel calls."""
        return self.force_function, self.volume_function

    @property
    def name(self) -> str:
        """Name of the law in files."""
        return self.group.law

    @functools.cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of all numbers that the law's functions may take, in order."""
        _, *fields = (name for name, _ in specs(self.group))
        return "pressure", "contraction", *fields, *self.braid_fields

    def taken_by(self, function: Callable[..., Any]) -> tuple[str, ...]:
        """Names of the `numbers` that a function of the law takes."""
        named = tuple(inspect.signature(function).parameters)
        # One that takes all of them by other names takes them in order.
        return named if set(named) <= set(self.numbers) else self.numbers

    def force(
        self, pressure: float, contraction: float, coefficients: Sequence[float], braid: Braid
    ) -> float:
        """Force [N], positive where it pulls, not limited to tension.

        The arguments are gauge pressure [Pa], contraction kappa = 1 - l/l0 [-], the fields of
        `group` in declared order, the scale first [SI], and the geometry.
        """
        rest = self._rest(coefficients, braid)
        return coefficients[0] * self.force_function(pressure, contraction, *rest)

    def volume(
        self, pressure: float, contraction: float, coefficients: Sequence[float], braid: Braid
    ) -> float:
        """Volume of the air in the muscle [m^3]: dV/dl = -dF/dp, at nominal length the braid's.

        The arguments are those of `force`.
        """
        nominal, rest = braid.nominal_length, self._rest(coefficients, braid)

        def gained(contraction: float) -> float:
            every = dict(zip(self.numbers, (pressure, contraction, *rest), strict=True))
            function = self.volume_function
            return function(*(every[name] for name in self.taken_by(function)))

        start = volume(nominal, nominal, braid.diameter, braid.fibre_angle)
        if self.pushes:
            start = -coefficients[0] * nominal * gained(1.0)
        return start + coefficients[0] * nominal * gained(contraction)

    def contraction_range(self, coefficients: Sequence[float], braid: Braid) -> Range:
        """Contractions for which the source claims validity, lowest and highest [-]."""
        return self.limits(coefficients, braid) if callable(self.limits) else self.limits

    def _rest(self, coefficients: Sequence[float], braid: Braid) -> tuple[float, ...]:
        return (*coefficients[1:], *(getattr(braid, name) for name in self.braid_fields))


def coefficients_of(group: ParameterGroup) -> tuple[float, ...]:
    """A law's fields in declared order and in SI, as the functions of the catalog take them."""
    return astuple(group)


def swept_volume(force: Scalars) -> Scalars:
    """Volume gained since nominal length, per nominal length [m^2]: the integral of dF/dp.

    The force [N] takes pressure [Pa], contraction [-], coefficients and geometry.
    """

    def volume(pressure: float, contraction: float, *rest: float) -> float:
        gained = 0.0
        for node, weight in GAUSS:
            for at in (0.5 - 0.5 * node, 0.5 + 0.5 * node):
                kappa = at * contraction
                rise = force(pressure + _APART, kappa, *rest)
                rise -= force(pressure - _APART, kappa, *rest)
                gained += weight * rise
        return 0.25 * gained * contraction / _APART

    return volume


def swept_work(force: Scalars) -> Scalars:
    """Work of a force at one pressure from nominal length on, per nominal length [N]."""

    def work(pressure: float, contraction: float, *rest: float) -> float:
        done = 0.0
        for node, weight in GAUSS:
            for at in (0.5 - 0.5 * node, 0.5 + 0.5 * node):
                done += weight * force(pressure, at * contraction, *rest)
        return 0.5 * done * contraction

    return work
