"""What a hidden effect is: a change of the plant, and its size in physical terms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from pamsim.effects.catalog import EFFECTS
from pamsim.recordings.recording import Recording
from tests.plant.read_rig import Numbers
from tests.plant.run import Timing


@dataclass(frozen=True)
class Quantity:
    """A number with its unit."""

    value: float
    unit: str


Quantities: TypeAlias = Mapping[str, Quantity]
Change: TypeAlias = Callable[[Numbers, float], None]
Fields: TypeAlias = Callable[[float], Mapping[str, float]]  # size to field of a record -> its value
Own: TypeAlias = Callable[[str], float]  # a rig's own value of a parameter by its name [SI]


@dataclass(frozen=True, kw_only=True)
class PlantEffect:
    """An effect that the plant can have and a rig's model does not.

    Attributes:
        formulation: the law in words, for the ground truth.
        stands_for: effects of the library that are right names for it; none from outside of it.
        resembles: further effects of the library that it cannot be distinguished from in most
            data, although none of them is its cause.
        family: of the library that an effect from outside it belongs to; empty if to none, or where
            right names tell it.
        typical: size [unit].
        change: plant and size to the plant with the effect; in place.
        timing: size and random seeds of a run to what makes its commands late.
        sensed: recording and size to what the sensors report.
        stated: name of the physical quantity that its size is, where it is one.
        measure: else plant with the effect, the same without, and size, to its size in physical
            terms.
        equals: parameter of the library whose value its size is; names as in `pamsim.effects`.
        library: else size, size in physical terms and a rig's own values, to those of the
            library's parameters that mean the same [SI].
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
            return {self.stated: Quantity(size, self.unit)}
        return self.measure(there, without, size)

    def in_library(self, size: float, found: Quantities, own: Own) -> Mapping[str, float]:
        """Parameter of the library -> value that means the same [SI]."""
        return {self.equals: size} if self.equals else self.library(size, found, own)


def on_joint(size_of: str | Fields, **others: float) -> Change:
    """The change that sets fields of the joint's record: one to the size, and others besides."""

    def change(n: Numbers, size: float) -> None:
        for name, value in _values(size_of, size, others):
            n.joint[name] = value

    return change


def on_muscles(size_of: str | Fields, which: slice = slice(None), **others: float) -> Change:
    """The same of the muscles' records, of all or of some."""

    def change(n: Numbers, size: float) -> None:
        for name, value in _values(size_of, size, others):
            n.muscles[name][which] = value

    return change


def _values(
    size_of: str | Fields, size: float, others: Mapping[str, float]
) -> Iterable[tuple[str, float]]:
    own = {size_of: size} if isinstance(size_of, str) else size_of(size)
    return {**own, **others}.items()
