"""A rig in the engine: its MJCF with a muscle on each declared tendon, parameters in place."""

from __future__ import annotations

import copy
import dataclasses
import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import Any

import mujoco
import numpy as np

from pamsim.core.errors import InputError, ParameterError, nearest
from pamsim.core.parameters import FieldSpec, Sourced, check_value, specs
from pamsim.engine import mjcf, mjcf_fields
from pamsim.engine.attach import compile_model, rig_spec
from pamsim.engine.parameter_names import ParameterName, muscles_with, sensor_spec
from pamsim.engine.preflight import MuscleLimits, muscle_limits, state_control_ranges
from pamsim.engine.stepping import set_integrator
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.muscle import Muscle, build_muscle, idle_groups
from pamsim.physics.record import slot, state_size, with_row
from pamsim.physics.valves import COMMANDS
from pamsim.recordings.rig_file import EFFECTS, RigFile, read_rig, refuse_code
from pamsim.recordings.sensors import MeasurementChain
from pamsim.recordings.signals import MUSCLE_DRIVES, SignalNames

_TIMESTEP = FieldSpec(
    unit="s", low=0.0, high=0.1, low_open=True, doc="valves and muscles change in milliseconds"
)


@dataclass(frozen=True, kw_only=True)
class Rig:
    """A loaded rig.

    Attributes:
        file: what its folder states, sources included.
        model: compiled, with its parameters.
        compiled: as the MJCF has it, before any parameter.
        joints: recorded joint -> ``angle`` if it turns, ``position`` if it slides.
        muscles: name -> muscle, in actuator order.
        sensor: measurement chain, or None.
        scene: whether it is loaded with floor and light, see `load_rig`.
    """

    file: RigFile
    model: mujoco.MjModel
    compiled: mujoco.MjModel
    joints: Mapping[str, str]
    muscles: Mapping[str, Muscle]
    sensor: MeasurementChain | None
    scene: bool

    @property
    def name(self) -> str:
        """Name of the rig."""
        return self.file.name

    @property
    def names(self) -> SignalNames:
        """Names of what the rig records."""
        return SignalNames(joints=self.joints, muscles=tuple(self.muscles))

    @property
    def position_addresses(self) -> list[int]:
        """Index of each recorded joint in ``data.qpos``."""
        return [int(self.model.joint(name).qposadr[0]) for name in self.joints]

    @property
    def velocity_addresses(self) -> list[int]:
        """Index of each recorded joint's rate in ``data.qvel``."""
        return [int(self.model.joint(name).dofadr[0]) for name in self.joints]

    @property
    def only_joint(self) -> str:
        """Name of the joint of a rig that has one.

        Raises:
            InputError: if there are several.
        """
        if len(self.joints) != 1:
            raise InputError(
                f"this needs a rig with one joint; rig {self.name!r} has {', '.join(self.joints)}"
            )
        return next(iter(self.joints))

    @property
    def takes_load(self) -> bool:
        """Whether it has a body that carries a load."""
        return self.file.load_body is not None

    @property
    def load_mass(self) -> str:
        """Native name of the mass that the load of an experiment sets; empty if it takes none."""
        return f"body.{self.file.load_body}.mass" if self.takes_load else ""

    @property
    def supply_pressure(self) -> float:
        """Gauge pressure of the supply, the lowest if the muscles' differ [Pa]."""
        return min(muscle.valve.supply_pressure for muscle in self.muscles.values())

    @cached_property
    def limits(self) -> list[MuscleLimits]:
        """What each muscle asks of a time step, see `pamsim.engine.preflight.check_timestep`."""
        return muscle_limits(self.model, self.muscles)

    def model_for(
        self,
        *,
        load: float = 0.0,
        command: str | Sequence[str] = "pressure_set",
        timestep: float | None = None,
        integrator: str | None = None,
        data: mujoco.MjData | None = None,
    ) -> mujoco.MjModel:
        """A copy of the model set up for one experiment.

        Args:
            load: mass on the arm [kg].
            command: what the control of all muscles, or of each, means, see `set_command`.
            timestep: [s]; the rig's own if left out.
            integrator: MJCF name such as ``implicitfast``; the rig's own if left out.
            data: of this rig's model or a copy of it, overwritten; saves making one.

        Raises:
            InputError: if the rig takes no load, or command or integrator is unknown.
            ParameterError: if the time step is out of range.
            EngineError: for the integrator RK4.
        """
        model = copy.copy(self.model)
        set_command(model, command)
        if integrator is not None:
            set_integrator(model, integrator)
        if timestep is not None:
            model.opt.timestep = check_value("time step", timestep, _TIMESTEP)
        body = self.file.load_body
        if load and body is None:
            raise InputError(f"rig {self.name!r} has no load body: it cannot carry {load:g} kg")
        masses = {self.load_mass: load} if self.takes_load else {}
        where = f"rig.load_body = {body!r} of {self.name!r}"
        mjcf_fields.set_natives(model, masses, self.compiled, data=data, where=where)
        return model

    def with_parameters(
        self, values: Mapping[str, float], *, data: mujoco.MjData | None = None
    ) -> Rig:
        """The rig with some parameters changed, such as ``{"passive.stiffness": 3e4}``.

        Args:
            values: name -> value in SI. ``group.field`` sets all muscles that have it,
                ``muscle:group.field`` one of them, a native name such as ``joint.shaft.damping`` an
                MJCF field, and ``sensor.field`` what `pamsim.recordings.sensors` makes of a
                recording. ``hysteresis.maxwell_slip.full_slip`` gives the muscles this hysteresis
                operator, as wide as their own.
            data: of this rig's model or a copy of it, overwritten; saves making one.

        Raises:
            InputError: for an unknown name, or several operators.
            ParameterError: for a value out of range, or that is no number.
        """
        for name, value in values.items():
            if isinstance(value, bool) or not isinstance(value, Real):
                raise ParameterError(f"{name} = {value!r} is not a number; give one in SI units")
        # Parameters of one muscle come after those of all.
        names = sorted(map(ParameterName.parse, values), key=lambda name: bool(name.muscle))
        operators = sorted({name.operator for name in names if name.operator})
        if len(operators) > 1:
            raise InputError(
                f"parameters of the operators {', '.join(operators)}: a muscle has only one;"
                " leave out the others"
            )
        if operators:
            plain = {name.without_operator: values[name.text] for name in names}
            return self.with_operator(operators[0]).with_parameters(plain)
        sensing = {name.field: values[name.text] for name in names if name.owner == "sensor"}
        sensor = self.sensor
        if sensing:
            for field in sensing:
                sensor_spec(field, self.joints.values())
            sensor = dataclasses.replace(sensor or MeasurementChain(), **sensing)
        if len(sensing) == len(names):  # nothing in the model depends on its sensors
            return dataclasses.replace(self, sensor=sensor)
        model = copy.copy(self.model)
        natives = {name.text: values[name.text] for name in names if name.owner == "native"}
        if self.load_mass in natives:
            raise InputError(f"{self.load_mass}: this body is the load; state `load` instead")
        mjcf_fields.set_natives(model, natives, self.compiled, data=data)
        rows = dict(zip(self.muscles, model.actuator_user, strict=True))
        for name in (one for one in names if one.owner == "muscle"):
            for muscle in muscles_with(name, self.muscles, self.file.native):
                rows[muscle][slot(name.parameter, self.muscles[muscle])] = values[name.text]
        state_control_ranges(model)
        muscles = {name: with_row(muscle, rows[name]) for name, muscle in self.muscles.items()}
        if [state_size(muscle) for muscle in muscles.values()] != model.actuator_actnum.tolist():
            # Another number of elements needs another memory.
            fresh = _compiled(self.file, muscles, scene=self.scene)
            mjcf_fields.copy_natives(model, fresh.model)
            return dataclasses.replace(fresh, sensor=sensor)
        return dataclasses.replace(self, model=model, muscles=muscles, sensor=sensor)

    def with_operator(self, law: str) -> Rig:
        """The rig with another hysteresis operator in every muscle, as wide as each one's own.

        The operator's other numbers are its usual ones, and all else stays.

        Args:
            law: of the package or of the rig; of those that have usual numbers.

        Raises:
            InputError: for another one.
        """
        known = {name: o.group for name, o in self.file.operators.items() if o.group.usual}
        if law not in known:
            raise InputError(f"operator {law!r} has no default parameters; {nearest(law, known)}")
        group, section = known[law], Hysteresis.group
        if all(isinstance(muscle.hysteresis, group) for muscle in self.muscles.values()):
            return self
        units = {name: spec.unit for name, spec in specs(group)}
        entries: dict[str, Any] = {
            name: Sourced(value=value, unit=units[name], source="assumed", where=law)
            for name, value in group.usual.items()
        }
        stated = self.file.muscle.get(section, {})
        entries |= {name: entry for name, entry in stated.items() if name in units}
        overrides = {
            muscle: {name: given for name, given in own.items() if name != section}
            for muscle, own in self.file.overrides.items()
        }
        shared = {**self.file.muscle, section: {"law": law, **entries}}
        file = dataclasses.replace(self.file, muscle=shared, overrides=overrides)
        numbers = {name: entry.si(units[name]) for name, entry in entries.items()}
        muscles = dict(self.muscles)
        for name, muscle in muscles.items():
            if not isinstance(muscle.hysteresis, group):
                width = {field: getattr(muscle.hysteresis, field) for field, _ in specs(Hysteresis)}
                operator = group(**{**numbers, **width})
                muscles[name] = dataclasses.replace(muscle, hysteresis=operator)
        fresh = _compiled(file, muscles, scene=self.scene)
        mjcf_fields.copy_natives(self.model, fresh.model)
        return dataclasses.replace(fresh, sensor=self.sensor)


