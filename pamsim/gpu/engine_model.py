"""A rig's model as `mujoco_warp` takes it: muscles as actuators whose force a callback writes."""

from __future__ import annotations

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.engine.attach import rig_spec
from pamsim.engine.rig import Rig


def engine_model(rig: Rig, model: mujoco.MjModel) -> mujoco.MjModel:
    """The model of a rig without the plugin, which `mujoco_warp` does not know.

    MuJoCo itself must not step it: its muscles would pull as plain actuators do.

    Args:
        rig: gives the MJCF.
        model: the rig's, set up for an experiment; all numbers are taken from it.

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
