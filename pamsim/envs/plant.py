"""The rigs behind an environment: one stepped by itself, many by the engine's batch or by Warp."""

from __future__ import annotations

import ctypes
import os
import weakref
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import mujoco
import numba
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from pamsim.core.errors import EngineError
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


class Plant(ABC):
    """Rigs that are stepped together.

    Args:
        rig: whose joints are pushed.
        model: of the first rig; the others are of its sizes.
        count: how many.

    Attributes:
        position: (n, nq) [rad or m].
        act: (n, na) states of the muscles.
        length: (n, m) lengths of their tendons [m].
    """

    position: FloatArray
    act: FloatArray
    length: FloatArray

    def __init__(self, rig: Rig, model: mujoco.MjModel, count: int) -> None:
        self._dofs = rig.velocity_addresses
        self._closed = False
        own = fixed_tendons(model)
        self._jacobian = None if own is None else np.tile(own, (count, 1, 1))

    @abstractmethod
    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """Give some rigs a model and a state."""

    @abstractmethod
    def push(self, torque: FloatArray) -> None:
        """Apply torques (n, j) to the recorded joints from now on [N m or N]."""

    def step(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """Advance all rigs: for some time steps by (n, m) commands each.

        Raises:
            EngineError: if the plant is closed.
        """
        if self._closed:
            raise EngineError("this environment is closed; make a new one")
        self._advance(commands)

    @abstractmethod
    def _advance(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        """Advance all rigs by the commands of `step`."""

    @abstractmethod
    def state(self, number: int) -> FloatArray:
        """State of one rig, for `put`."""

    @abstractmethod
    def time(self) -> FloatArray:
        """(n,) time of each rig [s]."""

    def warnings(self) -> int:
        """Number of engine warnings since the rigs were last put."""
        return 0

    def close(self) -> None:
        """Refuse further steps."""
        self._closed = True


class OneRig(Plant):
    """A single rig.

    Args:
        rig: whose joints are pushed.
        model: at first.
        state: of it.

    Attributes:
        model: now.
        data: of it, the same all the time.
    """

    def __init__(self, rig: Rig, model: mujoco.MjModel, state: FloatArray) -> None:
        super().__init__(rig, model, 1)
        self.data = data = mujoco.MjData(model)
        # Views of the engine's arrays: fetching one costs as much as reading it.
        self._ctrl, self._torque = data.ctrl, data.qfrc_applied
        self.position, self.act = data.qpos[np.newaxis], data.act[np.newaxis]
        self.put({0: (model, state)})

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        self.model, state = states[0]
        check_steppable(self.model)
        # New data would cost as much as three steps.
        mujoco.mj_resetData(self.model, self.data)
        restore_state(self.model, self.data, state)
        if self._jacobian is not None:
            self._jacobian[0] = fixed_tendons(self.model)
        self._measure()

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._torque[self._dofs] = torque[0]

    def _advance(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
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


class ManyRigs(Plant):
    """Rigs on the engine's thread pool; each is bit-identical to a `OneRig`.

    Args:
        rig: whose joints are pushed.
        model: of the first; the others are of its sizes.
        count: how many.
        threads: of the pool; 0 for one per processor.
    """

    _alive: ClassVar[weakref.WeakSet[ManyRigs]] = weakref.WeakSet()

    def __init__(self, rig: Rig, model: mujoco.MjModel, count: int, threads: int) -> None:
        super().__init__(rig, model, count)
        self._models, self._threads = [model] * count, threads
        self._scratch = mujoco.MjData(model)
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
        states = {n: (model, self.state(n)) for n, model in enumerate(self._models)}
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

    def _advance(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        if self._forked:
            self._start_again()
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


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=ManyRigs.after_fork)


class WarpRigs(Plant):
    """Rigs as `pamsim.gpu.worlds.Worlds`; the engine in Warp counts no warnings.

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
        from pamsim.gpu.worlds import Worlds  # with Warp, an extra

        super().__init__(rig, model, count)
        self._worlds = Worlds(rig, model, count, precision=precision, device=device)
        self._read()

    def _read(self) -> None:
        self.position, self.act = self._worlds.position, self._worlds.act
        self.length = self._worlds.length

    def put(self, states: dict[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """See `Plant.put`."""
        self._worlds.put(states)
        self._read()

    def push(self, torque: FloatArray) -> None:
        """See `Plant.push`."""
        self._worlds.push(torque, self._dofs)

    def _advance(self, commands: Sequence[tuple[int, FloatArray]]) -> None:
        for count, command in commands:
            self._worlds.step(command, count)
        self._read()

    def state(self, number: int) -> FloatArray:
        """See `Plant.state`."""
        return self._worlds.state(number)

    def time(self) -> FloatArray:
        """See `Plant.time`."""
        return self._worlds.time