def load_rig(rig: str | os.PathLike[str], *, scene: bool = False, recorded: bool = False) -> Rig:
    """Load a rig, which runs its ``effects.py`` if it has one.

    Args:
        rig: name of a shipped rig such as ``mas20_arm``, or path of a rig folder.
        scene: True to load it with floor and light, for pictures. Otherwise what is there only to
            be seen is left out, which makes steps quicker and changes no result.
        recorded: whether a recording names it and not the user, who then has not asked for what is
            in its ``effects.py``.

    Raises:
        InputError: for a bad file, naming file and key; for a recorded rig with an ``effects.py``.
        ParameterError: for a value out of range.
    """
    if recorded:
        refuse_code(rig)
    return _compiled(read_rig(rig), scene=scene)


def given_or_recorded(rig: str | os.PathLike[str] | Rig | None, named: str) -> Rig:
    """The rig that the user gives, loaded or by name or folder, or the one that a recording names.

    Raises:
        InputError: as `load_rig`.
    """
    return rig if isinstance(rig, Rig) else load_rig(rig or named, recorded=not rig)


def _compiled(
    file: RigFile, muscles: Mapping[str, Muscle] | None = None, *, scene: bool = False
) -> Rig:
    """A rig by what its folder states, with other muscles if some are given."""
    where, own = file.folder / "params.toml", (*file.own.laws, *file.own.operators)
    muscles = muscles or {
        name: build_muscle(_merged(file, name), where=f"{where}: {name}", own=own)
        for name in file.tendons
    }
    spec = rig_spec(file, muscles, scene=scene)
    _check_options(spec, f"{file.mjcf}: option")
    model = compile_model(spec)
    compiled = copy.copy(model)
    mjcf_fields.make_friction_stick(model)
    natives = {
        name: entry.si(mjcf_fields.native_field(model, name, where=entry.where).unit)
        for name, entry in file.native.items()
    }
    mjcf_fields.set_natives(model, natives, compiled)
    kinds = mujoco.mjtObj
    wanted = [("joints", kinds.mjOBJ_JOINT, joint) for joint in file.joints]
    wanted += [("load_body", kinds.mjOBJ_BODY, body) for body in [file.load_body] if body]
    for key, kind, name in wanted:
        if mujoco.mj_name2id(model, kind, name) < 0:
            raise InputError(f"{where}: rig.{key} = {name!r} is not in {file.mjcf}")
    joints = mjcf.recorded_joints(model, file.joints, file.tendons.values(), where)
    sensor = {
        name: entry.si(sensor_spec(name, joints.values(), str(where)).unit)
        for name, entry in file.sensor.items()
    }
    try:
        SignalNames(joints=joints, muscles=tuple(muscles))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Rig(
        file=file,
        model=model,
        compiled=compiled,
        joints=joints,
        muscles=muscles,
        sensor=MeasurementChain(**sensor) if sensor else None,
        scene=scene,
    )


