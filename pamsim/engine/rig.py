"""A rig in the engine: its MJCF with a muscle on each declared tendon, parameters in place."""

from __future__ import annotations

import copy
import dataclasses
import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from pamsim.core.catalog import MOST_PARAMETERS
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import FieldSpec, Sourced, check_value, specs
from pamsim.engine.attach import attach, compile_model
from pamsim.engine.mjcf import (
    put_rod,
    read_spec,
    read_text,
    recorded_joints,
    remove_visual_geoms,
)
from pamsim.engine.mjcf_fields import (
    apply_friction_speed,
    changes_constants,
    copy_natives,
    make_friction_stick,
    native_field,
    reserve_friction_speed,
    set_mass,
    set_native,
)
from pamsim.engine.parameters import ParameterName, sensor_spec
from pamsim.engine.preflight import state_control_ranges
from pamsim.engine.stepping import set_integrator
from pamsim.physics.build import build_muscle, idle_groups
from pamsim.physics.commands import COMMANDS
from pamsim.physics.hysteresis.group import COMMON_FIELDS
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import (
    SIZE,
    has_parameter,
    slot,
    unpack,
    with_row,
)
from pamsim.recordings.rig_file import RigFile, read_rig
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
    """

    file: RigFile
    model: mujoco.MjModel
    compiled: mujoco.MjModel
    joints: Mapping[str, str]
    muscles: Mapping[str, Muscle]
    sensor: MeasurementChain | None

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
    def angle_address(self) -> int:
        """Index of the only joint's angle in ``data.qpos``.

        Raises:
            InputError: if there are several.
        """
        _ = self.only_joint
        return self.position_addresses[0]

    @property
    def velocity_address(self) -> int:
        """Index of the only joint's rate in ``data.qvel``.

        Raises:
            InputError: if there are several.
        """
        _ = self.only_joint
        return self.velocity_addresses[0]

    @property
    def takes_load(self) -> bool:
        """Whether it has a body that carries a load."""
        return self.file.load_body is not None

    @property
    def supply_pressure(self) -> float:
        """Gauge pressure of the supply, the lowest if the muscles' differ [Pa]."""
        return min(muscle.valve.supply_pressure for muscle in self.muscles.values())

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
            data: of a model of this rig file, overwritten; saves making one.

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
        self._put_load(model, load, data)
        apply_friction_speed(model)
        return model

    def _put_load(self, model: mujoco.MjModel, load: float, data: mujoco.MjData | None) -> None:
        body = self.file.load_body
        if body is None:
            if load:
                raise InputError(f"rig {self.name!r} has no load body: it cannot carry {load:g} kg")
            return
        where = f"rig.load_body = {body!r} of {self.name!r}"
        set_mass(model, model.body(body).id, load, self.compiled, where=where)
        mujoco.mj_setConst(model, data or mujoco.MjData(model))

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
            data: of a model of this rig file, overwritten; saves making one.

        Raises:
            InputError: for an unknown name, or several operators.
            ParameterError: for a value out of range.
        """
        names = [ParameterName.parse(name) for name in values]
        operators = sorted({name.operator for name in names if name.operator})
        if len(operators) > 1:
            raise InputError(f"a muscle has one operator, not {', '.join(operators)}")
        if operators:
            plain = {name.without_operator: values[name.text] for name in names}
            return self.with_operator(operators[0]).with_parameters(plain)
        sensing = {name.field: values[name.text] for name in names if name.owner == "sensor"}
        for field in sensing:
            sensor_spec(field)
        # Nothing in the model depends on its sensors.
        model = self.model if len(sensing) == len(names) else copy.copy(self.model)
        # Parameters of one muscle come after those of all.
        for name in sorted(names, key=lambda name: bool(name.muscle)):
            if name.owner == "native":
                set_native(model, name.text, values[name.text], self.compiled)
            elif name.owner == "muscle":
                self._set_of_muscles(model, name, values[name.text])
        natives = [name.text for name in names if name.owner == "native"]
        if any(map(changes_constants, natives)):
            mujoco.mj_setConst(model, data or mujoco.MjData(model))
        if natives:
            apply_friction_speed(model)
        muscles = self.muscles
        if model is not self.model:
            state_control_ranges(model)
            rows, before = model.actuator_user, self.model.actuator_user
            muscles = {
                name: with_row(muscle, rows[index], before[index])
                for index, (name, muscle) in enumerate(self.muscles.items())
            }
        sensor = self.sensor
        if sensing:
            sensor = dataclasses.replace(sensor or MeasurementChain(), **sensing)
        return dataclasses.replace(self, model=model, muscles=muscles, sensor=sensor)

    def _set_of_muscles(self, model: mujoco.MjModel, name: ParameterName, value: float) -> None:
        only, parameter = name.muscle, name.parameter
        if only and only not in self.muscles:
            raise InputError(f"no muscle {only!r}; {nearest(only, self.muscles)}")
        shared = not only and any(has_parameter(m, parameter) for m in self.muscles.values())
        for index, (muscle_name, muscle) in enumerate(self.muscles.items()):
            if shared and not has_parameter(muscle, parameter):
                continue  # a bellows beside muscles has no braid
            if only in ("", muscle_name):
                model.actuator_user[index, slot(parameter, muscle)] = value

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
            raise InputError(f"no usual numbers of the operator {law!r}; {nearest(law, known)}")
        if all(isinstance(m.hysteresis, known[law]) for m in self.muscles.values()):
            return self
        units = {name: spec.unit for name, spec in specs(known[law])}
        fields = {
            name: Sourced(value=value, unit=units[name], source="assumed", where=law)
            for name, value in known[law].usual.items()
        }
        own = self.file.muscle.get("hysteresis", {})
        fields |= {n: e for n, e in own.items() if n in units and isinstance(e, Sourced)}
        overrides = {
            muscle: {group: entries for group, entries in own.items() if group != "hysteresis"}
            for muscle, own in self.file.overrides.items()
        }
        sections = {**self.file.muscle, "hysteresis": {"law": law, **fields}}
        fresh = _compiled(dataclasses.replace(self.file, muscle=sections, overrides=overrides))
        code = slot("hysteresis.law")
        replaced = {code, *range(code + 1 + COMMON_FIELDS, code + 1 + MOST_PARAMETERS)}
        kept = [index for index in range(SIZE) if index not in replaced]
        fresh.model.actuator_user[:, kept] = self.model.actuator_user[:, kept]
        copy_natives(self.model, fresh.model)
        state_control_ranges(fresh.model)
        muscles = {n: unpack(fresh.model.actuator_user[i]) for i, n in enumerate(self.muscles)}
        return dataclasses.replace(fresh, muscles=muscles, sensor=self.sensor)


def load_rig(rig: str | os.PathLike[str], *, scene: bool = False) -> Rig:
    """Load a rig.

    Args:
        rig: name of a shipped rig such as ``mas20_arm``, or path of a rig folder.
        scene: True to load it with floor and light, for pictures. Otherwise what is there only to
            be seen is left out, which makes steps quicker and changes no result.

    Raises:
        InputError: for a bad file, naming file and key.
        ParameterError: for a value out of range.
    """
    return _compiled(read_rig(rig), scene=scene)


def _compiled(file: RigFile, *, scene: bool = False) -> Rig:
    """A rig by what its folder states; see `load_rig`."""
    own = (*file.own.laws, *file.own.operators)
    muscles = {
        name: build_muscle(
            _merged(file, name), where=f"{file.folder / 'params.toml'}: {name}", own=own
        )
        for name in file.tendons
    }
    spec = rig_spec(file, muscles, scene=scene)
    model = compile_model(spec)
    compiled = copy.copy(model)
    make_friction_stick(model)
    for name, entry in file.native.items():
        unit = native_field(model, name, where=entry.where).unit
        set_native(model, name, entry.si(unit), compiled)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    apply_friction_speed(model)
    for joint in file.joints:
        _require(model, mujoco.mjtObj.mjOBJ_JOINT, "rig.joints", joint, file)
    if file.load_body:
        _require(model, mujoco.mjtObj.mjOBJ_BODY, "rig.load_body", file.load_body, file)
    joints = recorded_joints(model, file.joints, file.tendons.values(), file.folder / "params.toml")
    rig = Rig(
        file=file,
        model=model,
        compiled=compiled,
        joints=joints,
        muscles=muscles,
        sensor=_sensor(file),
    )
    try:
        _ = rig.names
    except InputError as error:
        raise InputError(f"{file.folder / 'params.toml'}: {error}") from None
    return rig


def rig_spec(file: RigFile, muscles: Mapping[str, Muscle], *, scene: bool = False) -> mujoco.MjSpec:
    """A rig's MJCF with a muscle on each declared tendon, to be compiled.

    Args:
        file: what its folder states.
        muscles: name -> muscle.
        scene: see `load_rig`.

    Raises:
        InputError: for an MJCF that cannot be read, or has actuators of its own.
    """
    path = file.scene if scene and file.scene else file.mjcf
    if path != file.mjcf:  # a scene includes the rig's own MJCF, which errors should name
        read_text(file.mjcf)
    spec = read_spec(path)
    if spec.actuators:
        raise InputError(
            f"{path}: a rig's MJCF may not have actuators, as {spec.actuators[0].name!r}; its"
            " muscles come from params.toml. Remove it, or use pamsim.attach for a mixed model"
        )
    if not scene:
        remove_visual_geoms(spec)
    for joint in file.rods:
        put_rod(spec, joint, file.folder / "params.toml")
    for name, tendon in file.tendons.items():
        muscle = muscles[name]
        own = muscle.mounting.length_at_zero
        attach(spec, tendon=tendon, muscle=muscle, name=name, length_at_zero=own)
    reserve_friction_speed(spec)
    return spec


def set_command(model: mujoco.MjModel, command: str | Sequence[str]) -> None:
    """Set what the control of the muscles means.

    Args:
        model: of a rig; changed in place.
        command: of all muscles, or one per muscle in actuator order: ``valve``, ``pulse``,
            ``pressure_set``, ``measured``, or ``sealed``, a valve whose control is to stay 0.

    Raises:
        InputError: if a command is unknown.
    """
    given = [command] if isinstance(command, str) else command
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


def _sensor(file: RigFile) -> MeasurementChain | None:
    if not file.sensor:
        return None
    where = str(file.folder / "params.toml")
    fields = {name: entry.si(sensor_spec(name, where).unit) for name, entry in file.sensor.items()}
    return MeasurementChain(**fields)


def _require(model: mujoco.MjModel, kind: Any, key: str, name: str, file: RigFile) -> None:
    if mujoco.mj_name2id(model, kind, name) < 0:
        raise InputError(f"{file.folder / 'params.toml'}: {key} = {name!r} is not in {file.mjcf}")


def rig_digest(rig: Rig) -> str:
    """Digest of a rig's compiled model, muscles included, its joints and its sensors.

    It identifies a rig by what it is, not by its name, for work that is resumed.
    """
    content = np.empty(mujoco.mj_sizeModel(rig.model), np.uint8)
    mujoco.mj_saveModel(rig.model, None, content)
    digest = hashlib.sha256(content.tobytes())
    digest.update(repr((list(rig.joints.items()), rig.sensor)).encode())
    return digest.hexdigest()
