"""Effects that rows at rest are searched for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from pamsim.comparison.candidate import Candidate, Probe, inside
from pamsim.comparison.effects_on_rig import at_size, candidates
from pamsim.effects.catalog import ROW_EFFECTS
from pamsim.engine.rig import Rig

_SIZE = 3.0
"""Size at which signatures are taken, in units of the typical one: the middle of those that tables
were fitted from before. Where a rig comes to rest depends on the whole of an effect and not on its
beginning, as of a braid that locks. Each further size would be free beside a further effect, and
leave few rows to show it."""


def candidates_at_rest(
    rig: Rig, names: Sequence[str], freed: Collection[str]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """The effects that can be tried on a rig's rows at rest, and why others cannot.

    Args:
        rig: its model.
        names: of effects; all if left out.
        freed: parameters that are refitted with every effect.

    Raises:
        InputError: for an unknown effect, or if nothing is left to try.
    """
    own = [effect.name for effect in rig.file.own.effects]
    tried, skipped = candidates(rig, list(names or dict.fromkeys((*ROW_EFFECTS, *own))))
    acting: list[Candidate] = []
    for one in tried:
        if one.effect.invisible_at_rest:
            skipped[one.effect.name] = one.effect.invisible_at_rest
        elif {p.name for p in one.parameters} & set(freed):
            skipped[one.effect.name] = (
                "its parameter is a nuisance parameter, refitted with every effect"
            )
        else:
            probes = tuple({p.shape: p for p in _probes(rig, one)}.values())
            acting.append(replace(one, probes=probes))
    return tuple(acting), skipped


def _probes(rig: Rig, one: Candidate) -> Iterator[Probe]:
    """Every shape at the size at which rows at rest show an effect."""
    for probe in one.probes:
        shapes = {p.name: probe.values[p.name] for p in one.parameters if p.name not in one.neutral}
        values = inside(one.parameters, {**at_size(rig, one.effect, _SIZE), **shapes})
        yield Probe(size=_SIZE, values=values, shape=probe.shape)
