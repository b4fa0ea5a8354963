"""What a user may choose of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.core.computation import Progress
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig

NUISANCE = ("force.scale", "passive.locking", "chamber.dead_volume")
"""Numbers of rigs that are known to a few per cent only: they are refitted with every effect, so
that none is named for what they can do."""


def usual_nuisance(rig: Rig) -> tuple[str, ...]:
    """`NUISANCE` as far as a rig has it: the wall of bellows and pistons does not lock.

    A number that is 0 has no few per cent.
    """
    pushes = all(muscle.pushes for muscle in rig.muscles.values())
    has = [name for name in NUISANCE if not (pushes and name == "passive.locking")]
    return tuple(name for name in has if rig_parameter(rig, name).value != 0.0)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a diagnosis, as `pamsim.diagnosis.diagnose.diagnose` takes them.

    Empty ones are chosen by rule, and the usual nuisance parameters are those of data and rig.
    """

    effects: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    nuisance: tuple[str, ...] = ()
    hold_out: tuple[str, ...] = ()
    seed: int = 0
    threads: int | None = None
    progress: Progress | None = None


AS_USUAL = Options()
