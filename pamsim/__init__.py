"""pamsim: pneumatic artificial muscles in MuJoCo.

Rigs and simulation::

    rig = pamsim.load_rig("mas20_arm")
    step = pamsim.pressure_step((300e3, 300e3), (300e3, 100e3), duration=4.0)  # Pa, s
    recording = pamsim.simulate(rig, step)

``simulate_batch`` runs many on all cores, ``write_recording`` writes recordings into one folder,
and ``new_rig`` writes a rig folder to start from. ``attach`` and ``compile_model`` put a `Muscle`
on any MJCF; ``live``, ``reset``, ``charge``, ``pressures``, ``save_state`` and ``restore_state`` go
with ``mujoco.mj_step``, ``register`` with saved models, and ``slot`` is the place of a parameter in
the model. Inside ``checks`` every step is checked for states that cannot be. `ArmViewer` shows the
arm in a window, ``write_film`` writes pictures as a film.

Models and data: ``import_log`` (a recording of a lab's own log), ``read_recordings``,
``experiment_of`` and ``at_times`` (simulate a measured trial), ``identify`` (transfer functions,
also of a ``simulated_step``), ``fit`` (force laws and hysteresis), ``check`` (what recordings are
and could show), ``calibrate`` (parameters of a rig), ``diagnose`` (the effect that a simulation is
missing), ``hide`` (synthetic recordings with a hidden effect), ``sweep`` (many simulations over
varied parameters), ``simulate_worlds`` (many experiments at once on a GPU), ``reproduce`` and
``replicate`` (the source papers). Their results have ``summary()``, ``to_dict()`` and
``save(folder)``; ``plot`` draws them, ``table`` gives their columns for pandas.

A law or an effect of your own is written with `ForceLaw`, `Operator`, `Hysteresis`,
`ParameterGroup`, ``parameter``, `Effect` and `EffectParameter`.

Gymnasium environments are registered by ``import pamsim.envs``, which also has ``run_episode`` and
``score``; controllers are in ``pamsim.controllers``. All names below load on first use.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pamsim.core.compilation import choose_cache
from pamsim.core.on_first_use import on_first_use

if TYPE_CHECKING:
    from pamsim.calibration.calibrate import calibrate as calibrate
    from pamsim.comparison.experiments import at_times as at_times
    from pamsim.comparison.experiments import experiment_of as experiment_of
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
    from pamsim.engine.batch import simulate_batch as simulate_batch
    from pamsim.engine.checks import checks as checks
    from pamsim.engine.new_rig import new_rig as new_rig
    from pamsim.engine.plugin import register as register
    from pamsim.engine.rig import load_rig as load_rig
    from pamsim.engine.simulate import simulate as simulate
    from pamsim.engine.simulate import simulated_step as simulated_step
    from pamsim.engine.state import charge as charge
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
    from pamsim.physics.record import slot as slot
    from pamsim.recordings.experiment import Experiment as Experiment
    from pamsim.recordings.experiment import pressure_step as pressure_step
    from pamsim.recordings.pictures import write_film as write_film
    from pamsim.recordings.recording import Recording as Recording
    from pamsim.recordings.recording import write_recording as write_recording
    from pamsim.recordings.recording_reader import read_recordings as read_recordings
    from pamsim.report.plot import plot as plot
    from pamsim.report.table import table as table
    from pamsim.scene.pose import muscle_lengths as muscle_lengths
    from pamsim.scene.viewer import ArmViewer as ArmViewer
    from pamsim.sweeps.own_function import function_study as function_study
    from pamsim.sweeps.sweep import sweep as sweep
    from pamsim.twins.hide import hide as hide

__version__ = "0.1.0"

choose_cache(Path(__file__).parent)  # before anything imports numba

_HOME = {
    "ArmViewer": "pamsim.scene.viewer",
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
    "at_times": "pamsim.comparison.experiments",
    "attach": "pamsim.engine.attach",
    "calibrate": "pamsim.calibration.calibrate",
    "charge": "pamsim.engine.state",
    "check": "pamsim.diagnosis.check",
    "checks": "pamsim.engine.checks",
    "compile_model": "pamsim.engine.attach",
    "diagnose": "pamsim.diagnosis.diagnose",
    "experiment_of": "pamsim.comparison.experiments",
    "fit": "pamsim.fitting.fit",
    "function_study": "pamsim.sweeps.own_function",
    "hide": "pamsim.twins.hide",
    "identify": "pamsim.identification.identify",
    "import_log": "pamsim.comparison.import_log",
    "live": "pamsim.engine.stepping",
    "load_rig": "pamsim.engine.rig",
    "muscle_lengths": "pamsim.scene.pose",
    "new_rig": "pamsim.engine.new_rig",
    "parameter": "pamsim.core.parameters",
    "plot": "pamsim.report.plot",
    "pressure_step": "pamsim.recordings.experiment",
    "pressures": "pamsim.engine.state",
    "read_recordings": "pamsim.recordings.recording_reader",
    "register": "pamsim.engine.plugin",
    "replicate": "pamsim.papers.replicate",
    "reproduce": "pamsim.papers.reproduce",
    "reset": "pamsim.engine.state",
    "restore_state": "pamsim.engine.state",
    "save_state": "pamsim.engine.state",
    "simulate": "pamsim.engine.simulate",
    "simulate_batch": "pamsim.engine.batch",
    "simulate_worlds": "pamsim.gpu.simulate_worlds",
    "simulated_step": "pamsim.engine.simulate",
    "slot": "pamsim.physics.record",
    "sweep": "pamsim.sweeps.sweep",
    "table": "pamsim.report.table",
    "write_film": "pamsim.recordings.pictures",
    "write_recording": "pamsim.recordings.recording",
}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]

__getattr__, __dir__ = on_first_use(__name__, _HOME, "__version__")
