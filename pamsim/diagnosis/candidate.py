"""An effect on a given rig: what a search may do with its parameters."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.effects.effect import Effect
from pamsim.sysid.free_parameter import FreeParameter


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that a rig's model may lack.

    Attributes:
        effect: which.
        parameters: ranges of what it frees, under the rig's names; the one that measures its size
            first.
        neutral: values at which it is absent [SI]; none for numbers that mean nothing then.
        probes: values at which its signature is taken, with their sizes.
        starts: values that a fit begins from; none lies on a bound, where friction has no slope.
    """

    effect: Effect
    parameters: tuple[FreeParameter, ...]
    neutral: dict[str, float]
    probes: tuple[tuple[float, dict[str, float]], ...]
    starts: tuple[dict[str, float], ...]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @property
    def family(self) -> str:
        """Family of the effect."""
        return self.effect.family
