"""Whether a model can have contacts."""

from __future__ import annotations

import mujoco


def may_collide(model: mujoco.MjModel) -> bool:
    """Whether any geom of a model may touch another."""
    return bool(model.npair or model.geom_contype.any() or model.geom_conaffinity.any())
