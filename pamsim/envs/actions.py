"""Actions of the environments, and the commands that they give the muscles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

ON = 0.33
"""Commanded opening from which an on/off valve is opened."""


@dataclass(frozen=True)
class ActionKind:
    """How actions become commands: set points [Pa], or openings in [-1, 1].

    Attributes:
        command: what the muscles' control means then, see `pamsim.recordings.experiment`.
        quantities: of each muscle that its actions set; two of them are on/off valves.
    """

    command: str
    quantities: tuple[str, ...]

    @property
    def on_off(self) -> bool:
        """Whether the actions open and shut two on/off valves per muscle."""
        return len(self.quantities) == 2

    def space(self, muscles: int) -> gymnasium.Space[Any]:
        """Space of the actions of a rig with a number of muscles."""
        if self.on_off:
            return gymnasium.spaces.MultiBinary(2 * muscles)
        return gymnasium.spaces.Box(-1.0, 1.0, (muscles,), np.float32)

    def commands(self, action: Any, shape: tuple[int, int], supply: float) -> FloatArray:
        """Commands (n, m) of actions (n, ...), for a shape (n, m) and a supply pressure [Pa].

        Raises:
            InputError: if an action has another shape, is not a finite number or, for on/off
                valves, neither 0 nor 1.
        """
        wanted = (shape[0], shape[1] * len(self.quantities))
        given = as_array(action)
        if given.shape != wanted or given.dtype.kind not in "fiub":
            raise InputError(
                f"actions of shape {given.shape} and type {given.dtype}: this environment takes"
                f" {wanted[1]} numbers" + (f" for each of {wanted[0]} rigs" * (wanted[0] > 1))
            )
        valid = (given == 0) | (given == 1) if self.on_off else np.isfinite(given)
        if not valid.all():
            wrong = int(np.argmin(valid))
            instead = "give finite numbers; beyond -1 and 1 they count as -1 and 1"
            raise InputError(
                f"action {given.flat[wrong]} at place {wrong % wanted[1]} is no action:"
                f" {'an on/off valve takes 0 or 1' if self.on_off else instead}"
            )
        numbers = given.astype(float)
        if self.on_off:
            # An interlock, not a short circuit from supply to exhaust: both on is both shut.
            return numbers[:, ::2] - numbers[:, 1::2]
        opening = np.minimum(np.maximum(numbers, -1.0), 1.0)
        return 0.5 * supply * (opening + 1.0) if self.command == "pressure_set" else opening

    def action(self, command: Sequence[float], supply: float) -> NDArray[np.generic]:
        """The action of one rig that gives its muscles a command; on/off valves open from `ON`."""
        wanted = np.array(command)
        if self.on_off:
            return np.column_stack([wanted > ON, wanted < -ON]).ravel().astype(np.int8)
        if self.command == "pressure_set":
            wanted = wanted / (0.5 * supply) - 1.0
        return wanted.astype(np.float32)

    def rest(self, pressure: FloatArray) -> FloatArray:
        """The commands that leave muscles at rest at gauge pressures [Pa]."""
        return pressure if self.command == "pressure_set" else np.zeros_like(pressure)


def as_array(action: Any) -> NDArray[Any]:
    """An action as an array, of objects if it is none."""
    try:
        return np.asarray(action)
    except ValueError:
        return np.array(action, dtype=object)


KINDS: Mapping[str, ActionKind] = MappingProxyType(
    {
        "pressure_set": ActionKind("pressure_set", ("pressure_set",)),
        "valve": ActionKind("valve", ("valve",)),
        "on_off": ActionKind("valve", ("fill", "vent")),
    }
)
"""Pressure set points, continuous valves, an on/off valve to fill and one to vent per muscle."""
