"""What a user may choose of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.limits import ALPHA, LEAST, MATERIAL, Limits
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


def refuse_zero(nuisance: Mapping[str, float]) -> None:
    """Refuse nuisance parameters, name -> value [SI], that are 0: they vary by a factor.

    Raises:
        InputError: for the first that is 0.
    """
    for name, value in nuisance.items():
        if value == 0.0:
            raise InputError(
                f"`nuisance` {name} is 0, so that a relative change has no effect; leave it out,"
                " or state another value in params.toml"
            )


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a diagnosis, as `pamsim.diagnosis.diagnose.diagnose` takes them.

    Empty ones are chosen by rule, and the usual nuisance parameters are those of data and rig.

    Raises:
        InputError: for a seed below 0, or limits that nothing can be judged by.
    """

    effects: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    nuisance: tuple[str, ...] = ()
    hold_out: tuple[str, ...] = ()
    alpha: float = ALPHA
    material: float = MATERIAL
    learn: bool = True
    seed: int = 0
    threads: int | None = None
    progress: Progress | None = None

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(f"`seed` is {self.seed}; it must be 0 or above")
        _ = self.limits  # which refuses what it cannot be

    @property
    def limits(self) -> Limits:
        """From which an effect is claimed, and material; a remainder below that counts neither."""
        least = max(LEAST, self.material)
        return Limits(alpha=self.alpha, material=self.material, least=least)


AS_USUAL = Options()
