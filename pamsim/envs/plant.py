"""The arms behind an environment: one stepped by itself, or many by the engine's batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from pamsim.engine.held_callbacks import HeldCallbacks
from pamsim.engine.rig import Rig
from pamsim.engine.state import restore_state

FloatArray = NDArray[np.float64]

_STATE = ("time", "qpos", "qvel", "act", "qacc_warmstart", "ctrl", "qfrc_applied", "xfrc_applied")
_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)


class Plant(Protocol):
    """Arms that are stepped together.

    Attributes:
        angle: (n,) [rad].
        act: (n, na) states of the muscles.
        length: (n, m) lengths of their tendons [m].
    """

    angle: FloatArray
    act: FloatArray
    length: FloatArray

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """Give some arms a model and a state."""
        ...

    def step(self, commands: Sequence[tuple[int, FloatArray]], torque: FloatArray) -> None:
        """Advance all arms: for some time steps by (n, 2) commands each, under a torque [N m]."""
        ...

    def warnings(self) -> int:
        """How often the engine has warned since arms were last put."""
        ...

    def close(self) -> None:
        """Give the callbacks back."""
        ...


class OneArm:
    """A single arm.

    Args:
        rig: whose joint it turns on.
    """

    def __init__(self, rig: Rig) -> None:
        self._joint, self._dof = rig.angle_address, rig.velocity_address
        self._held = HeldCallbacks()

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        model, state = states[0]
        self._held.keep(model)
        self._model, data = model, mujoco.MjData(model)
        restore_state(model, data, state)
        # Views of the engine's arrays: each look-up of one costs as much as reading it.
        self._data, self._ctrl, self._torque = data, data.ctrl, data.qfrc_applied
        self.angle = data.qpos[self._joint : self._joint + 1]
        self.act = data.act[np.newaxis]
        self.length = data.actuator_length[np.newaxis]
        mujoco.mj_fwdPosition(model, data)

    def step(self, commands: Sequence[tuple[int, FloatArray]], torque: FloatArray) -> None:
        """See `Plant.step`."""
        self._held.look()
        self._torque[self._dof] = torque[0]
        for count, command in commands:
            self._ctrl[:] = command[0]
            mujoco.mj_step(self._model, self._data, count)
        mujoco.mj_fwdPosition(self._model, self._data)

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self._data.warning.number.sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._held.release()


class ManyArms:
    """Arms on the engine's thread pool; each goes as `OneArm` does, to the last bit.

    Args:
        rig: whose joint they turn on.
        model: of the first; the others are of its sizes.
        count: how many.
        threads: of the pool; 0 for one per processor.
    """

    def __init__(self, rig: Rig, model: mujoco.MjModel, count: int, threads: int) -> None:
        self._held = HeldCallbacks()
        self._held.keep(model)
        self._batch = batch = Batch(model, count, threads)
        self._models = [model] * count
        self._scratch = mujoco.MjData(model)
        self._ctrl = batch.ctrl
        self._torque = batch.qfrc_applied[:, rig.velocity_address]
        self.angle = batch.qpos[:, rig.angle_address]
        self.act = batch.act
        self.length = batch.bind("actuator_length")

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        for arm, (model, state) in states.items():
            self._models[arm] = model
            restore_state(model, self._scratch, state)
            for field in _STATE:
                getattr(self._batch, field)[arm] = getattr(self._scratch, field)
            self._batch.warning[arm] = 0
        distinct = list({id(model): model for model in self._models}.values())
        self._held.keep(*distinct)
        self._batch.set_models(distinct[0] if len(distinct) == 1 else self._models)
        self._batch.forward(stage=_POSITION)

    def step(self, commands: Sequence[tuple[int, FloatArray]], torque: FloatArray) -> None:
        """See `Plant.step`."""
        self._held.look()
        self._torque[:] = torque
        for number, (count, command) in enumerate(commands, start=1):
            self._ctrl[:] = command
            last = number == len(commands)
            self._batch.step(nstep=count, stage=_POSITION if last else 0)

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self._batch.warning[:, :, 1].sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._held.release()
