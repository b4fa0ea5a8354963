"""The model that a window shows of a rig: its scene, with sliders in place of the muscles."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from pamsim.engine.rig import Rig


def window_model(rig: Rig, sliders: Mapping[str, tuple[float, float]]) -> mujoco.MjModel:
    """Compile it.

    Args:
        rig: loaded with its scene.
        sliders: name -> ends of its range, in any unit: no control of this model moves anything.
    """
    spec = mujoco.MjSpec.from_file(str(rig.file.scene or rig.file.mjcf))
    for name, ends in sliders.items():
        slider = spec.add_actuator(name=name, ctrllimited=True, ctrlrange=ends)
        slider.trntype, slider.target = mujoco.mjtTrn.mjTRN_JOINT, next(iter(rig.joints))
    spec.visual.map.shadowclip = 4.0
    overview = spec.camera("overview")
    if overview is not None:
        spec.visual.global_.fovy = overview.fovy
    model = spec.compile()
    # The radius of a sprocket, by which its chain is drawn. The rig may have tendons of its own.
    model.wrap_prm[:] = rig.model.wrap_prm[: len(model.wrap_prm)]
    return model
