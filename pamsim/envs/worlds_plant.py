"""The rigs behind a vector environment as worlds on one device."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.rig import Rig
from pamsim.envs.plant import check_open
from pamsim.gpu.worlds import Worlds

FloatArray = NDArray[np.float64]


class ManyWorlds:
    """Rigs as `pamsim.gpu.worlds.Worlds`, see `pamsim.envs.plant.Plant`.

    Args:
        rig: whose joints are pushed.
        model: of the first; the others differ from it as worlds may.
        count: how many.
        device: name of Warp's.
        precision: of the muscles.
    """

    def __init__(
        self, rig: Rig, model: mujoco.MjModel, count: int, device: str, precision: str
    ) -> None:
        self._worlds = Worlds(rig, model, count, precision=precision, device=device)
        self._dofs = rig.velocity_addresses
        self._closed = False
        self._read()

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        self._worlds.put(states)
        self._read()

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._worlds.push(torque, self._dofs)

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """See `Plant.step`."""
        check_open(self._closed)
        for count, command in commands:
            self._worlds.step(command, count)
        self._read()

    def _read(self) -> None:
        self.position, self.act = self._worlds.position, self._worlds.act
        self.length = self._worlds.length

    def state(self, number: int) -> FloatArray:
        """See `Plant.state`."""
        return self._worlds.state(number)

    def time(self) -> FloatArray:
        """See `Plant.time`."""
        return self._worlds.time

    def warnings(self) -> int:
        """None: the engine in Warp does not count any."""
        return 0

    def close(self) -> None:
        """See `Plant.close`."""
        self._closed = True
