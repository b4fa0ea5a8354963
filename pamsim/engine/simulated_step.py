"""A large step of a rig as a trial, to identify from without a recording."""

from __future__ import annotations

from collections.abc import Sequence

from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.recordings.experiment import pressure_step
from pamsim.recordings.trial import Trial, TrialSet


def simulated_step(
    rig: str,
    *,
    pressure: Sequence[float] = (487e3, 0.0),
    load: float = 0.0,
    duration: float = 6.0,
) -> TrialSet:
    """A large step of a rig: all muscles rest at the highest set point, then take their own.

    Args:
        rig: name of a shipped rig, or path of a rig folder.
        pressure: set points after the step, gauge [Pa].
        load: mass on the arm [kg].
        duration: [s].

    Raises:
        InputError: as `pamsim.simulate`.
        SimulationError: if the run broke down.
    """
    loaded = load_rig(rig)
    start = [max(pressure)] * len(pressure)
    step = pressure_step(start, pressure, duration=duration, load=load, name="simulated step")
    run = simulate(loaded, step).completed()
    trial = Trial(
        name="simulated_step",
        protocol="simulated_step",
        drive=run.drive,
        load=run.load,
        time=run.time,
        command=run.command,
        measured=run.signals(),
        muscle_names=run.names.named_muscles,
    )
    return TrialSet(rig=loaded.name, trials=(trial,))
