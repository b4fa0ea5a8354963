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
Change: TypeAlias = Callable[[Numbers, float], None]
Fields: TypeAlias = Callable[[float], Mapping[str, float]]
"""Size of an effect to field of a plant's record -> its value."""
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
        stated: name of the physical quantity that its size is, where it is one.
        measure: else plant with the effect, the same without, and size, to its size in physical
            terms.
        equals: parameter of the library whose value its size is; names as in `pamsim.effects`.
        library: else size, size in physical terms and a rig's own values, to the values that
            parameters of the library take if they mean the same [SI].
        signed: whether sizes below 0 have a meaning.
    """

    name: str
    formulation: str
    stands_for: tuple[str, ...] = ()
    resembles: tuple[str, ...] = ()
    family: str = ""
    unit: str
    typical: float
    change: Change | None = None
    timing: Callable[[float, tuple[int, ...]], Timing] | None = None
    sensed: Callable[[Recording, float], Recording] | None = None
    stated: str = ""
    measure: Callable[[Numbers, Numbers, float], Quantities] | None = None
    equals: str = ""
    library: Callable[[float, Quantities, Own], Mapping[str, float]] = lambda *_: {}
    signed: bool = False

    @property
    def families(self) -> tuple[str, ...]:
        """Families of the library that are right names for its cause; none for what is in none."""
        own = (self.family,) if self.family else ()
        return tuple(dict.fromkeys((*own, *(EFFECTS[name].family for name in self.stands_for))))

    def measured(self, there: Numbers, without: Numbers, size: float) -> Quantities:
        """Its size in physical terms, of a plant with it and the same without."""
        if self.measure is None:
            return {self.stated: Quantity(value=size, unit=self.unit)}
        return self.measure(there, without, size)

    def in_library(self, size: float, found: Quantities, own: Own) -> Mapping[str, float]:
        """Parameter of the library -> value that means the same [SI]."""
        return {self.equals: size} if self.equals else self.library(size, found, own)


def on_joint(fields: Fields) -> Change:
    """The change that sets fields of the joint's record."""

    def change(n: Numbers, size: float) -> None:
        for name, value in fields(size).items():
            n.joint[name] = value

    return change


def on_muscles(fields: Fields, which: slice = slice(None)) -> Change:
    """The change that sets fields of the muscles' records, of all or of some."""

    def change(n: Numbers, size: float) -> None:
        for name, value in fields(size).items():
            n.muscles[name][which] = value

    return change
