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


def tendon_jacobian(model: mujoco.MjModel) -> FloatArray | None:
    """Derivative of the tendon lengths by the angle, for the engine's own product.

    Returns:
        (nout,) [m/rad] if every actuator pulls a fixed tendon of the model's one joint, else None.
    """
    jacobian = np.zeros(model.nout)
    for index in range(len(model.actuator_trnid)):
        tendon = model.actuator_trnid[index, 0]
        wrap = model.tendon_adr[tendon]
        fixed = model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT
        if model.nq != 1 or not fixed or model.tendon_num[tendon] != 1:
            return None
        jacobian[model.actuator_outadr[index]] = model.wrap_prm[wrap]
    return jacobian


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

    def push(self, torque: FloatArray) -> None:
        """Torques (n,) that act on the joints from now on [N m]."""
        ...

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """Advance all arms: for some time steps by (n, 2) commands each."""
        ...

    def warnings(self) -> int:
        """Number of engine warnings since the arms were last put."""
        ...

    def close(self) -> None:
        """Release the callbacks."""
        ...


class OneArm:
    """A single arm.

    Args:
        rig: whose joint it turns on.
    """

    def __init__(self, rig: Rig) -> None:
        self._joint, self._dof = rig.angle_address, rig.velocity_address
        self._held = HeldCallbacks()
        self._jacobian: FloatArray | None = None

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        model, state = states[0]
        self._held.keep(model)
        self._model, data = model, mujoco.MjData(model)
        restore_state(model, data, state)
        # Views of the engine's arrays: fetching one costs as much as reading it.
        self._data, self._ctrl, self._torque = data, data.ctrl, data.qfrc_applied
        self.angle = data.qpos[self._joint : self._joint + 1]
        self.act = data.act[np.newaxis]
        self._jacobian = tendon_jacobian(model)
        self._measure()

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._torque[self._dof] = torque[0]

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """See `Plant.step`."""
        self._held.check()
        for count, command in commands:
            self._ctrl[:] = command[0]
            mujoco.mj_step(self._model, self._data, count)
        self._measure()

    def _measure(self) -> None:
        # The engine's own lengths belong to the start of the last step.
        if self._jacobian is None:
            mujoco.mj_fwdPosition(self._model, self._data)
            self.length = self._data.actuator_length[np.newaxis]
        else:
            self.length = (self._jacobian * self.angle)[np.newaxis]

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self._data.warning.number.sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._held.release()


class ManyArms:
    """Arms on the engine's thread pool; each is bit-identical to a `OneArm`.

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
        own = tendon_jacobian(model)
        self._jacobian = None if own is None else np.tile(own, (count, 1))
        if self._jacobian is None:
            self.length = batch.bind("actuator_length")

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        for arm, (model, state) in states.items():
            self._models[arm] = model
            restore_state(model, self._scratch, state)
            for field in _STATE:
                getattr(self._batch, field)[arm] = getattr(self._scratch, field)
            self._batch.warning[arm] = 0
            if self._jacobian is not None:
                self._jacobian[arm] = tendon_jacobian(model)
        distinct = list({id(model): model for model in self._models}.values())
        self._held.keep(*distinct)
        self._batch.set_models(distinct[0] if len(distinct) == 1 else self._models)
        if self._jacobian is None:
            self._batch.forward(stage=_POSITION)
        else:
            self.length = self._jacobian * self.angle[:, np.newaxis]

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._torque[:] = torque

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """See `Plant.step`."""
        self._held.check()
        for number, (count, command) in enumerate(commands, start=1):
            self._ctrl[:] = command
            wanted = self._jacobian is None and number == len(commands)
            self._batch.step(nstep=count, stage=_POSITION if wanted else 0)
        if self._jacobian is not None:
            self.length = self._jacobian * self.angle[:, np.newaxis]

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self._batch.warning[:, :, 1].sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._held.release()
