"""An effect on a given rig: ranges, neutral values and probes of its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pamsim.effects.effect import Effect
from pamsim.inference.free_parameter import FreeParameter

INSIDE = 1e-3
"""Distance of starts from the ends of a range, as a share of it: friction at 0 has no gradient."""

AT_END = 0.01
"""Distance from an end of a range within which a fit has ended there, as a share of the end: fits
end that near an end as they close in on it."""


def inside(parameters: Sequence[FreeParameter], values: Mapping[str, float]) -> dict[str, float]:
    """Values by name [SI] moved into the parameters' ranges and off the ends."""
    moved: dict[str, float] = {}
    for parameter in parameters:
        off = INSIDE * (parameter.high - parameter.low)
        value = values[parameter.name]
        moved[parameter.name] = min(max(value, parameter.low + off), parameter.high - off)
    return moved


@dataclass(frozen=True, kw_only=True)
class Probe:
    """Values of an effect's parameters at which its signature is computed."""

    size: float  # in units of the effect's typical one
    values: dict[str, float]  # rig parameter -> value [SI]
    shape: tuple[float, ...] = ()  # numbers without influence while the effect is absent, in order

    def same_shape(self, other: Probe) -> bool:
        """Whether the two differ in size only."""
        return self.shape == other.shape


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that a rig's model may be missing."""

    effect: Effect  # which
    # Ranges of what it frees, under the rig's names; the one that measures its size first
    parameters: tuple[FreeParameter, ...]
    # Values at which it is absent [SI]; none for numbers without influence then
    neutral: dict[str, float]
    probes: tuple[Probe, ...]  # values at which its signature is computed
    usual: bool = True  # whether this is the form that is taken unless another is better by far

    @property
    def name(self) -> str:
        """Name of the effect and its place, the same for all of its forms."""
        return self.effect.claim

    @property
    def label(self) -> str:
        """Name, form and place, such as ``coulomb_friction:dahl``."""
        return self.effect.label

    @property
    def family(self) -> str:
        """Family of the effect."""
        return self.effect.family

    @property
    def two_sided(self) -> bool:
        """Whether the effect may have either sign."""
        size = self.parameters[0]
        return size.low < self.neutral[size.name] < size.high

    def at_end(self, values: Mapping[str, float]) -> bool:
        """Whether values [SI] lie at an end of a range beyond which rigs may lie."""
        return any(
            not stated.natural_ends
            and end not in (0.0, self.neutral.get(own.name))
            and abs(values[own.name] - end) <= AT_END * abs(end)
            for own, stated in zip(self.parameters, self.effect.parameters, strict=True)
            for end in (own.low, own.high)
        )

    def moved(self, probe: Probe, factor: float) -> dict[str, float]:
        """A probe with its size times a factor, within the ranges and off their ends.

        Returns:
            Rig parameter -> value [SI].
        """
        moved: dict[str, float] = {}
        for parameter in self.parameters:
            value = probe.values[parameter.name]
            if parameter.name in self.neutral:
                neutral = self.neutral[parameter.name]
                value = neutral + factor * (value - neutral)
            moved[parameter.name] = value
        return inside(self.parameters, moved)
