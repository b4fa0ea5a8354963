"""The rigs behind an environment: one stepped by itself, or many by the engine's batch."""

from __future__ import annotations

import ctypes
import os
import weakref
from collections.abc import Sequence
from typing import ClassVar, Protocol

import mujoco
import numba
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from pamsim.core.errors import EngineError
from pamsim.engine.plugin import load_kernel
from pamsim.engine.rig import Rig
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.stepping import check_steppable

FloatArray = NDArray[np.float64]

_STATE = ("time", "qpos", "qvel", "act", "qacc_warmstart", "ctrl", "qfrc_applied", "xfrc_applied")
_POSITION = int(mujoco.mjtStage.mjSTAGE_POS)


def fixed_tendons(model: mujoco.MjModel) -> FloatArray | None:
    """Derivatives of the actuators' lengths by the positions, where they are constant.

    Returns:
        (nout, nq) [m/rad or 1] if every actuator pulls a fixed tendon, else None.
    """
    jacobian = np.zeros((model.nout, model.nq))
    for index in range(len(model.actuator_trnid)):
        tendon = model.actuator_trnid[index, 0]
        first = model.tendon_adr[tendon]
        for wrap in range(first, first + model.tendon_num[tendon]):
            if model.wrap_type[wrap] != mujoco.mjtWrap.mjWRAP_JOINT:
                return None
            position = model.jnt_qposadr[model.wrap_objid[wrap]]
            jacobian[model.actuator_outadr[index], position] = model.wrap_prm[wrap]
    return jacobian


@numba.njit(cache=True, nogil=True)
def _lengths(jacobian, position):
    """Lengths (n, nout) of fixed tendons, each summed in one order however many rigs there are."""
    lengths = np.empty((jacobian.shape[0], jacobian.shape[1]))
    for rig in range(lengths.shape[0]):
        for out in range(lengths.shape[1]):
            length = 0.0
            for joint in range(position.shape[1]):
                if jacobian[rig, out, joint] != 0.0:
                    length += jacobian[rig, out, joint] * position[rig, joint]
            lengths[rig, out] = length
    return lengths


def check_open(closed: bool) -> None:
    """Refuse to step a plant that is closed.

    Raises:
        EngineError: if it is.
    """
    if closed:
        raise EngineError("this environment is closed; make a new one")


class Plant(Protocol):
    """Rigs that are stepped together.

    Attributes:
        position: (n, nq) [rad or m].
        act: (n, na) states of the muscles.
        length: (n, m) lengths of their tendons [m].
    """

    position: FloatArray
    act: FloatArray
    length: FloatArray

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """Give some rigs a model and a state."""
        ...

    def push(self, torque: FloatArray) -> None:
        """Torques (n, j) that act on the recorded joints from now on [N m or N]."""
        ...

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """Advance all rigs: for some time steps by (n, m) commands each."""
        ...

    def state(self, number: int) -> FloatArray:
        """State of one rig, for `put`."""
        ...

    def time(self) -> FloatArray:
        """(n,) time of each rig [s]."""
        ...

    def warnings(self) -> int:
        """Number of engine warnings since the rigs were last put."""
        ...

    def close(self) -> None:
        """Refuse further steps."""
        ...


