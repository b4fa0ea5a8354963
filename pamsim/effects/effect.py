"""What an effect is: the parameters that it frees, and how it is told from others.

A rig's model contains every effect at its neutral value, where it changes nothing. Hiding an effect
moves its parameters away from there; adding one frees them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

LAYERS = ("joint", "muscle", "pneumatic", "command", "transmission", "measurement")

JOINT = "{joint}"
"""Stands for the rig's output joint in the name of a parameter."""

TILTED = "{tilted}"
"""Stands for the body whose tilt says how gravity turns the arm."""


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One number of a rig that an effect frees.

    Attributes:
        name: as `pamsim.engine.rig.Rig.with_parameters` takes it, with `JOINT` and `TILTED`.
        typical: how far it lies from neutral in a typical case [SI], of either sign.
        low: smallest value a search may try [SI].
        high: largest [SI].
        neutral: value at which the effect is absent [SI]; None where that is the rig's own value.
        relative: True if ``typical``, ``low`` and ``high`` are factors of the rig's own value.
        shape: True for a number that means nothing while the effect is absent, such as a time
            constant; ``typical`` is then the value itself.
        starts: of a shape, further values a search begins from, as ``typical``.
        natural_ends: True if no rig can lie beyond the ends of the range, so that a fit that ends
            there may be right; elsewhere it is a sign that the effect stands for another one.
    """

    name: str
    typical: float
    low: float
    high: float
    neutral: float | None = 0.0
    relative: bool = False
    shape: bool = False
    starts: tuple[float, ...] = ()
    natural_ends: bool = False

    def at(self, size: float, own: float) -> float:
        """Value at a size of the effect [SI].

        Args:
            size: in units of the typical one; 0 is neutral.
            own: the rig's own value [SI].
        """
        if self.shape:
            return self.typical
        if self.relative:
            return own * (1.0 + size * (self.typical - 1.0))
        return (own if self.neutral is None else self.neutral) + size * self.typical

    def bounds(self, own: float) -> tuple[float, float]:
        """Range a search may use [SI]; for what is neutral at the rig's own value, around it."""
        if self.relative:
            return own * self.low, own * self.high
        base = own if self.neutral is None else 0.0
        return base + self.low, base + self.high


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A physical effect.

    Attributes:
        name: as in diagnoses and on the command line.
        family: effects of one family look alike in most data.
        layer: one of `LAYERS`: where in the rig it acts.
        missing: what a model without it lacks, as a sentence's end: "the chain gives way".
        parameters: what it frees, the one that measures its size first.
        signature: what it leaves in the residuals.
        look_alikes: names of effects it is mistaken for.
        separating: the experiment that tells it from them.
        probes: sizes, in units of the typical one, at which its signature is taken: one small one,
            or, of an effect with a threshold, several, so that it binds at one of them.
    """

    name: str
    family: str
    layer: str
    missing: str
    parameters: tuple[EffectParameter, ...]
    signature: str
    look_alikes: tuple[str, ...]
    separating: str
    probes: tuple[float, ...] = (0.3,)

    def at(self, size: float, own: Mapping[str, float]) -> dict[str, float]:
        """Values of all its parameters at a size.

        Args:
            size: in units of the typical one; 0 is neutral.
            own: name of each parameter -> the rig's own value [SI].

        Returns:
            Name of each parameter -> value [SI].
        """
        return {p.name: p.at(size, own[p.name]) for p in self.parameters}
