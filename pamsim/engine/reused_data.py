"""The engine's data, used again by one run after another: making one takes a hundred time steps."""

from __future__ import annotations

import threading

import mujoco

from pamsim.engine.rig import Rig
from pamsim.recordings.rig_file import RigFile


class ReusedData(threading.local):
    """Data of rigs, of which each thread has its own.

    Models of one rig file are copies of one compiled model, so that they share a data, which holds
    whatever was last done with it.
    """

    def __init__(self) -> None:
        self._known: dict[int, tuple[RigFile, mujoco.MjData]] = {}

    def of(self, rig: Rig) -> mujoco.MjData:
        """Data for a rig's models in this thread."""
        key = id(rig.file)
        if key not in self._known:
            self._known[key] = rig.file, mujoco.MjData(rig.model)
        return self._known[key][1]