class OneRig:
    """A single rig.

    Args:
        rig: whose joints are pushed.
        model: at first.
        state: of it.

    Attributes:
        model: now.
        data: of it.
    """

    def __init__(self, rig: Rig, model: mujoco.MjModel, state: FloatArray) -> None:
        self._dofs = rig.velocity_addresses
        load_kernel()  # before the engine's threads need it
        self._closed = False
        self.put({0: (model, state)})

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        model, state = states[0]
        check_steppable(model)
        self.model, self.data = model, mujoco.MjData(model)
        restore_state(model, self.data, state)
        # Views of the engine's arrays: fetching one costs as much as reading it.
        self._ctrl, self._torque = self.data.ctrl, self.data.qfrc_applied
        self.position = self.data.qpos[np.newaxis]
        self.act = self.data.act[np.newaxis]
        own = fixed_tendons(model)
        self._jacobian = None if own is None else own[np.newaxis]
        self._measure()

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._torque[self._dofs] = torque[0]

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """See `Plant.step`."""
        check_open(self._closed)
        for count, command in commands:
            self._ctrl[:] = command[0]
            mujoco.mj_step(self.model, self.data, count)
        self._measure()

    def _measure(self) -> None:
        # The engine's own lengths belong to the start of the last step.
        if self._jacobian is None:
            mujoco.mj_fwdPosition(self.model, self.data)
            self.length = self.data.actuator_length[np.newaxis]
        else:
            self.length = _lengths(self._jacobian, self.position)

    def state(self, number: int) -> FloatArray:
        """See `Plant.state`."""
        return save_state(self.model, self.data)

    def time(self) -> FloatArray:
        """See `Plant.time`."""
        return np.array([self.data.time])

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self.data.warning.number.sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._closed = True


class ManyRigs:
    """Rigs on the engine's thread pool; each is bit-identical to a `OneRig`.

    Args:
        rig: whose joints are pushed.
        model: of the first; the others are of its sizes.
        count: how many.
        threads: of the pool; 0 for one per processor.
    """

    _alive: ClassVar[weakref.WeakSet[ManyRigs]] = weakref.WeakSet()

    def __init__(self, rig: Rig, model: mujoco.MjModel, count: int, threads: int) -> None:
        load_kernel()  # before the engine's threads need it
        self._closed = False
        self._models, self._threads = [model] * count, threads
        self._scratch = mujoco.MjData(model)
        self._dofs = rig.velocity_addresses
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
        if self._jacobian is None:
            self.length = batch.bind("actuator_length")

    @classmethod
    def after_fork(cls) -> None:
        """Note in a new process that the threads of all batches stayed in the old one."""
        for rigs in cls._alive:
            rigs._forked = True
            # To end a batch is to wait for its threads, for ever: it is never to be ended.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(rigs._batch))

    def _start_again(self) -> None:
        """Go on in a forked process with threads of its own."""
        numbers = range(len(self._models))
        states = {number: (self._models[number], self.state(number)) for number in numbers}
        self._open()
        self.put(states)

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        if self._forked:
            self._start_again()
        for number, (model, state) in states.items():
            self._models[number] = model
            restore_state(model, self._scratch, state)
            for field in _STATE:
                getattr(self._batch, field)[number] = getattr(self._scratch, field)
            self._batch.warning[number] = 0
            if self._jacobian is not None:
                self._jacobian[number] = fixed_tendons(model)
        distinct = list({id(model): model for model in self._models}.values())
        for model in distinct:
            check_steppable(model)
        self._batch.set_models(distinct[0] if len(distinct) == 1 else self._models)
        if self._jacobian is None:
            self._batch.forward(stage=_POSITION)
        else:
            self.length = _lengths(self._jacobian, self.position)

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        if self._forked:
            self._start_again()
        self._torque[:, self._dofs] = torque

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """See `Plant.step`."""
        if self._forked:
            self._start_again()
        check_open(self._closed)
        for number, (count, command) in enumerate(commands, start=1):
            self._ctrl[:] = command
            wanted = self._jacobian is None and number == len(commands)
            self._batch.step(nstep=count, stage=_POSITION if wanted else 0)
        if self._jacobian is not None:
            self.length = _lengths(self._jacobian, self.position)

    def state(self, number: int) -> FloatArray:
        """See `Plant.state`."""
        for field in _STATE:
            value = getattr(self._batch, field)[number]
            if field == "time":
                self._scratch.time = float(value)
            else:
                getattr(self._scratch, field)[:] = value
        return save_state(self._models[number], self._scratch)

    def time(self) -> FloatArray:
        """See `Plant.time`."""
        return np.ravel(self._batch.time).copy()

    def warnings(self) -> int:
        """See `Plant.warnings`."""
        return int(self._batch.warning[:, :, 1].sum())

    def close(self) -> None:
        """See `Plant.close`."""
        self._closed = True


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=ManyRigs.after_fork)
