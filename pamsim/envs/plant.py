"""The rigs behind an environment: one stepped by itself, or many by the engine's batch.

They have the interface of `pamsim.gpu.worlds.Worlds`, which may stand in their place: ``put``,
``push``, ``step``, ``state``; ``time`` (n,) [s], ``position`` (n, nq) [rad or m], ``act`` (n, na),
the states of the muscles, and ``length`` (n, m), those of their tendons [m].
"""

from __future__ import annotations

import ctypes
import os
import weakref
from collections.abc import Mapping
from typing import ClassVar, TypeAlias

import mujoco
import numpy as np
from mujoco.batch import Batch

from pamsim.core.units import FloatArray
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.stepping import check_steppable

Start: TypeAlias = tuple[mujoco.MjModel, FloatArray]
"""A model, and a state of it as `pamsim.save_state` returns it."""

_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)


class OneRig:
    """A single rig: ``model`` as it is now, and ``data``, the same all the time."""

    def __init__(self, start: Start) -> None:
        self.data = data = mujoco.MjData(start[0])
        # Views of the engine's arrays: fetching one costs as much as reading it.
        self._ctrl, self._torque = data.ctrl, data.qfrc_applied
        self.position, self.act = data.qpos[np.newaxis], data.act[np.newaxis]
        self._length = data.actuator_length[np.newaxis]
        self.put({0: start})

    def put(self, states: Mapping[int, Start]) -> None:
        """Give the rig a model and a state."""
        self.model, state = states[0]
        check_steppable(self.model)
        # New data would cost as much as three steps.
        mujoco.mj_resetData(self.model, self.data)
        restore_state(self.model, self.data, state)

    def push(self, torque: FloatArray, dofs: list[int]) -> None:
        """Torques or forces (1, j) that act on joints from now on [N m or N]."""
        self._torque[dofs] = torque[0]

    def step(self, command: FloatArray, count: int = 1) -> None:
        """Make some time steps under one command (1, m)."""
        self._ctrl[:] = command[0]
        mujoco.mj_step(self.model, self.data, count)

    @property
    def length(self) -> FloatArray:
        """(1, m) [m]; the engine's own belong to the start of the last step."""
        model, data = self.model, self.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        mujoco.mj_transmission(model, data)
        return self._length

    @property
    def time(self) -> FloatArray:
        """(1,) [s]."""
        return np.array([self.data.time])

    def state(self, number: int) -> FloatArray:
        """State for `put`."""
        return save_state(self.model, self.data)


class ManyRigs:
    """Rigs on a pool of the engine's threads (0: one per processor), bit-identical to `OneRig`."""

    _alive: ClassVar[weakref.WeakSet[ManyRigs]] = weakref.WeakSet()

    def __init__(self, model: mujoco.MjModel, count: int, threads: int) -> None:
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
        self.position, self.act, self.time = batch.qpos, batch.act, batch.time
        self._stage = _POSITION if self._jacobian is None else 0
        if self._stage:
            batch.bind("actuator_length")

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
            states = {n: (model, self.state(n)) for n, model in enumerate(self._models)}
            self._open()
            self.put(states)
        return self._batch

    def put(self, states: Mapping[int, Start]) -> None:
        """Give some rigs a model of the same sizes and a state."""
        batch = self._pool()
        for number, (model, state) in states.items():
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

    def push(self, torque: FloatArray, dofs: list[int]) -> None:
        """Torques or forces (n, j) that act on joints from now on [N m or N]."""
        self._pool()
        self._torque[:, dofs] = torque

    def step(self, command: FloatArray, count: int = 1) -> None:
        """Make some time steps under one command (n, m)."""
        batch = self._pool()
        self._ctrl[:] = command
        batch.step(nstep=count, stage=self._stage)

    @property
    def length(self) -> FloatArray:
        """(n, m) [m]."""
        if self._jacobian is None:
            return self._batch.bind("actuator_length")
        # Joint after joint, so that the sums do not depend on the number of rigs.
        lengths = np.zeros(self._jacobian.shape[:2])
        for joint, position in enumerate(self.position.T):
            lengths += self._jacobian[:, :, joint] * position[:, np.newaxis]
        return lengths

    def state(self, number: int) -> FloatArray:
        """State of one rig for `put`."""
        return self._batch.state[number].copy()

    def warnings(self) -> int:
        """Number of engine warnings since the rigs were last put."""
        return int(self._batch.warning[:, :, 1].sum())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=ManyRigs.after_fork)


def fixed_tendons(model: mujoco.MjModel) -> FloatArray | None:
    """Derivatives (nout, nq) of the actuators' lengths by the positions [m/rad or 1], if constant.

    They are where every tendon is fixed. A batch would take a fifth longer for a short step if it
    had to find the lengths itself.
    """
    if (model.wrap_type != mujoco.mjtWrap.mjWRAP_JOINT).any():
        return None
    tendons = np.zeros((model.ntendon, model.nq))
    owner = np.repeat(np.arange(model.ntendon), model.tendon_num)
    tendons[owner, model.jnt_qposadr[model.wrap_objid]] = model.wrap_prm
    lengths = np.empty((model.nout, model.nq))
    lengths[model.actuator_outadr] = tendons[model.actuator_trnid[:, 0]]
    return lengths
