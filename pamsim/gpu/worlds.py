"""Many copies of a rig on one device, each with parameters and a state of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from pamsim.core.catalog import USER_DEFINED
from pamsim.core.compilation import compile_notice
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.stepping import check_steppable
from pamsim.gpu.engine_model import engine_model
from pamsim.gpu.muscle_kernels import muscle_kernels
from pamsim.gpu.port import port
from pamsim.gpu.warp_package import mujoco_warp, warp
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.pleated import PleatedShape
from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import slot
from pamsim.physics.supply import VALVE

_LAW, _OPERATOR = slot("force.law"), slot("hysteresis.law")
_SUPPLY_FALL = {name: slot(name) for name in ("valve.supply_resistance", "valve.supply_square")}
_SHAPE, _ARCTANGENT = FORCE_LAWS.code(PleatedShape), OPERATORS.code(Arctangent)

_OWN = (
    "body_inertia",
    "body_invweight0",
    "body_mass",
    "body_quat",
    "body_subtreemass",
    "dof_armature",
    "dof_damping",
    "dof_frictionloss",
    "dof_invweight0",
    "dof_solimp",
    "dof_solref",
    "jnt_stiffness",
    "tendon_damping",
    "tendon_frictionloss",
    "tendon_invweight0",
)
"""Fields of the engine's model that each world has for itself."""

