"""Simulated recordings as a rig's sensors would report them, each different run simulated once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Recording
from pamsim.recordings.sensors import distorted, true_position, true_pressure
from pamsim.recordings.signals import IMPOSED


def identity(experiment: Experiment) -> tuple[object, ...]:
    """All properties of an experiment but its name, as a key for equal experiments."""
    return (
        experiment.drives.kinds,
        tuple(experiment.drives.joints),
        experiment.command_time.tobytes(),
        experiment.command_value.tobytes(),
        experiment.start_pressure.tobytes(),
        experiment.duration,
        experiment.sample_rate,
        experiment.load,
        experiment.settle,
        experiment.approach,
    )


def as_read(rig: Rig, experiment: Experiment) -> Experiment:
    """An experiment with the true pressures and motion, given what the rig's sensors read."""
    if rig.sensor is None:
        return experiment
    true = np.maximum(true_pressure(experiment.start_pressure, rig.sensor), 0.0)
    kinds = np.array(experiment.drives.kinds)
    value = experiment.command_value.copy()
    value[:, kinds == "measured"] = true_pressure(value[:, kinds == "measured"], rig.sensor)
    moved = np.isin(kinds, IMPOSED)
    value[:, moved] = true_position(value[:, moved], rig.sensor)
    return replace(experiment, start_pressure=true, command_value=value)


def sensed_runs(
    jobs: Sequence[tuple[Rig, Experiment]],
    *,
    timestep: float | None = None,
    settle_steps: int = 1,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
) -> list[Recording]:
    """Simulate rigs; those that differ in their sensors alone share a model and are run once.

    Options are those of `pamsim.engine.batch.simulate_batch`.
    """
    keys = [(id(rig.model), identity(experiment)) for rig, experiment in jobs]
    different = dict(zip(reversed(keys), reversed(jobs), strict=True))
    runs = simulate_batch(
        list(different.values()),
        timestep=timestep,
        settle_steps=settle_steps,
        threads=threads,
        simulated=simulated,
        above_supply=True,
    )
    of_key = dict(zip(different, runs, strict=True))
    return [
        of_key[key] if rig.sensor is None else distorted(of_key[key], rig.sensor)
        for key, (rig, _) in zip(keys, jobs, strict=True)
    ]
