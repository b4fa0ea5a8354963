"""The effects of the catalog that angles at rest can show on a given rig."""

from __future__ import annotations

from collections.abc import Sequence

from pamsim.comparison.candidate import inside
from pamsim.comparison.effects_on_rig import at_size, candidate, rig_effect
from pamsim.core.errors import InputError
from pamsim.diagnosis.method.row_model import RowEffect
from pamsim.effects.catalog import ROW_EFFECTS
from pamsim.effects.effect import Effect
from pamsim.engine.rig import Rig

_SIZES = (1.0, 3.0, 6.0, -1.0, -3.0)  # of the typical one, at which fits begin


def effects_at_rest(
    rig: Rig, names: Sequence[str], freed: set[str]
) -> tuple[list[RowEffect], dict[str, str]]:
    """The effects that can be tried on a rig's angles at rest, and why others cannot.

    Args:
        rig: its model.
        names: of effects; all if left out.
        freed: parameters that are refitted with every effect.

    Raises:
        InputError: for an unknown effect.
    """
    acting: list[RowEffect] = []
    skipped: dict[str, str] = {}
    own = [effect.name for effect in rig.file.own.effects]
    for name in names or dict.fromkeys((*ROW_EFFECTS, *own)):
        chosen = rig_effect(rig, name)
        if chosen.invisible_at_rest:
            skipped[name] = chosen.invisible_at_rest
        else:
            try:
                row_effect = _row_effect(rig, chosen)
            except InputError as error:
                skipped[name] = str(error)
                continue
            if {p.name for p in row_effect.parameters} & freed:
                skipped[name] = "its parameter is a nuisance parameter, refitted with every effect"
            else:
                acting.append(row_effect)
    return acting, skipped


def _row_effect(rig: Rig, chosen: Effect) -> RowEffect:
    free = candidate(rig, chosen)
    starts = [at_size(rig, chosen, size) for size in _SIZES]
    starts += [
        {**starts[0], p.name: value}
        for p, parameter in zip(free.parameters, chosen.parameters, strict=True)
        for value in parameter.starts
    ]
    different: list[dict[str, float]] = []
    for start in starts:
        kept = inside(free.parameters, start)
        if kept not in different:
            different.append(kept)
    return RowEffect(
        name=chosen.claim,
        family=chosen.family,
        parameters=free.parameters,
        neutral=free.neutral,
        starts=tuple(different),
    )
