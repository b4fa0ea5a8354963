"""What a user may choose of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.core.computation import Progress
from pamsim.engine.rig import Rig

NUISANCE = ("force.scale", "passive.locking", "chamber.dead_volume")
"""Numbers of rigs that are known to a few per cent only: they are refitted with every effect, so
that none is named for what they can do."""


def usual_nuisance(rig: Rig) -> tuple[str, ...]:
    """`NUISANCE` as far as a rig has it: the wall of bellows and pistons does not lock."""
    pushes = all(muscle.pushes for muscle in rig.muscles.values())
    return tuple(name for name in NUISANCE if not (pushes and name == "passive.locking"))


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a diagnosis, whatever its data; see `pamsim.diagnosis.diagnose.diagnose`.

    Attributes:
        effects: names of those that may be missing; all if empty.
        without: names of those that are not tried.
        nuisance: rig parameters that are refitted with every effect; the usual ones of data and
            rig if empty.
        hold_out: trials or protocols to judge by; chosen by rule if empty.
        seed: random seed.
        threads: simulations at a time; None for one per processor.
        progress: called as each fit begins.
    """

    effects: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    nuisance: tuple[str, ...] = ()
    hold_out: tuple[str, ...] = ()
    seed: int = 0
    threads: int | None = None
    progress: Progress | None = None
