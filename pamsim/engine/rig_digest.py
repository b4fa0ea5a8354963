"""Identify a rig by what it is, not by its name, for work that is resumed."""

from __future__ import annotations

import hashlib

import mujoco
import numpy as np

from pamsim.engine.rig import Rig


def rig_digest(rig: Rig) -> str:
    """Digest of a rig's compiled model, muscles included, its joints and its sensors."""
    content = np.empty(mujoco.mj_sizeModel(rig.model), np.uint8)
    mujoco.mj_saveModel(rig.model, None, content)
    digest = hashlib.sha256(content.tobytes())
    digest.update(repr((list(rig.joints.items()), rig.sensor)).encode())
    return digest.hexdigest()
