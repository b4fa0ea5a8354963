"""What tied models share although they name different effects: a family, and often its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from pamsim.diagnosis.physical_size import PhysicalSize


class TiedModel(Protocol):
    """A model of one effect or several that predicts as well as the others."""

    @property
    def members(self) -> Mapping[str, str]:
        """Its effects."""
        ...

    @property
    def family(self) -> str:
        """Their families, joined by ``+``."""
        ...

    @property
    def physical(self) -> Mapping[str, PhysicalSize]:
        """Quantity -> size."""
        ...


def shared_families(models: Sequence[TiedModel]) -> dict[str, dict[str, PhysicalSize]]:
    """Families that every one of some tied models has, and their sizes.

    Args:
        models: two or more, the best first.

    Returns:
        Family -> the quantities that all models have: the value of the best model, and an interval
        that contains those of all. Empty of models with several effects, where it is open whose
        size it would be.
    """
    if len(models) < 2:
        return {}
    shared = [
        family
        for family in models[0].family.split("+")
        if all(family in model.family.split("+") for model in models)
    ]
    single = all(len(model.members) == 1 for model in models)
    return {family: _sizes(models) if single else {} for family in shared}


def _sizes(models: Sequence[TiedModel]) -> dict[str, PhysicalSize]:
    """Quantities that all models have, over all of them."""
    best, *others = (model.physical for model in models)
    found: dict[str, PhysicalSize] = {}
    for name, size in best.items():
        sizes = [size, *(other[name] for other in others if name in other)]
        if len(sizes) < len(models):
            continue
        ends = [end for one in sizes for end in one.interval95 or ()]
        known = len(ends) == 2 * len(sizes)
        found[name] = PhysicalSize(
            value=size.value, unit=size.unit, interval95=(min(ends), max(ends)) if known else None
        )
    return found
