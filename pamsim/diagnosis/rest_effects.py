"""The effects of the catalog that angles at rest can show on a given rig."""

from __future__ import annotations

from collections.abc import Sequence

from pamsim.comparison.candidate import inside
from pamsim.comparison.effects_on_rig import at_size, candidate
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.row_model import RowEffect
from pamsim.effects.catalog import EFFECTS, effect
from pamsim.effects.effect import Effect
from pamsim.engine.rig import Rig

_SIZES = (1.0, 3.0, 6.0, -1.0, -3.0)  # of the typical one, at which fits begin


def effects_at_rest(
    rig: Rig, names: Sequence[str], freed: set[str]
) -> tuple[list[RowEffect], dict[str, str]]:
    """The effects that can be tried on a rig's angles at rest, and why others cannot.

    Args:
        rig: its model.
        names: of effects; all if there are none.
        freed: parameters that are refitted with every effect.

    Raises:
        InputError: for an unknown effect.
    """
    found: list[RowEffect] = []
    skipped: dict[str, str] = {}
    for name in names or EFFECTS:
        one = effect(name)
        if one.invisible_at_rest:
            skipped[name] = one.invisible_at_rest
        else:
            try:
                made = _row_effect(rig, one)
            except InputError as error:
                skipped[name] = str(error)
                continue
            if {p.name for p in made.parameters} & freed:
                skipped[name] = "its parameter is refitted with every effect"
            else:
                found.append(made)
    return found, skipped


def _row_effect(rig: Rig, one: Effect) -> RowEffect:
    made = candidate(rig, one)
    starts = [at_size(rig, one, size) for size in _SIZES]
    starts += [
        {**starts[0], free.name: value}
        for free, parameter in zip(made.parameters, one.parameters, strict=True)
        for value in parameter.starts
    ]
    different: list[dict[str, float]] = []
    for start in starts:
        kept = inside(made.parameters, start)
        if kept not in different:
            different.append(kept)
    return RowEffect(
        name=one.name,
        family=one.family,
        parameters=made.parameters,
        neutral=made.neutral,
        starts=tuple(different),
    )