_SHARED = ("wrap_prm", "qpos0", "tendon_length0", "body_pos")
"""Fields that all worlds share."""


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Signals of n worlds at one instant.

    Attributes:
        position: (n, nq) [rad or m].
        velocity: (n, nv) [rad/s or m/s].
        pressure: (n, m) gauge pressures as sensors at the valves see them [Pa].
        tension: (n, m) of the muscles [N].
    """

    position: FloatArray
    velocity: FloatArray
    pressure: FloatArray
    tension: FloatArray


class Worlds:
    """Copies of a rig, stepped together by `mujoco_warp`.

    The joints are computed in single precision, as that engine does. Air and memory of the muscles
    are of the precision asked for. Before the first step every world needs a state, see `put`.

    Args:
        rig: whose MJCF they have.
        model: of the rig, set up for an experiment; those of the worlds may differ from it in the
            numbers of muscles, and in masses, inertias, damping and friction.
        count: how many.
        precision: of the muscles: ``float64``, or ``float32``, which is quicker on GPUs made for
            pictures.
        device: name of Warp's, such as ``cuda:0`` or ``cpu``; its own choice if left out.

    Attributes:
        count: how many.

    Raises:
        InputError: if Warp is not installed, the precision unknown, or the rig has a law or an
            integrator that has no counterpart on a GPU or in that precision.
        EngineError: if the integrator would break the muscles' memory.
    """

    def __init__(
        self,
        rig: Rig,
        model: mujoco.MjModel,
        count: int,
        *,
        precision: str = "float64",
        device: str | None = None,
    ) -> None:
        if count < 1:
            raise InputError(f"{count} worlds; give 1 or more")
        check_steppable(model)
        _check_laws(model.actuator_user, precision)
        wp, mjw = warp(), mujoco_warp()
        self.count, self._wp, self._mjw = count, wp, mjw
        self._device = wp.get_device(device)
        self._kernels, self._scalar = muscle_kernels(precision), port(precision).scalar
        self._precision, self._scratch = precision, mujoco.MjData(model)
        self._base = model
        bare = engine_model(rig, model)
        muscles = model.nactuator
        with wp.ScopedDevice(self._device):
            self._model = mjw.put_model(bare, batch_sizes=dict.fromkeys(_OWN, count))
            self._data = mjw.make_data(bare, nworld=count)
            self._par = wp.zeros((count, muscles, model.nuser_actuator), dtype=self._scalar)
            self._time = wp.zeros(count, dtype=wp.float64)
            self._pressure = wp.zeros((count, muscles), dtype=self._scalar)
            self._tension = wp.zeros((count, muscles), dtype=self._scalar)
            # The engine leaves the states of such actuators as they are and has a copy of them.
            self._act = wp.zeros((count, model.na), dtype=self._scalar)
            self._rates = wp.zeros((count, model.na), dtype=self._scalar)
            places = np.stack([model.actuator_actadr, model.actuator_actnum], axis=1)
            self._place = wp.array(places, dtype=wp.int32)
            feeds = (count, muscles, muscles) if _falls(model) else ()
            self._valves = wp.zeros((*(feeds or (1, 1, 1)), VALVE), dtype=self._scalar)
        self._model.callback.act_bias = self._pull
        self._rows = np.zeros(self._par.shape)
        self._own = {name: _numbers(getattr(self._model, name)) for name in _OWN}
        self._graphs: dict[Callable[[], None], Any] = {}
        self._given = np.zeros(count, dtype=np.bool_)

    @property
    def timestep(self) -> float:
        """Of the engine [s]."""
        return float(self._base.opt.timestep)

    def put(self, states: Mapping[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """Give some worlds their parameters and a state.

        Args:
            states: number of a world -> the rig's model with its parameters, and a state of it, see
                `pamsim.save_state`.

        Raises:
            InputError: if a model differs in what all worlds share, or a law has no counterpart.
        """
        now = {name: _numbers(array) for name, array in self._state().items()}
        for number, (model, state) in states.items():
            self._take(number, model)
            restore_state(self._base, self._scratch, state)
            for name, values in now.items():
                values[number] = getattr(self._scratch, name)
            self._given[number] = True
        for name, array in self._state().items():
            array.assign(now[name])
        self._data.act.assign(now["act"])
        self._data.time.assign(now["time"])
        self._par.assign(self._rows)
        for name, values in self._own.items():
            getattr(self._model, name).assign(values)

    def _take(self, number: int, model: mujoco.MjModel) -> None:
        """Take the parameters of one world from its model."""
        for name in _SHARED:
            if not np.array_equal(getattr(model, name), getattr(self._base, name)):
                raise InputError(
                    f"world {number} has another {name} than the first: radii, places and rest"
                    " lengths are the same in all worlds; simulate such rigs one after another"
                )
        _check_laws(model.actuator_user, self._precision)
        if self._valves.shape[0] == 1 and _falls(model):
            raise InputError(
                f"world {number} has a supply whose pressure falls with the flow, and the first has"
                " none; give it a valve.supply_resistance"
            )
        self._rows[number] = model.actuator_user
        for name, values in self._own.items():
            values[number] = getattr(model, name).reshape(values[number].shape)

    def _state(self) -> dict[str, Any]:
        """Arrays of the worlds by their names in MuJoCo's data."""
        names = ("qpos", "qvel", "qacc_warmstart", "ctrl", "qfrc_applied")
        arrays = {name: getattr(self._data, name) for name in names}
        return {**arrays, "act": self._act, "time": self._time}

    def push(self, torque: FloatArray, dofs: list[int]) -> None:
        """Torques or forces that act on joints from now on.

        Args:
            torque: (n, j) [N m or N].
            dofs: (j,) where each joint lies in ``qvel``.
        """
        applied = _numbers(self._data.qfrc_applied)
        applied[:, dofs] = torque
        self._data.qfrc_applied.assign(applied)

    def step(self, command: FloatArray, count: int = 1) -> None:
        """Make some time steps under one command.

        Args:
            command: (n, m) of each world's muscles.
            count: how many steps.

        Raises:
            InputError: if a world has no state yet.
        """
        if not self._given.all():
            raise InputError(
                f"world {int(np.argmin(self._given))} has no state: give it one by put()"
            )
        self._data.ctrl.assign(command)
        for _ in range(count):
            self._replay(self._one_step)

    def read(self) -> Readings:
        """Signals at the present state."""
        self._replay(self._measure)
        return Readings(
            position=_numbers(self._data.qpos),
            velocity=_numbers(self._data.qvel),
            pressure=_numbers(self._pressure),
            tension=_numbers(self._tension),
        )

    @property
    def position(self) -> FloatArray:
        """(n, nq) [rad or m]."""
        return _numbers(self._data.qpos)

    @property
    def act(self) -> FloatArray:
        """(n, na) states of the muscles."""
        return _numbers(self._act)

    @property
    def length(self) -> FloatArray:
        """(n, m) lengths of the actuators' tendons at the present position [m]."""
        self._replay(self._measure)
        return _numbers(self._data.actuator_length)

    @property
    def time(self) -> FloatArray:
        """(n,) [s]."""
        return _numbers(self._time)

    def state(self, number: int) -> FloatArray:
        """State of one world for `put`, or for `pamsim.restore_state` with a model of the rig."""
        for name, array in self._state().items():
            value = array[number : number + 1].numpy()[0]
            if name == "time":
                self._scratch.time = float(value)
            else:
                getattr(self._scratch, name)[:] = value
        return save_state(self._base, self._scratch)

    # --- what runs on the device ---

    def _replay(self, work: Callable[[], None]) -> None:
        """Do some work of many launches: the first time one by one, later in one."""
        graph = self._graphs.get(work)
        with self._wp.ScopedDevice(self._device):
            if graph is not None:
                self._wp.capture_launch(graph)
                return
            with compile_notice("the step for the device", "about a minute"):
                work()
            with self._wp.ScopedCapture(force_module_load=False) as capture:
                work()
        self._graphs[work] = capture.graph

    def _one_step(self) -> None:
        self._mjw.step(self._model, self._data)
        timestep = self._scalar(self.timestep)
        tick = self._wp.float64(self.timestep)
        given = [self._act, self._rates, self._time, timestep, tick, self._data.act]
        self._launch(self._kernels.advance, self.count, given)

    def _measure(self) -> None:
        self._mjw.fwd_position(self._model, self._data)
        self._mjw.fwd_velocity(self._model, self._data)
        given = [
            self._par,
            self._act,
            self._data.actuator_length,
            self._data.actuator_velocity,
            self._place,
            self._pressure,
            self._tension,
        ]
        self._launch(self._kernels.read, self._pressure.shape, given)

    def _pull(self, model: Any, data: Any) -> None:
        """The engine's callback: rates of the states, and forces, in place of gain and bias."""
        given = [
            self._par,
            self._act,
            self._rates,
            data.actuator_length,
            data.actuator_velocity,
            data.ctrl,
            self._time,
            self._scalar(self.timestep),
            self._place,
            self._valves,
            data.actuator_force,
        ]
        self._launch(self._kernels.step, self._pressure.shape, given)

    def _launch(self, kernel: Any, dim: Any, given: list[Any]) -> None:
        self._wp.launch(kernel, dim=dim, inputs=given, device=self._device)


