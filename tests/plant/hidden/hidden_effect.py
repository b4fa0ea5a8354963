"""What a hidden effect is: a change of the plant, and its size in physical terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from pamsim.effects.catalog import EFFECTS
from pamsim.recordings.recording import Recording
from tests.plant.read_rig import Numbers
from tests.plant.run import Timing


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number with its unit."""

    value: float
    unit: str


Quantities: TypeAlias = Mapping[str, Quantity]
Own: TypeAlias = Callable[[str], float]
"""A rig's own value of a parameter by its name [SI]."""


@dataclass(frozen=True, kw_only=True)
class PlantEffect:
    """An effect that the plant can have and a rig's model does not.

    Attributes:
        name: of the effect.
        formulation: the law in words, for the ground truth.
        stands_for: effects of the library that are right names for it; none for an effect from
            outside the library.
        resembles: further effects of the library that it cannot be distinguished from in most
            data, although none of them is its cause.
        family: of the library that an effect from outside it belongs to; empty if to none, or where
            right names tell it.
        unit: of its size.
        typical: size [unit].
        change: plant and size to the plant with the effect; in place.
        timing: size and random seeds of a run to what makes its commands late.
        sensed: recording and size to what the sensors report.
        measure: plant with the effect, the same without, and size, to its size in physical terms.
        library: size, `measure`'s result and a rig's own values, to the values that parameters of
            the library take if they mean the same [SI]; names as in `pamsim.effects`.
        signed: whether sizes below 0 have a meaning.
    """

    name: str
    formulation: str
    stands_for: tuple[str, ...] = ()
    resembles: tuple[str, ...] = ()
    family: str = ""
    unit: str
    typical: float
    change: Callable[[Numbers, float], None] | None = None
    timing: Callable[[float, tuple[int, ...]], Timing] | None = None
    sensed: Callable[[Recording, float], Recording] | None = None
    measure: Callable[[Numbers, Numbers, float], Quantities]
    library: Callable[[float, Quantities, Own], Mapping[str, float]] = lambda *_: {}
    signed: bool = False

    @property
    def families(self) -> tuple[str, ...]:
        """Families of the library that are right names for its cause; none for what is in none."""
        own = (self.family,) if self.family else ()
        return tuple(dict.fromkeys((*own, *(EFFECTS[name].family for name in self.stands_for))))


def stated(name: str, unit: str) -> Callable[[Numbers, Numbers, float], Quantities]:
    """The measure of an effect whose size is a physical quantity already."""

    def measure(_: Numbers, __: Numbers, size: float) -> Quantities:
        return {name: Quantity(value=size, unit=unit)}

    return measure
