"""Muscles on the tendons of an MJCF, a user's own or a rig's."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from pamsim.core.errors import InputError, nearest
from pamsim.engine import plugin
from pamsim.engine.mjcf import leave_out_visual_geoms, read_spec, read_text
from pamsim.engine.mjcf_fields import reserve_friction_speed
from pamsim.engine.preflight import check_shared, control_range
from pamsim.engine.stepping import muscle_ids, refuse_multistage
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.record import SIZE, pack, slot, state_size
from pamsim.recordings.rig_file import RigFile

_PARTNER = slot("partner")
_INSTANCE = "pneumatic muscles"


def attach(
    spec: mujoco.MjSpec,
    *,
    tendon: str,
    muscle: Muscle,
    name: str | None = None,
    length_at_zero: float | None = None,
) -> mujoco.MjsActuator:
    """Put a pneumatic muscle on a tendon of a model that is being built.

    The muscle's length is the tendon's plus ``length_at_zero``; it pulls the tendon shorter.

    A process that loads the model from an MJB or a pickle must call `pamsim.register` before: where
    the muscles' plugin is unknown, MuJoCo itself crashes.

    Args:
        spec: the model; changed in place. Compile it with `compile_model`.
        tendon: name of a tendon of it, fixed or spatial.
        muscle: what to attach.
        name: name of the actuator; the tendon's if left out.
        length_at_zero: muscle length where the tendon's length is zero [m], in place of
            ``muscle.mounting.length_at_zero``, which belongs to the tendon of another rig. If left
            out, the muscle has its nominal length at the model's initial position.

    Returns:
        The new actuator, for settings of its own such as ``damping``.

    Raises:
        InputError: for a model that is not being built, such as a `mujoco.MjModel`, or a muscle's
            mere name; if there is no such tendon, or the name is taken; if ``length_at_zero`` is
            left out and the model so far does not compile.
        ParameterError: if ``length_at_zero`` is out of range.
        EngineError: if the model asks for the RK4 integrator.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise InputError(
            "attach changes a model that is being built: give a mujoco.MjSpec, such as"
            f" mujoco.MjSpec.from_file('arm.xml'), not a {type(spec).__name__}"
        )
    if not isinstance(muscle, Muscle):
        raise InputError(
            "give a muscle of a rig, such as pamsim.load_rig('mas20_arm').muscles['muscle_1'],"
            f" not a {type(muscle).__name__}"
        )
    names = [t.name for t in spec.tendons if t.name]
    if tendon not in names:
        raise InputError(f"no tendon {tendon!r} in this model; {nearest(str(tendon), names)}")
    name = name or tendon
    if any(actuator.name == name for actuator in spec.actuators):
        raise InputError(f"actuator {name!r} exists already; give another name")
    refuse_multistage(spec.option.integrator)
    if length_at_zero is None:
        model = _compiled(  # of a copy: a model compiles as a whole
            spec.copy(),
            f"the length of tendon {tendon!r} is unknown, since the model so far does not compile",
            "; complete it first, or give length_at_zero",
        )
        free = muscle.stroke or muscle.braided  # nothing pulls or presses it
        length_at_zero = free.nominal_length - float(model.tendon_length0[model.tendon(tendon).id])
    muscle = dataclasses.replace(muscle, mounting=Mounting(length_at_zero=length_at_zero))
    plugin.register()
    spec.activate_plugin(plugin.NAME)
    if all(instance.name != _INSTANCE for instance in spec.plugins):
        spec.add_plugin(name=_INSTANCE, plugin_name=plugin.NAME, active=True)
    if spec.nuser_actuator >= 0:  # else the engine counts, also in a model that this one is put in
        spec.nuser_actuator = max(spec.nuser_actuator, SIZE)
    row = pack(muscle)
    ends, limited = control_range(row), mujoco.mjtLimited
    actuator = spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        target=tendon,
        # The plugin overwrites what the engine makes of this. Without a type, the engine would ask
        # a callback that another library may have set.
        dyntype=mujoco.mjtDyn.mjDYN_INTEGRATOR,
        actdim=state_size(muscle),
        userdata=row,
        ctrlrange=ends or (0.0, 0.0),
        ctrllimited=limited.mjLIMITED_TRUE if ends else limited.mjLIMITED_FALSE,
        # Defaults that a model states are for the motors of its own.
        forcelimited=limited.mjLIMITED_FALSE,
        actlimited=limited.mjLIMITED_FALSE,
        gear=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        armature=0.0,
        delay=0.0,
        nsample=0,
    )
    actuator.damping = 0.0 * np.asarray(actuator.damping)
    actuator.plugin.name, actuator.plugin.plugin_name = _INSTANCE, plugin.NAME
    actuator.plugin.active = True
    return actuator


