"""Many copies of a rig on one device, each with parameters and a state of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np

from pamsim.core.catalog import USER_DEFINED
from pamsim.core.compilation import compile_notice
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.attach import rig_spec
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import Signals
from pamsim.engine.state import restore_state, save_state
from pamsim.engine.stepping import check_steppable
from pamsim.gpu.muscle_kernels import launch, muscle_kernels
from pamsim.gpu.port import find_device, mujoco_warp, port, warp
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.pleated import PleatedShape
from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import STATE_NAMES, slot
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
    "dof_dampingpoly",
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

_STATE = ("qpos", "qvel", "qacc_warmstart", "ctrl", "qfrc_applied")
_SHARED = ("wrap_prm", "qpos0", "tendon_length0", "body_pos")
"""Fields that all worlds share."""


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

    Raises:
        InputError: if Warp is not installed, device or precision unknown, or the rig has a law or
            an integrator that has no counterpart on a GPU or in that precision.
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
        self._device, self._kernels = find_device(device), muscle_kernels(precision)
        self._precision, self._scratch, self._base = precision, mujoco.MjData(model), model
        bare, scalar, timestep = engine_model(rig, model), port(precision).scalar, self.timestep
        self._shape = each = count, model.nactuator
        # Scratch for the fill valves of the muscles that feed each muscle's supply.
        feeds = (*each, model.nactuator) if _falls(model) else (1, 1, 1)
        first = model.actuator_actadr
        named = first + model.actuator_actnum - len(STATE_NAMES)
        numbers = {
            "par": (*each, model.nuser_actuator),
            "valves": (*feeds, VALVE),
            # The engine leaves the states of such actuators as they are and has a copy of them.
            **dict.fromkeys(("act", "rates"), (count, model.na)),
            **dict.fromkeys(("pressure", "pull"), each),
        }
        with wp.ScopedDevice(self._device):
            self._model = mjw.put_model(bare, batch_sizes=dict.fromkeys(_OWN, count))
            self._data = data = mjw.make_data(bare, nworld=count)
            self._arrays: dict[str, Any] = {
                **{name: wp.zeros(shape, dtype=scalar) for name, shape in numbers.items()},
                "time": wp.zeros(count, dtype=wp.float64),
                "place": wp.array(np.stack([first, named], axis=1), dtype=wp.int32),
            }
        self._arrays |= {
            "length": data.actuator_length,
            "speed": data.actuator_velocity,
            "force": data.actuator_force,
            "ctrl": data.ctrl,
            "shown": data.act,
            "timestep": scalar(timestep),
            "tick": wp.float64(timestep),
        }
        self._model.callback.act_bias = self._pull
        # By their names in MuJoCo: what each world has for itself, and its state.
        self._own = {name: getattr(self._model, name) for name in _OWN}
        self._own["actuator_user"] = self._arrays["par"]
        self._numbers = {name: _numbers(array) for name, array in self._own.items()}
        self._state = {name: getattr(data, name) for name in _STATE}
        self._state |= {name: self._arrays[name] for name in ("act", "time")}
        self._graphs: dict[Callable[[], None], Any] = {}
        self._given = np.zeros(count, dtype=np.bool_)

    @property
    def timestep(self) -> float:
        """Of the engine [s]."""
        return float(self._base.opt.timestep)

    def put(self, states: Mapping[int, tuple[mujoco.MjModel, FloatArray]]) -> None:
        """Give some worlds their parameters and a state.

        Number of a world -> the rig's model with its parameters, and a state of it, see
        `pamsim.save_state`.

        Raises:
            InputError: if a model differs in what all worlds share, or a law has no counterpart.
        """
        now = {name: _numbers(array) for name, array in self._state.items()}
        for number, (model, state) in states.items():
            self._check_shared(number, model)
            for name, values in self._numbers.items():
                values[number] = getattr(model, name).reshape(values[number].shape)
            restore_state(self._base, self._scratch, state)
            for name, values in now.items():
                values[number] = getattr(self._scratch, name)
            self._given[number] = True
        for name, array in self._state.items():
            array.assign(now[name])
        self._data.act.assign(now["act"])
        self._data.time.assign(now["time"])
        for name, array in self._own.items():
            array.assign(self._numbers[name])

    def _check_shared(self, number: int, model: mujoco.MjModel) -> None:
        for name in _SHARED:
            if not np.array_equal(getattr(model, name), getattr(self._base, name)):
                raise InputError(
                    f"world {number} has another {name} than the first, but radii, places and rest"
                    " lengths must be the same in all worlds; simulate such rigs one after another"
                )
        if model.opt.noslip_iterations != self._base.opt.noslip_iterations:
            raise InputError(
                f"world {number} has another form of dry friction than the first; give a"
                " friction_speed to all worlds or to none, or simulate them in two calls"
            )
        _check_laws(model.actuator_user, self._precision)
        if _falls(model) and not _falls(self._base):
            raise InputError(
                f"world {number} has a supply whose pressure falls with the flow, and the first has"
                " none; give it a valve.supply_resistance"
            )

    def push(self, torque: FloatArray, dofs: list[int]) -> None:
        """Torques or forces (n, j) from now on [N m or N] on joints at places (j,) in ``qvel``."""
        applied = _numbers(self._data.qfrc_applied)
        applied[:, dofs] = torque
        self._data.qfrc_applied.assign(applied)

    def step(self, command: FloatArray, count: int = 1) -> None:
        """Make some time steps under one command (n, m) of each world's muscles.

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

    def read(self) -> Signals:
        """Signals at the present state."""
        self._replay(self._measure)
        arrays = self._data.qpos, self._data.qvel, self._arrays["pressure"], self._arrays["pull"]
        return Signals(*map(_numbers, arrays))

    @property
    def position(self) -> FloatArray:
        """(n, nq) [rad or m]."""
        return _numbers(self._data.qpos)

    @property
    def act(self) -> FloatArray:
        """(n, na) states of the muscles."""
        return _numbers(self._arrays["act"])

    @property
    def length(self) -> FloatArray:
        """(n, m) lengths of the actuators' tendons at the present position [m]."""
        self._replay(self._measure)
        return _numbers(self._data.actuator_length)

    @property
    def time(self) -> FloatArray:
        """(n,) [s]."""
        return _numbers(self._arrays["time"])

    def state(self, number: int) -> FloatArray:
        """State of one world for `put`, or for `pamsim.restore_state` with a model of the rig."""
        for name, array in self._state.items():
            setattr(self._scratch, name, array[number : number + 1].numpy()[0])
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
        launch(self._kernels.advance, self.count, self._arrays, self._device)

    def _measure(self) -> None:
        self._mjw.fwd_position(self._model, self._data)
        self._mjw.fwd_velocity(self._model, self._data)
        launch(self._kernels.read, self._shape, self._arrays, self._device)

    def _pull(self, model: Any, data: Any) -> None:
        """The engine's callback: rates of the states, and forces, in place of gain and bias."""
        launch(self._kernels.step, self._shape, self._arrays, self._device)


