"""What an independent model of a hidden effect is made of, and how a run steps several of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import mujoco

from pamsim.core.recording import Recording
from pamsim.engine.rig import Rig
from pamsim.twins.independent_models.plant import Plant, RunContext

Law: TypeAlias = Callable[[Plant], None]
"""Acts on the plant before a time step; a law with memory is created for every run."""


@dataclass(frozen=True, kw_only=True)
class IndependentModel:
    """A hidden effect by a formula of its own.

    Attributes:
        name: of the library effect that it formulates differently, or its own name if the library
            has no such effect.
        formulation: the law in words, for the ground truth.
        parameters: rig and size to the rig parameters that it changes [SI].
        law: size and run to what acts at every time step.
        measured: recording and size to the recording that the sensors give.
        signed: whether sizes below 0 have a meaning.
        resembles: of an effect from outside the library, the library effects that it resembles.
    """

    name: str
    formulation: str
    parameters: Callable[[Rig, float], Mapping[str, float]] | None = None
    law: Callable[[float, RunContext], Law] | None = None
    measured: Callable[[Recording, float], Recording] | None = None
    signed: bool = False
    resembles: tuple[str, ...] = ()


class StepHook:
    """The laws of one run, as `pamsim.simulate` takes them.

    Args:
        context: the run.
        laws: in the order in which they act.
    """

    def __init__(self, context: RunContext, laws: Sequence[Law]) -> None:
        self._context, self._laws = context, tuple(laws)
        self._plant: Plant | None = None

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Let every law act before a time step."""
        plant = self._plant
        if plant is None:
            plant = self._plant = Plant(self._context, model, data)
        else:
            plant.read_state()
        for law in self._laws:
            law(plant)
        plant.apply()