def rig_spec(file: RigFile, muscles: Mapping[str, Muscle], *, scene: bool = False) -> mujoco.MjSpec:
    """A rig's MJCF with each of its muscles, by name, on the declared tendon; to be compiled.

    Raises:
        InputError: for an MJCF that cannot be read, or has actuators of its own.
    """
    path = file.scene if scene and file.scene else file.mjcf
    if path != file.mjcf:  # a scene includes the rig's own MJCF, which errors should name
        read_text(file.mjcf)
    spec = read_spec(path)
    if spec.actuators:
        raise InputError(
            f"{path}: a rig's MJCF may not have actuators, as {spec.actuators[0].name!r}; remove"
            " <actuator>, its muscles come from params.toml, or use pamsim.attach for a mixed model"
        )
    if not scene:
        leave_out_visual_geoms(spec)
    for joint in dict.fromkeys(file.rods):
        _put_rod(spec, joint, file.folder / "params.toml")
    for name, tendon in file.tendons.items():
        muscle = muscles[name]
        own = muscle.mounting.length_at_zero
        attach(spec, tendon=tendon, muscle=muscle, name=name, length_at_zero=own)
    reserve_friction_speed(spec)
    return spec


def _put_rod(spec: mujoco.MjSpec, joint: str, where: Path) -> None:
    """Give a joint that slides a tendon of its own name, as long as its position."""
    known = {found.name: found.type for found in spec.joints}
    if joint not in known:
        raise InputError(f"{where}: no joint {joint!r} in the MJCF; {nearest(joint, known)}")
    if known[joint] != mujoco.mjtJoint.mjJNT_SLIDE:
        raise InputError(
            f"{where}: joint {joint!r} does not slide; put the actuator on a fixed tendon, whose"
            " coefficient is the lever arm"
        )
    if any(tendon.name == joint for tendon in spec.tendons):
        raise InputError(
            f"{where}: the MJCF has a tendon {joint!r}; name it in place of the joint, or rename it"
        )
    spec.add_tendon(name=joint).wrap_joint(joint, 1.0)


def compile_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a model with muscles.

    Turns off the engine's automatic reset, which would hide a diverged run.

    Raises:
        InputError: with the engine's own words, if the model does not compile; if muscles on one
            supply or one chain state it differently; if a delay or a limit of the tendon's force is
            stated for a muscle, which the engine has for actuators of its own only.
        EngineError: if a model with muscles asks for the RK4 integrator.
    """
    model = _compiled(spec, "the model does not compile")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    _refuse_unheeded(model)
    _couple(model)
    check_shared(model)
    return model


def _refuse_unheeded(model: mujoco.MjModel) -> None:
    """Refuse what muscles cannot have, and what the engine would leave out in silence."""
    for index in muscle_ids(model):
        refuse_multistage(model.opt.integrator)
        tendon = model.actuator_trnid[index, 0]
        if model.actuator_delay[index]:
            raise InputError(
                f"MuJoCo does not delay the control of muscle {model.actuator(index).name!r};"
                " remove `delay`, and write a later value to data.ctrl"
            )
        if model.tendon_actfrclimited[tendon]:
            raise InputError(
                f"MuJoCo does not limit the force of muscle {model.actuator(index).name!r} by"
                " actuatorfrcrange of its tendon; remove that, or set forcerange of the actuator"
            )


def _compiled(spec: mujoco.MjSpec, failed: str, instead: str = "") -> mujoco.MjModel:
    try:
        with plugin.not_evaluated():
            return spec.compile()
    except ValueError as error:
        raise InputError(f"{failed}: {' '.join(str(error).split())}{instead}") from error


def _couple(model: mujoco.MjModel) -> None:
    """Link every two muscles that pull on one joint from both sides.

    Their fixed tendons are the two ends of one chain, which backlash on its sprocket shifts.
    """
    ends: dict[int, list[tuple[int, float]]] = {}
    for index in muscle_ids(model):
        tendon = model.actuator_trnid[index, 0]
        first = model.tendon_adr[tendon]
        if model.tendon_num[tendon] == 1 and model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT:
            radius = float(model.wrap_prm[first])
            ends.setdefault(int(model.wrap_objid[first]), []).append((index, radius))
    for pulling in ends.values():
        if len(pulling) == 2 and pulling[0][1] * pulling[1][1] < 0.0:
            (first, _), (second, _) = pulling
            model.actuator_user[first, _PARTNER] = second + 1
            model.actuator_user[second, _PARTNER] = first + 1
