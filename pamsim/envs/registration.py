"""Names under which Gymnasium makes the environments."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import gymnasium

ENVIRONMENT = "pamsim/Rig-v0"
"""Id of the environment of any rig."""

ARMS: Mapping[str, str] = MappingProxyType(
    {
        "pamsim/PamArmPressure-v0": "pressure_set",
        "pamsim/PamArmValve-v0": "valve",
        "pamsim/PamArmOnOff-v0": "on_off",
    }
)
"""Ids of the same environment for the rig ``mas20_arm`` -> their actions."""

EPISODE = 400
"""Steps of an episode, unless `gymnasium.make` is given other ``max_episode_steps``."""


def register() -> None:
    """Make the environments known to Gymnasium; does nothing if they are.

    Gymnasium calls it by itself where pamsim is installed.
    """
    for name, action in {ENVIRONMENT: "pressure_set", **ARMS}.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point="pamsim.envs.rig_env:RigEnv",
                vector_entry_point="pamsim.envs.rig_vector_env:RigVectorEnv",
                max_episode_steps=EPISODE,
                kwargs={"action": action},
            )
