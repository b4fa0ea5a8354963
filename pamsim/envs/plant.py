"""The rigs behind an environment: one stepped by itself, many by the engine's batch or by Warp.

All have ``position`` (n, nq) [rad or m], ``act`` (n, na), the states of the muscles, and ``length``
(n, m), those of their tendons [m].
"""

from __future__ import annotations

import ctypes
import os
import weakref
from collections.abc import Mapping, Sequence
from typing import ClassVar, TypeAlias

import mujoco
import numpy as np
from mujoco.batch import Batch

from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.stepping import check_steppable

Start: TypeAlias = tuple[mujoco.MjModel, FloatArray]
"""A model, and a state of it as `pamsim.save_state` returns it."""

Commands: TypeAlias = Sequence[tuple[int, FloatArray]]
"""Time steps and (n, m) commands of each stretch of a period."""

_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)
_LENGTHS = (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_tendon, mujoco.mj_transmission)
"""What finds the lengths of tendons; the engine's own belong to the start of the last step."""


class OneRig:
    """A single rig: ``model`` as it is now, and ``data``, the same all the time."""

    def __init__(self, rig: Rig, model: mujoco.MjModel, state: FloatArray) -> None:
        self._dofs = rig.velocity_addresses
        self.data = data = mujoco.MjData(model)
        # Views of the engine's arrays: fetching one costs as much as reading it.
        self._ctrl, self._torque = data.ctrl, data.qfrc_applied
        self.position, self.act = data.qpos[np.newaxis], data.act[np.newaxis]
        self.length = data.actuator_length[np.newaxis]
        self.put({0: (model, state)})

    def put(self, starts: Mapping[int, Start]) -> None:
        """Give the rig a model and a state."""
        self.model, state = starts[0]
        check_steppable(self.model)
        # New data would cost as much as three steps.
        mujoco.mj_resetData(self.model, self.data)
        restore_state(self.model, self.data, state)
        self.step([])

    def push(self, torque: FloatArray) -> None:
        """Apply torques (1, j) to the recorded joints from now on [N m or N]."""
        self._torque[self._dofs] = torque[0]

    def step(self, commands: Commands) -> None:
        """Advance by some commands."""
        for count, command in commands:
            self._ctrl[:] = command[0]
            mujoco.mj_step(self.model, self.data, count)
        for find in _LENGTHS:
            find(self.model, self.data)

    def states(self) -> FloatArray:
        """(1, s) state for `put`; it begins with the time [s]."""
        return save_state(self.model, self.data)[np.newaxis]


