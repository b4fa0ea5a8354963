"""Effects of a rig as sizes that can be moved: those it has, and those that it could have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pamsim.comparison.effects_on_rig import at_size, candidates
from pamsim.effects.effect import Effect
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.sensors import MeasurementChain


@dataclass(frozen=True, kw_only=True)
class MovableEffects:
    """Effects that change how a rig moves, in their usual form; errors of sensors do not.

    Attributes:
        rig: as it is.
        effects: name, with its place if there are several -> effect.
        sizes: name -> what the rig has of it, in units of its typical size.
    """

    rig: Rig
    effects: Mapping[str, Effect]
    sizes: Mapping[str, float]

    def at(self, sizes: Mapping[str, float]) -> Rig:
        """The rig with effects at other sizes, name -> size; 0 is without."""
        values: dict[str, float] = {}
        for name, size in sizes.items():
            if size != self.sizes[name]:
                values |= at_size(self.rig, self.effects[name], size)
        return self.rig.with_parameters(values)


def movable_effects(rig: Rig, names: Sequence[str] = ()) -> MovableEffects:
    """Effects of a rig that can be moved while it is simulated.

    Args:
        rig: its model.
        names: as `pamsim.comparison.effects_on_rig.rig_effect` takes them; all if left out.

    Raises:
        InputError: for a name that is not known.
    """
    effects: dict[str, Effect] = {}
    sizes: dict[str, float] = {}
    for one in candidates(rig, names)[0]:
        name, typical = next(iter(at_size(rig, one.effect, 1.0).items()))
        if name.startswith(f"{MeasurementChain.group}.") or not one.usual:
            continue
        neutral = at_size(rig, one.effect, 0.0)[name]
        effects[one.name] = one.effect
        has = rig_parameter(rig, name).value - neutral
        sizes[one.name] = has / (typical - neutral) if has else 0.0
    return MovableEffects(rig=rig, effects=effects, sizes=sizes)
