"""Remove the visual-only geoms of a model, which cost a third of every step.

MuJoCo places each geom at every step, whether it collides, has mass, or is a screw on the housing.
"""

from __future__ import annotations

import mujoco

_JOINT_LIKE = (
    mujoco.mjtObj.mjOBJ_JOINT,
    mujoco.mjtObj.mjOBJ_TENDON,
    mujoco.mjtObj.mjOBJ_ACTUATOR,
)


def remove_visual_geoms(spec: mujoco.MjSpec) -> None:
    """Remove the geoms of a specification that no force and no sensor can depend on.

    Where something in the model might depend on geoms (spatial tendons, contact pairs, a fluid,
    sensors of bodies or sites) all are kept.

    Args:
        spec: changed in place; its dynamics are bit-identical.
    """
    if _geoms_matter(spec):
        return
    for geom in list(spec.geoms):
        body = geom.parent
        if not geom.contype and not geom.conaffinity and (body.explicitinertial or _fixed(body)):
            spec.delete(geom)


def _geoms_matter(spec: mujoco.MjSpec) -> bool:
    option = spec.option
    return bool(
        spec.pairs
        or option.density
        or option.viscosity
        or any(sensor.objtype not in _JOINT_LIKE for sensor in spec.sensors)
        or any(
            wrap.type != mujoco.mjtWrap.mjWRAP_JOINT
            for tendon in spec.tendons
            for wrap in tendon.path
        )
    )


def _fixed(body: mujoco.MjsBody) -> bool:
    """Whether a body never moves, so that its mass has no effect."""
    while body.parent is not None:
        if body.joints:
            return False
        body = body.parent
    return True
