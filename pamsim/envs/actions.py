"""Actions of the environments, and the commands that they give the muscles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import gymnasium
import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ActionKind:
    """How actions become commands.

    Attributes:
        name: of the kind.
        command: what the muscles' control means then, see `pamsim.core.experiment`.
        space: makes the space of one arm's action.
        commands: actions (n, ...) and supply pressure [Pa] -> commands (n, 2), set points [Pa] or
            openings in [-1, 1].
    """

    name: str
    command: str
    space: Callable[[], gymnasium.Space]
    commands: Callable[[NDArray[np.generic], float], FloatArray]

    def rest(self, pressure: float) -> float:
        """The command that leaves a muscle at rest at a gauge pressure [Pa]."""
        return pressure if self.command == "pressure_set" else 0.0

    def span(self, supply: float) -> float:
        """Change of command that counts as 1 in the reward's effort."""
        return 0.5 * supply if self.command == "pressure_set" else 1.0


def _signed_pair() -> gymnasium.Space:
    return gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)


@numba.njit(cache=True, nogil=True)
def _openings(action, supply):
    openings = action.astype(np.float64)
    for arm in range(openings.shape[0]):
        for muscle in range(openings.shape[1]):
            if openings[arm, muscle] < -1.0:
                openings[arm, muscle] = -1.0
            elif openings[arm, muscle] > 1.0:
                openings[arm, muscle] = 1.0
    return openings


@numba.njit(cache=True, nogil=True)
def _set_points(action, supply):
    return (0.5 * supply) * (_openings(action, supply) + 1.0)


@numba.njit(cache=True, nogil=True)
def _switches(action, supply):
    # An interlock, not a short circuit from supply to exhaust: both on is both shut.
    on = action.astype(np.float64)
    return on[:, 0::2] - on[:, 1::2]


KINDS: Mapping[str, ActionKind] = MappingProxyType(
    {
        "pressure": ActionKind(
            name="pressure", command="pressure_set", space=_signed_pair, commands=_set_points
        ),
        "valve": ActionKind(name="valve", command="valve", space=_signed_pair, commands=_openings),
        "on_off": ActionKind(
            name="on_off",
            command="valve",
            space=lambda: gymnasium.spaces.MultiBinary(4),
            commands=_switches,
        ),
    }
)
"""Pressure set points, continuous valves, the rig's four on/off valves."""