class ManyRigs:
    """Rigs on a pool of the engine's threads (0: one per processor), bit-identical to `OneRig`."""

    _alive: ClassVar[weakref.WeakSet[ManyRigs]] = weakref.WeakSet()

    def __init__(self, rig: Rig, model: mujoco.MjModel, count: int, threads: int) -> None:
        self._dofs = rig.velocity_addresses
        self._models, self._threads = [model] * count, threads
        own = fixed_tendons(model)
        self._jacobian = None if own is None else np.tile(own, (count, 1, 1))
        self._open()
        self._alive.add(self)

    def _open(self) -> None:
        """Make the batch and bind what is read and written at each step."""
        self._forked = False
        self._batch = batch = Batch(self._models[0], len(self._models), self._threads)
        self._ctrl, self._torque = batch.ctrl, batch.qfrc_applied
        self.position, self.act = batch.qpos, batch.act
        self._stage = 0 if self._jacobian is not None else _POSITION
        if self._stage:
            self.length = batch.bind("actuator_length")

    @classmethod
    def after_fork(cls) -> None:
        """Note in a new process that the threads of all batches stayed in the old one."""
        for rigs in cls._alive:
            rigs._forked = True
            # To end a batch is to wait for its threads, for ever: it is never to be ended.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(rigs._batch))

    def _pool(self) -> Batch:
        """The batch; in a forked process a new one, with threads of its own."""
        if self._forked:
            starts = enumerate(zip(self._models, self.states(), strict=True))
            self._open()
            self.put(dict(starts))
        return self._batch

    def put(self, starts: Mapping[int, Start]) -> None:
        """Give some rigs a model of the same sizes and a state."""
        batch = self._pool()
        for number, (model, state) in starts.items():
            self._models[number], batch.state[number] = model, state
            batch.warning[number] = 0
            if self._jacobian is not None:
                self._jacobian[number] = fixed_tendons(model)
        distinct = list({id(model): model for model in self._models}.values())
        for model in distinct:
            check_steppable(model)
        batch.set_models(distinct[0] if len(distinct) == 1 else self._models)
        if self._stage:
            batch.forward(stage=self._stage)
        self._measure()

    def push(self, torque: FloatArray) -> None:
        """Apply torques (n, j) to the recorded joints from now on [N m or N]."""
        self._pool()
        self._torque[:, self._dofs] = torque

    def step(self, commands: Commands) -> None:
        """Advance all rigs by some commands."""
        batch = self._pool()
        for count, command in commands:
            self._ctrl[:] = command
            batch.step(nstep=count, stage=self._stage)
        self._measure()

    def _measure(self) -> None:
        if self._jacobian is not None:
            # Joint after joint, so that the sums do not depend on the number of rigs.
            self.length = np.zeros(self._jacobian.shape[:2])
            for joint, position in enumerate(self.position.T):
                self.length += self._jacobian[:, :, joint] * position[:, np.newaxis]

    def states(self) -> FloatArray:
        """(n, s) states for `put`; each begins with the time [s]."""
        return self._batch.state.copy()

    def warnings(self) -> int:
        """Number of engine warnings since the rigs were last put."""
        return int(self._batch.warning[:, :, 1].sum())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=ManyRigs.after_fork)


def fixed_tendons(model: mujoco.MjModel) -> FloatArray | None:
    """Derivatives of the actuators' lengths by the positions, where they are constant.

    A batch would take a fifth longer for a short step if it had to find the lengths itself.

    Returns:
        (nout, nq) [m/rad or 1] if every tendon is fixed, else None.
    """
    if (model.wrap_type != mujoco.mjtWrap.mjWRAP_JOINT).any():
        return None
    tendons = np.zeros((model.ntendon, model.nq))
    owner = np.repeat(np.arange(model.ntendon), model.tendon_num)
    tendons[owner, model.jnt_qposadr[model.wrap_objid]] = model.wrap_prm
    lengths = np.empty((model.nout, model.nq))
    lengths[model.actuator_outadr] = tendons[model.actuator_trnid[:, 0]]
    return lengths


class WarpRigs:
    """Rigs as `pamsim.gpu.worlds.Worlds`."""

    def __init__(
        self, rig: Rig, model: mujoco.MjModel, count: int, device: str, precision: str
    ) -> None:
        from pamsim.gpu.worlds import Worlds  # with Warp, an extra

        self._dofs = rig.velocity_addresses
        self._worlds = Worlds(rig, model, count, precision=precision, device=device)
        self._read()

    def _read(self) -> None:
        worlds = self._worlds
        self.position, self.act, self.length = worlds.position, worlds.act, worlds.length

    def put(self, starts: Mapping[int, Start]) -> None:
        """Give some rigs a model, which differs as worlds may, and a state."""
        self._worlds.put(starts)
        self._read()

    def push(self, torque: FloatArray) -> None:
        """Apply torques (n, j) to the recorded joints from now on [N m or N]."""
        self._worlds.push(torque, self._dofs)

    def step(self, commands: Commands) -> None:
        """Advance all rigs by some commands."""
        for count, command in commands:
            self._worlds.step(command, count)
        self._read()

    def states(self) -> FloatArray:
        """(n, s) states for `put`; each begins with the time [s]."""
        return np.array([self._worlds.state(number) for number in range(self._worlds.count)])


Plant: TypeAlias = OneRig | ManyRigs | WarpRigs
