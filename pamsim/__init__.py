"""pamsim: pneumatic artificial muscles in MuJoCo.

Rigs and simulation::

    rig = pamsim.load_rig("mas20_arm")
    step = pamsim.pressure_step((300e3, 300e3), (300e3, 100e3), duration=4.0)  # Pa, s
    recording = pamsim.simulate(rig, step)

``new_rig`` writes a rig folder to start from. ``attach`` and ``compile_model`` put a `Muscle` on
any MJCF; ``live``, ``reset``, ``pressures``, ``save_state`` and ``restore_state`` go with
``mujoco.mj_step``. Inside ``checks`` every step is checked for states that cannot be.

Models and data: ``import_log`` (a recording of a lab's own log), ``read_recordings``, ``identify``
(transfer functions), ``fit`` (force laws and hysteresis), ``check`` (what recordings are and could
show), ``calibrate`` (parameters of a rig), ``diagnose`` (the effect that a simulation is missing),
``hide`` (synthetic recordings with a hidden effect), ``sweep`` (many simulations over varied
parameters), ``simulate_worlds`` (many experiments at once on a GPU), ``reproduce`` and
``replicate`` (the source papers). Their results have ``summary()``, ``to_dict()`` and
``save(folder)``; ``plot`` draws them.

A law or an effect of your own is written with `ForceLaw`, `Operator`, `Hysteresis`,
`ParameterGroup`, ``parameter``, `Effect` and `EffectParameter`.

Gymnasium environments are registered by ``import pamsim.envs``; controllers are in
``pamsim.controllers``. All names below load on first use.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pamsim.core.compilation import choose_cache

if TYPE_CHECKING:
    from pamsim.calibration.calibrate import calibrate as calibrate
    from pamsim.comparison.import_log import import_log as import_log
    from pamsim.core.errors import PamsimError as PamsimError
    from pamsim.core.parameters import ParameterGroup as ParameterGroup
    from pamsim.core.parameters import parameter as parameter
    from pamsim.diagnosis.check import check as check
    from pamsim.diagnosis.diagnose import diagnose as diagnose
    from pamsim.effects.effect import Effect as Effect
    from pamsim.effects.effect import EffectParameter as EffectParameter
    from pamsim.engine.attach import attach as attach
    from pamsim.engine.attach import compile_model as compile_model
    from pamsim.engine.checks import checks as checks
    from pamsim.engine.new_rig import new_rig as new_rig
    from pamsim.engine.rig import load_rig as load_rig
    from pamsim.engine.simulate import simulate as simulate
    from pamsim.engine.state import pressures as pressures
    from pamsim.engine.state import reset as reset
    from pamsim.engine.state import restore_state as restore_state
    from pamsim.engine.state import save_state as save_state
    from pamsim.engine.stepping import live as live
    from pamsim.fitting.fit import fit as fit
    from pamsim.gpu.simulate_worlds import simulate_worlds as simulate_worlds
    from pamsim.identification.identify import identify as identify
    from pamsim.papers.replicate import replicate as replicate
    from pamsim.papers.reproduce import reproduce as reproduce
    from pamsim.physics.force_laws.force_law import ForceLaw as ForceLaw
    from pamsim.physics.hysteresis.group import Hysteresis as Hysteresis
    from pamsim.physics.hysteresis.group import Operator as Operator
    from pamsim.physics.muscle import Muscle as Muscle
    from pamsim.recordings.experiment import Experiment as Experiment
    from pamsim.recordings.experiment import pressure_step as pressure_step
    from pamsim.recordings.recording import Recording as Recording
    from pamsim.recordings.recording_reader import read_recordings as read_recordings
    from pamsim.report.plot import plot as plot
    from pamsim.sweeps.own_function import function_study as function_study
    from pamsim.sweeps.sweep import sweep as sweep
    from pamsim.twins.hide import hide as hide

__version__ = "0.1.0"

choose_cache(Path(__file__).parent)  # before anything imports numba

_HOME = {
    "Effect": "pamsim.effects.effect",
    "EffectParameter": "pamsim.effects.effect",
    "Experiment": "pamsim.recordings.experiment",
    "ForceLaw": "pamsim.physics.force_laws.force_law",
    "Hysteresis": "pamsim.physics.hysteresis.group",
    "Muscle": "pamsim.physics.muscle",
    "Operator": "pamsim.physics.hysteresis.group",
    "PamsimError": "pamsim.core.errors",
    "ParameterGroup": "pamsim.core.parameters",
    "Recording": "pamsim.recordings.recording",
    "attach": "pamsim.engine.attach",
    "calibrate": "pamsim.calibration.calibrate",
    "compile_model": "pamsim.engine.attach",
    "check": "pamsim.diagnosis.check",
    "checks": "pamsim.engine.checks",
    "diagnose": "pamsim.diagnosis.diagnose",
    "fit": "pamsim.fitting.fit",
    "function_study": "pamsim.sweeps.own_function",
    "hide": "pamsim.twins.hide",
    "import_log": "pamsim.comparison.import_log",
    "identify": "pamsim.identification.identify",
    "live": "pamsim.engine.stepping",
    "load_rig": "pamsim.engine.rig",
    "new_rig": "pamsim.engine.new_rig",
    "parameter": "pamsim.core.parameters",
    "plot": "pamsim.report.plot",
    "pressure_step": "pamsim.recordings.experiment",
    "pressures": "pamsim.engine.state",
    "read_recordings": "pamsim.recordings.recording_reader",
    "replicate": "pamsim.papers.replicate",
    "reproduce": "pamsim.papers.reproduce",
    "reset": "pamsim.engine.state",
    "restore_state": "pamsim.engine.state",
    "save_state": "pamsim.engine.state",
    "simulate": "pamsim.engine.simulate",
    "simulate_worlds": "pamsim.gpu.simulate_worlds",
    "sweep": "pamsim.sweeps.sweep",
}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __dir__() -> list[str]:
    """Return the public names, loaded or not."""
    return [*__all__, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name from its home on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'pamsim' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
