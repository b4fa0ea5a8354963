"""Measured inputs of single links: smoothed, and as the rig's instruments would have read them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.experiments import start_pressures
from pamsim.comparison.imposed_signals import sample_noise, smoothed
from pamsim.comparison.links import LinkRun
from pamsim.comparison.sensed_runs import as_read
from pamsim.core.units import FloatArray
from pamsim.engine.external import passable
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.sensors import ahead_of_lag, encoder_offset
from pamsim.recordings.signals import IMPOSED
from pamsim.recordings.trial import Trial


@dataclass(frozen=True, kw_only=True)
class LinkInputs:
    """Measured inputs of a trial, smoothed, with the errors of the rig's instruments.

    Attributes:
        pressures: number of the muscle -> (n,) [Pa].
        positions: joint -> (n,) [rad or m].
        noise: joint -> standard deviation that was smoothed away [rad or m].
    """

    pressures: Mapping[int, FloatArray]
    positions: Mapping[str, FloatArray]
    noise: Mapping[str, float]

    def start(self, trial: Trial) -> FloatArray:
        """Pressures (m,) at which the muscles rest before the trial [Pa]."""
        start = start_pressures(trial)
        for muscle, values in self.pressures.items():
            start[muscle] = max(values[0], 0.0)
        return start


def inputs_of_runs(rig: Rig, runs: Iterable[tuple[Trial, LinkRun]]) -> dict[str, LinkInputs]:
    """Name of each trial to its inputs; empty where none of its runs imposes what was measured."""
    imposing: dict[str, bool] = {}
    trials: dict[str, Trial] = {}
    for trial, run in runs:
        imposes = run.pressures or bool(run.moved) or "measured" in trial.drives.muscles
        imposing[trial.name] = imposes or imposing.get(trial.name, False)
        trials[trial.name] = trial
    nothing = LinkInputs(pressures={}, positions={}, noise={})
    return {n: link_inputs(rig, t) if imposing[n] else nothing for n, t in trials.items()}


def link_inputs(rig: Rig, trial: Trial) -> LinkInputs:
    """The pressures and positions of a trial, measured or imposed, that single links are given."""
    pressures: dict[int, FloatArray] = {}
    for muscle, kind in enumerate(trial.drives.muscles):
        channel = trial.pressure_channels[muscle]
        if kind == "measured":
            pressures[muscle] = smoothed(trial.time, trial.command[:, muscle])
        elif channel in trial.measured:
            pressures[muscle] = smoothed(trial.time, trial.measured[channel])
    driven = trial.command[:, trial.muscles :].T
    given = dict(zip(trial.drives.joints, driven, strict=True))
    positions: dict[str, FloatArray] = {}
    noise: dict[str, float] = {}
    for joint, kind in rig.joints.items():
        channel = rig.names.joint_channel(joint)
        read = given[joint] if joint in trial.drives.imposed else trial.measured.get(channel)
        if read is None:
            continue
        low = 0.0
        if rig.sensor is not None and kind == "angle":
            low = encoder_offset(read, rig.sensor.encoder_increments)
        noise[joint] = sample_noise(read)
        positions[joint] = smoothed(trial.time, read, noise[joint]) - low
    return LinkInputs(pressures=pressures, positions=positions, noise=noise)


def with_true_inputs(rig: Rig, experiment: Experiment) -> Experiment:
    """An experiment with the true signals, given what the rig's sensors read.

    Imposed signals are smooth, so that the lag of a sensor can be taken off them. A motion is
    imposed as far beyond a joint's stops as these give way.
    """
    experiment = as_read(rig, experiment)
    value, first = experiment.command_value.copy(), len(experiment.drives.muscles)
    lags: dict[str, float] = {}
    if rig.sensor is not None:
        angles = dict.fromkeys(IMPOSED, rig.sensor.angle_lag)
        lags = {"measured": rig.sensor.pressure_lag, **angles}
    for column, kind in enumerate(experiment.drives.kinds):
        lag = lags.get(kind, 0.0)
        value[:, column] = ahead_of_lag(experiment.command_time, value[:, column], lag)
    for column, joint in enumerate(experiment.drives.joints, start=first):
        if joint in experiment.drives.imposed:
            value[:, column] = np.clip(value[:, column], *passable(rig.model, joint))
    return replace(experiment, command_value=value)
