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
from pamsim.numba_cache import numba

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
            shown = given.shape[1:] if shape[0] == 1 and given.ndim > 1 else given.shape
            raise InputError(
                f"actions of shape {shown} and type {given.dtype}: this environment takes"
                f" {wanted[1]} numbers" + (f" for each of {wanted[0]} rigs" * (wanted[0] > 1))
            )
        command = np.empty(shape)
        wrong = _fill(given, self.command == "pressure_set", 0.5 * supply, command)
        if wrong >= 0:
            instead = "a number in [-1, 1], to which larger ones are clipped"
            raise InputError(
                f"action[{wrong % wanted[1]}] = {given.flat[wrong]}; give"
                f" {'0 or 1 for an on/off valve' if self.on_off else instead}"
            )
        return command

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


@numba.njit(cache=True, nogil=True)
def _fill(action, pressures, half, command):
    """Write the commands of actions -> place of the first that is none, -1 if all are."""
    muscles, columns = command.shape[1], action.shape[1]
    for place in range(action.size):
        rig, column = divmod(place, columns)
        given = np.float64(action[rig, column])
        if columns > muscles:
            if given != 0.0 and given != 1.0:
                return place
            # An interlock, not a short circuit from supply to exhaust: both on is both shut.
            if column % 2:
                command[rig, column // 2] -= given
            else:
                command[rig, column // 2] = given
        else:
            if not np.isfinite(given):
                return place
            opening = min(max(given, -1.0), 1.0)
            command[rig, column] = half * (opening + 1.0) if pressures else opening
    return -1


KINDS: Mapping[str, ActionKind] = MappingProxyType(
    {
        "pressure_set": ActionKind("pressure_set", ("pressure_set",)),
        "valve": ActionKind("valve", ("valve",)),
        "on_off": ActionKind("valve", ("fill", "vent")),
    }
)
"""Pressure set points, continuous valves, an on/off valve to fill and one to vent per muscle."""
