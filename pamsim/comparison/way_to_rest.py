"""The way to rest that an imposed motion begins with, so that hysteresis begins as in other runs.

A rig comes to rest from the model's initial position, and what hysteresis keeps of that way lasts
until a muscle has moved on far enough. So the way is simulated with the joints free, and imposed
signals begin with the same pressures and motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pamsim.comparison.experiments import GRID_HZ, grid_rate
from pamsim.comparison.link_inputs import LinkInputs, with_true_inputs
from pamsim.comparison.links import LinkRun
from pamsim.comparison.sensed_runs import sensed_runs
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.trial import Trial, TrialLead

_REST = 4.0
"""Time given to a rig to come to rest [s], as in every experiment."""

_LEAST = 0.1
"""Least time in which an imposed motion goes from rest to its first reading [s]: noise would
otherwise start it with a blow. It is that in which corners of imposed motions are rounded."""


def ways_to_rest(
    rig: Rig,
    inputs: Mapping[str, LinkInputs],
    trials: Sequence[Trial],
    threads: int | None,
    simulated: Callable[[], None] | None,
) -> dict[str, FloatArray]:
    """Simulate the way to rest at the start pressures of each trial.

    Args:
        rig: the rig.
        inputs: trial -> its measured inputs.
        trials: as measured.
        threads: simulations at a time; None for one per processor.
        simulated: called as each simulation ends; None for none.

    Returns:
        Trial -> (k, m + j) readings of pressures [Pa] and positions [rad or m] at `way_rate`; none
        where the run breaks down.
    """
    experiments: list[Experiment] = []
    for trial in trials:
        start, drives = inputs[trial.name].start(replace(trial, lead_in=None)), trial.drives
        still = replace(drives, muscles=("pressure_set",) * start.size).stated(tuple(rig.muscles))
        alone = Experiment(
            drive=still,
            command_time=np.zeros(1),
            command_value=np.append(start, trial.command[0, start.size :])[np.newaxis],
            start_pressure=start,
            duration=_REST,
            sample_rate=way_rate(trial),
            load=trial.load,
            settle=0.0,
            approach=_REST,
        )
        experiments.append(with_true_inputs(rig, alone))
    jobs = [(rig, experiment) for experiment in experiments]
    recordings = sensed_runs(jobs, threads=threads, simulated=simulated)
    return {
        trial.name: _until_still(recording, trial, inputs[trial.name])
        for trial, recording in zip(trials, recordings, strict=True)
        if recording.outcome is Outcome.COMPLETED
    }


def way_rate(trial: Trial) -> float:
    """Rate of ways to rest [Hz]: the multiple of the trial's next below every step of the engine.

    Hysteresis keeps the last small swings of an arm, which the rate of a log may miss.
    """
    steps = round(GRID_HZ / grid_rate(trial.time))
    return GRID_HZ / next((n for n in range(2, steps) if steps % n == 0), steps)


def _until_still(recording: Recording, trial: Trial, inputs: LinkInputs) -> FloatArray:
    """A way to rest, until sensors would show no more motion, in whole samples of the trial."""
    way = np.hstack([recording.pressure, recording.positions])
    joints = list(recording.joints)
    last = round(_LEAST * way_rate(trial))
    each = round(way_rate(trial) / grid_rate(trial.time))
    for joint, noise in inputs.noise.items():
        own = way[:, recording.pressure.shape[1] + joints.index(joint)]
        last = max([last, *np.flatnonzero(np.abs(own - own[-1]) > noise).tolist()])
    return way[: (last // each + 1) * each]


def way_as_lead(
    rig: Rig, trial: Trial, run: LinkRun, start: FloatArray, way: FloatArray
) -> TrialLead:
    """The way to rest as what precedes a trial, leading on to where its imposed signals begin.

    Args:
        rig: the rig.
        trial: as the run drives it, all muscles by measured pressures.
        run: which link.
        start: (m,) first pressures of the trial [Pa].
        way: (k, m + j) as of `ways_to_rest`.
    """
    count, muscles = len(way), start.size
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / count)
    command = np.repeat(trial.command[:1], count, axis=0)
    columns = dict(enumerate(range(muscles)))
    for column, joint in enumerate(trial.drives.joints, start=muscles):
        if joint in run.moved:
            columns[column] = muscles + list(rig.joints).index(joint)
    for column, number in columns.items():
        own = way[:, number]
        command[:, column] = own + share * (command[:, column] - own[-1])
    return TrialLead(
        time=np.arange(float(count)) / way_rate(trial),
        duration=count / way_rate(trial),
        command=command,
        start_pressure=start,
    )
