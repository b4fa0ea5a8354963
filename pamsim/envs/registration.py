"""Names under which Gymnasium makes the environments."""

from __future__ import annotations

import gymnasium

_CLASSES = {
    "pamsim/PamArmPressure-v0": "PamArmPressure",
    "pamsim/PamArmValve-v0": "PamArmValve",
    "pamsim/PamArmOnOff-v0": "PamArmOnOff",
}

ENVIRONMENTS: tuple[str, ...] = tuple(_CLASSES)
"""Ids of the environments."""


def register() -> None:
    """Make the environments known to Gymnasium; does nothing if they are.

    Gymnasium calls it by itself where pamsim is installed.
    """
    for name, stem in _CLASSES.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point=f"pamsim.envs.pam_arm:{stem}Env",
                vector_entry_point=f"pamsim.envs.pam_arm_vector:{stem}VectorEnv",
            )