def _check_options(spec: mujoco.MjSpec, where: str) -> None:
    """Refuse an MJCF that asks for steps of no length, or for muscles that do not act."""
    option = spec.option
    if not 0.0 < option.timestep < np.inf:
        raise InputError(f"{where}: timestep = {option.timestep:g}; write one such as 0.0005")
    off = option.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION
    if off or any(1 << one.group & option.disableactuator for one in spec.actuators):
        raise InputError(
            f"{where}: its muscles do not act, because actuation or their group of actuators is"
            " disabled; leave that out"
        )


def set_command(model: mujoco.MjModel, command: str | Sequence[str]) -> None:
    """Set what the control of the muscles of a rig's model means, of all or each in order.

    A command is ``valve``, ``pulse``, ``pressure_set``, ``measured``, or ``sealed``, a valve whose
    control is to stay 0.

    Raises:
        InputError: if a command is unknown, or there is not one for each muscle.
    """
    given = [command] * model.nactuator if isinstance(command, str) else command
    if len(given) != model.nactuator:
        raise InputError(
            f"{len(given)} commands for {model.nactuator} muscles; give one name, or one per muscle"
        )
    for name in given:
        if name not in MUSCLE_DRIVES:
            raise InputError(f"no command {name!r}; {nearest(name, MUSCLE_DRIVES)}")
    codes = [COMMANDS.index("valve" if name == "sealed" else name) for name in given]
    model.actuator_user[:, slot("command")] = codes
    state_control_ranges(model)


def _merged(file: RigFile, name: str) -> dict[str, dict[str, Any]]:
    """Sections of one actuator: shared ones, its own, and of the shared only what it can have.

    Shared groups without a meaning for it are left out where another actuator of the rig uses them.
    """
    merged = {group: dict(section) for group, section in file.muscle.items()}
    for group, section in file.overrides[name].items():
        merged.setdefault(group, {}).update(section)
    others = [idle_groups({**file.muscle, **own}) for own in file.overrides.values()]
    for group in idle_groups(merged) - set(file.overrides[name]):
        if any(group not in idle for idle in others):
            merged.pop(group, None)
    return merged


def rig_digest(rig: Rig) -> str:
    """Digest of a rig's compiled model, muscles included, its joints, its sensors and its files.

    It identifies a rig by what it is, not by its name, for work that is resumed.
    """
    content = np.empty(mujoco.mj_sizeModel(rig.model), np.uint8)
    mujoco.mj_saveModel(rig.model, None, content)
    digest = hashlib.sha256(content.tobytes())
    digest.update(repr((list(rig.joints.items()), rig.sensor)).encode())
    for name in ("params.toml", EFFECTS):
        path = rig.file.folder / name
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()