def _numbers(array: Any) -> FloatArray:
    """A copy of a device's array."""
    return array.numpy().astype(float)


def _falls(model: mujoco.MjModel) -> bool:
    """Whether some supply's pressure falls with the flow drawn from it."""
    return bool(model.actuator_user[:, list(_SUPPLY_FALL.values())].any())


def _check_laws(rows: FloatArray, precision: str) -> None:
    """Refuse muscles that a GPU cannot evaluate, or not in a precision.

    Args:
        rows: (m, SIZE) parameters of the muscles.
        precision: of the worlds.

    Raises:
        InputError: for a law from outside the package; in single precision for a law that is
            searched more closely, an operator that remembers smaller moves, and a shared supply.
    """
    if max(rows[:, _LAW].max(), rows[:, _OPERATOR].max()) >= USER_DEFINED:
        raise InputError("a law from outside the package does not run on a GPU; use simulate_batch")
    close = {
        "the force law 'pleated_shape'": rows[:, _LAW] == _SHAPE,
        "the hysteresis 'arctangent'": rows[:, _OPERATOR] == _ARCTANGENT,
        **{name: rows[:, place] > 0.0 for name, place in _SUPPLY_FALL.items()},
    }
    for what, has in close.items():
        if precision == "float32" and has.any():
            raise InputError(f"{what} needs more than single precision: give precision='float64'")
