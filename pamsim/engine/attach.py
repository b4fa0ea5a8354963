"""Give any MJCF tendon a pneumatic muscle."""

from __future__ import annotations

import dataclasses

import mujoco

from pamsim.core.errors import InputError, nearest
from pamsim.engine import plugin
from pamsim.engine.preflight import check_shared, control_range
from pamsim.engine.stepping import muscle_ids, refuse_multistage
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.record import SIZE, pack, slot, state_size

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

    The muscle's length is the tendon's plus ``length_at_zero``; it pulls the tendon shorter. Also
    turns off the engine's automatic reset, which would hide a diverged run.

    A process that loads the model from an MJB or a pickle must import pamsim and call
    `pamsim.engine.plugin.register` before: where the muscles' plugin is unknown, MuJoCo itself
    crashes.

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
        InputError: if there is no such tendon, or the name is taken; if ``length_at_zero`` is left
            out and the model so far does not compile.
        ParameterError: if ``length_at_zero`` is out of range.
        EngineError: if the model asks for the RK4 integrator.
    """
    names = [t.name for t in spec.tendons]
    if tendon not in names:
        raise InputError(f"no tendon {tendon!r} in this model; {nearest(tendon, names)}")
    name = name or tendon
    if any(actuator.name == name for actuator in spec.actuators):
        raise InputError(f"actuator {name!r} exists already; give another name")
    refuse_multistage(spec.option.integrator)
    if length_at_zero is None:
        length_at_zero = _nominal_length(muscle) - _initial_length(spec, tendon)
    muscle = dataclasses.replace(muscle, mounting=Mounting(length_at_zero=length_at_zero))
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.nuser_actuator = max(spec.nuser_actuator, SIZE)
    actuator = spec.add_actuator()
    actuator.name = name
    actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
    actuator.target = tendon
    actuator.plugin.name = _instance(spec)
    actuator.plugin.plugin_name = plugin.NAME
    actuator.plugin.active = True
    # The plugin overwrites what the engine makes of this. Without a type, the engine would ask a
    # callback that another library may have set.
    actuator.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    actuator.actdim = state_size(muscle)
    actuator.userdata = row = pack(muscle)
    actuator.ctrlrange = control_range(row) or (0.0, 0.0)
    return actuator


def compile_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a model with muscles.

    Raises:
        InputError: with the engine's own words, if the model does not compile; if muscles on one
            supply state it differently.
    """
    try:
        with plugin.not_evaluated():
            model = spec.compile()
    except ValueError as error:
        raise InputError(f"the model does not compile: {' '.join(str(error).split())}") from error
    _couple(model)
    check_shared(model)
    return model


def _nominal_length(muscle: Muscle) -> float:
    """Length of a muscle, or stroke of a pushing actuator, that nothing pulls or presses [m]."""
    return muscle.stroke.nominal_length if muscle.stroke else muscle.braided.nominal_length


def _initial_length(spec: mujoco.MjSpec, tendon: str) -> float:
    """Length of a tendon at the initial position [m], of a copy: a model compiles as a whole."""
    try:
        with plugin.not_evaluated():
            model = spec.copy().compile()
    except ValueError as error:
        raise InputError(
            f"the length of tendon {tendon!r} is unknown, since the model so far does not compile:"
            f" {' '.join(str(error).split())}; complete it first, or give length_at_zero"
        ) from error
    return float(model.tendon_length0[model.tendon(tendon).id])


def _instance(spec: mujoco.MjSpec) -> str:
    """Name of the plugin instance that a model's muscles share."""
    plugin.register()
    spec.activate_plugin(plugin.NAME)
    if all(instance.name != _INSTANCE for instance in spec.plugins):
        instance = spec.add_plugin()
        instance.name = _INSTANCE
        instance.plugin_name = plugin.NAME
        instance.active = True
    return _INSTANCE


def _couple(model: mujoco.MjModel) -> None:
    """Link every two muscles that pull on one joint from both sides.

    Their fixed tendons are the two ends of one chain, which backlash on its sprocket shifts.
    """
    ends: dict[int, list[tuple[int, float]]] = {}
    for index in muscle_ids(model):
        tendon = model.actuator_trnid[index, 0]
        first = model.tendon_adr[tendon]
        if model.tendon_num[tendon] == 1 and model.wrap_type[first] == mujoco.mjtWrap.mjWRAP_JOINT:
            joint = int(model.wrap_objid[first])
            ends.setdefault(joint, []).append((index, float(model.wrap_prm[first])))
    for pulling in ends.values():
        if len(pulling) == 2 and pulling[0][1] * pulling[1][1] < 0.0:
            (first, _), (second, _) = pulling
            model.actuator_user[first, _PARTNER] = second + 1
            model.actuator_user[second, _PARTNER] = first + 1
