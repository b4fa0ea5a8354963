"""Controllers of the antagonistic arm: pure functions of an observation and a memory.

All names below load on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pamsim.core.on_first_use import on_first_use

if TYPE_CHECKING:
    from pamsim.controllers.controller import Controller as Controller
    from pamsim.controllers.controller import JointObservation as JointObservation
    from pamsim.controllers.controller import Observation as Observation
    from pamsim.controllers.joint_control import JointControl as JointControl
    from pamsim.controllers.model_based import linear_controller as linear_controller
    from pamsim.controllers.neural_policy import NeuralPolicy as NeuralPolicy
    from pamsim.controllers.neural_policy import PolicyFile as PolicyFile
    from pamsim.controllers.suite import FAMILIES as FAMILIES
    from pamsim.controllers.suite import Suite as Suite

_HOME = {
    "Controller": "pamsim.controllers.controller",
    "FAMILIES": "pamsim.controllers.suite",
    "JointControl": "pamsim.controllers.joint_control",
    "JointObservation": "pamsim.controllers.controller",
    "NeuralPolicy": "pamsim.controllers.neural_policy",
    "Observation": "pamsim.controllers.controller",
    "PolicyFile": "pamsim.controllers.neural_policy",
    "Suite": "pamsim.controllers.suite",
    "linear_controller": "pamsim.controllers.model_based",
}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]
__getattr__, __dir__ = on_first_use(__name__, _HOME)
