"""pamsim: pneumatic artificial muscles in MuJoCo.

The names below load on first use, so that ``import pamsim`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pamsim.actuator.muscle import Muscle as Muscle
    from pamsim.core.errors import PamsimError as PamsimError
    from pamsim.core.experiment import Experiment as Experiment
    from pamsim.core.experiment import pressure_step as pressure_step
    from pamsim.core.recording import Recording as Recording
    from pamsim.engine.attach import attach as attach
    from pamsim.engine.attach import compile_model as compile_model
    from pamsim.engine.callback import live as live
    from pamsim.engine.callback import step as step
    from pamsim.engine.rig import load_rig as load_rig
    from pamsim.engine.simulate import simulate as simulate
    from pamsim.engine.state import pressures as pressures
    from pamsim.engine.state import reset as reset
    from pamsim.engine.state import restore_state as restore_state
    from pamsim.engine.state import save_state as save_state
    from pamsim.linear.step_identification import identify_step as identify_step

__version__ = "0.1.0"

_HOME = {
    "Experiment": "pamsim.core.experiment",
    "Muscle": "pamsim.actuator.muscle",
    "PamsimError": "pamsim.core.errors",
    "Recording": "pamsim.core.recording",
    "attach": "pamsim.engine.attach",
    "compile_model": "pamsim.engine.attach",
    "identify_step": "pamsim.linear.step_identification",
    "live": "pamsim.engine.callback",
    "load_rig": "pamsim.engine.rig",
    "pressure_step": "pamsim.core.experiment",
    "pressures": "pamsim.engine.state",
    "reset": "pamsim.engine.state",
    "restore_state": "pamsim.engine.state",
    "save_state": "pamsim.engine.state",
    "simulate": "pamsim.engine.simulate",
    "step": "pamsim.engine.callback",
}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name from its home on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'pamsim' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