def _numbers(array: Any) -> FloatArray:
    """A copy of a device's array."""
    return array.numpy().astype(float)


def _falls(model: mujoco.MjModel) -> bool:
    """Whether some supply's pressure falls with the flow drawn from it."""
    return bool(model.actuator_user[:, list(_SUPPLY_FALL.values())].any())


def _check_laws(rows: FloatArray, precision: str) -> None:
    """Refuse muscles, by their rows, that a GPU cannot evaluate, or not in single precision."""
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


def engine_model(rig: Rig, model: mujoco.MjModel) -> mujoco.MjModel:
    """The model of a rig without the plugin, which `mujoco_warp` does not know.

    MuJoCo itself must not step it: its muscles would pull as plain actuators do. All numbers are
    taken from the model, which is the rig's, set up for an experiment.

    Raises:
        InputError: if its integrator is neither Euler nor implicitfast.
    """
    name = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_").lower()
    if name not in ("euler", "implicitfast"):
        raise InputError(f"no integrator {name} on a GPU; give 'Euler' or 'implicitfast'")
    spec = rig_spec(rig.file, rig.muscles)
    for actuator in spec.actuators:
        actuator.plugin.active = False
        actuator.plugin.name = actuator.plugin.plugin_name = ""
        actuator.dyntype = mujoco.mjtDyn.mjDYN_USER
        actuator.gaintype = mujoco.mjtGain.mjGAIN_USER
        actuator.biastype = mujoco.mjtBias.mjBIAS_USER
    for plugin in list(spec.plugins):
        spec.delete(plugin)
    bare = spec.compile()
    for name in dir(model):
        value = getattr(model, name)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            getattr(bare, name)[:] = value
    for name in dir(model.opt):
        value = getattr(model.opt, name)
        if not name.startswith("_") and isinstance(value, int | float):
            setattr(bare.opt, name, value)
    bare.stat.meaninertia = model.stat.meaninertia
    # That engine resets no world by itself; nobody reads sensors, and they take long to compile.
    bits = mujoco.mjtDisableBit
    kept = model.opt.disableflags & ~int(bits.mjDSBL_AUTORESET)
    bare.opt.disableflags = kept | int(bits.mjDSBL_SENSOR)
    return bare
