"""What a foreign truth is made of, and how those of one run act together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import mujoco

from pamsim.core.recording import Recording
from pamsim.engine.rig import Rig
from pamsim.twins.independent_models.plant import Occasion, Plant

Law: TypeAlias = Callable[[Plant], None]
"""Acts on the plant before a time step; one that remembers is made anew for every run."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Something hidden in twin data.

    Attributes:
        name: of the effect it is another form of, or of its own if the library has none such.
        formulation: the law, in words, for the truth's file.
        parameters: rig and size to the rig parameters that it changes [SI].
        law: size and run to what acts at every time step.
        seen: recording and size to the recording that the sensors give.
        signed: whether a size below 0 means something.
        span: library effects in whose span it lies, for one from outside the library.
    """

    name: str
    formulation: str
    parameters: Callable[[Rig, float], Mapping[str, float]] | None = None
    law: Callable[[float, Occasion], Law] | None = None
    seen: Callable[[Recording, float], Recording] | None = None
    signed: bool = False
    span: tuple[str, ...] = ()


class Hook:
    """The laws of one run, as `pamsim.simulate` takes them.

    Args:
        occasion: the run.
        laws: in the order in which they act.
    """

    def __init__(self, occasion: Occasion, laws: Sequence[Law]) -> None:
        self._occasion, self._laws = occasion, tuple(laws)
        self._plant: Plant | None = None

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Let every law act before a time step."""
        plant = self._plant
        if plant is None:
            plant = self._plant = Plant(self._occasion, model, data)
        else:
            plant.look()
        for law in self._laws:
            law(plant)
        plant.act()
