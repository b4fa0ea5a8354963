"""Pictures of an environment's rig, or a window on it."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.engine.rig import load_rig
from pamsim.envs.rigs import Rigs
from pamsim.scene.picture import open_renderer, render_arm, show_whole
from pamsim.scene.pose import muscle_lengths, pose

MODES = (None, "rgb_array", "human")


def check_mode(mode: str | None) -> None:
    """Check a render mode.

    Raises:
        InputError: if there is no such mode.
    """
    if mode not in MODES:
        raise InputError(f"no render mode {mode!r}; known: rgb_array, human")


class RigPicture:
    """Draws the first of an environment's rigs, quickly: without shadows and fine parts.

    OpenGL starts with the first picture.

    Args:
        rigs: of the environment.
        mode: one of `MODES`.
        width: [px].
        height: [px].
    """

    def __init__(self, rigs: Rigs, mode: str | None, width: int, height: int) -> None:
        self._rigs, self._mode, self._size = rigs, mode, (width, height)
        self._model: mujoco.MjModel | None = None
        self._shown: Any = None

    def show(self) -> NDArray[np.uint8] | None:
        """Draw the rig as it stands, see `pamsim.envs.rig_env.RigEnv.render`."""
        if self._mode is None:
            raise InputError(
                "the environment was made without a render mode; make it with"
                " render_mode='rgb_array' or 'human'"
            )
        if self._model is None:
            self._model = load_rig(self._rigs.rig.file.folder, scene=True).model
            self._data = mujoco.MjData(self._model)
        model, data = self._model, self._data
        seen, rig = self._rigs.information(), self._rigs.rig
        pose(model, data, rig.position_addresses, seen["position"][0].tolist())
        pressures, lengths = seen["pressure"][0].tolist(), muscle_lengths(model, data)
        if self._shown is None:
            self._shown = self._open()
        if self._mode == "human":
            self._shown.show(model, data, pressures=pressures, lengths=lengths)
            return None
        return render_arm(
            model, data, pressures=pressures, lengths=lengths, renderer=self._shown, fine=False
        )

    def close(self) -> None:
        """Close renderer or window."""
        if self._shown is not None:
            self._shown.close()
            self._shown = None

    def _open(self) -> Any:
        assert self._model is not None
        if self._mode == "human":
            from pamsim.scene.viewer import ArmViewer

            return ArmViewer(self._model)
        width, height = self._size
        show_whole(self._model, width=width, height=height)
        return open_renderer(self._model, width=width, height=height, quick=True)
