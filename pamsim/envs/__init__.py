"""Gymnasium environments of any rig; importing this room registers them.

The names of ``__all__`` load on first use.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import gymnasium

from pamsim.core.on_first_use import on_first_use

if TYPE_CHECKING:
    from pamsim.envs.closed_loop import run_episode as run_episode
    from pamsim.envs.closed_loop import score as score
    from pamsim.envs.tasks import TaskSignals as TaskSignals

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

_HOME = {
    "TaskSignals": "pamsim.envs.tasks",
    "run_episode": "pamsim.envs.closed_loop",
    "score": "pamsim.envs.closed_loop",
}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]
__getattr__, __dir__ = on_first_use(__name__, _HOME, "ENVIRONMENT", "MAS20", "EPISODE")
