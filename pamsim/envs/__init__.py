"""Gymnasium environments of any rig; importing this room registers them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import gymnasium

ENVIRONMENT = "pamsim/Rig-v0"
"""Id of the environment of any rig."""

MAS20: Mapping[str, str] = MappingProxyType(
    {
        "pamsim/PamArmPressure-v0": "pressure_set",
        "pamsim/PamArmValve-v0": "valve",
        "pamsim/PamArmOnOff-v0": "on_off",
    }
)
"""Ids of the same environment for the rig ``mas20_arm`` -> their actions."""

EPISODE = 400
"""Steps of an episode, unless `gymnasium.make` is given other ``max_episode_steps``."""

for _name, _action in {ENVIRONMENT: "pressure_set", **MAS20}.items():
    if _name not in gymnasium.registry:
        gymnasium.register(
            id=_name,
            entry_point="pamsim.envs.rig_env:RigEnv",
            vector_entry_point="pamsim.envs.rig_vector_env:RigVectorEnv",
            max_episode_steps=EPISODE,
            kwargs={"action": _action},
        )
