"""Give any MJCF tendon a pneumatic muscle."""

from __future__ import annotations

import mujoco

from pamsim.actuator.layout import SIZE, pack, state_size
from pamsim.actuator.muscle import Muscle
from pamsim.core.errors import InputError, nearest
from pamsim.engine.callback import guard, refuse_multistage


def attach(
    spec: mujoco.MjSpec, *, tendon: str, muscle: Muscle, name: str | None = None
) -> mujoco.MjsActuator:
    """Put a pneumatic muscle on a tendon of a model that is being built.

    The muscle's length is the tendon's plus ``muscle.mounting.length_at_zero``; it pulls the tendon
    shorter. Also turns off the engine's automatic reset, which would hide a diverged run.

    Args:
        spec: the model; changed in place. Compile it with `compile_model`.
        tendon: name of a tendon of it, fixed or spatial.
        muscle: what to attach.
        name: name of the actuator; the tendon's if left out.

    Returns:
        The new actuator, for settings of its own such as ``damping``.

    Raises:
        InputError: if there is no such tendon, or the name is taken.
        EngineError: if the model asks for the RK4 integrator.
    """
    names = [t.name for t in spec.tendons]
    if tendon not in names:
        raise InputError(f"no tendon {tendon!r} in this model; {nearest(tendon, names)}")
    name = name or tendon
    if any(actuator.name == name for actuator in spec.actuators):
        raise InputError(f"actuator {name!r} exists already; give another name")
    refuse_multistage(spec.option.integrator)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.nuser_actuator = max(spec.nuser_actuator, SIZE)
    actuator = spec.add_actuator()
    actuator.name = name
    actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
    actuator.target = tendon
    actuator.dyntype = mujoco.mjtDyn.mjDYN_USER
    actuator.gaintype = mujoco.mjtGain.mjGAIN_USER
    actuator.biastype = mujoco.mjtBias.mjBIAS_USER
    actuator.actdim = state_size(muscle)
    actuator.userdata = pack(muscle)
    return actuator


def compile_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a model with muscles, guarded: it steps only inside `pamsim.live`.

    Raises:
        InputError: with the engine's own words, if the model does not compile.
    """
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"the model does not compile: {' '.join(str(error).split())}") from error
    guard(model)
    return model
