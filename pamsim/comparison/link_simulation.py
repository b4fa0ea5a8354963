"""Simulations of single links: measured inputs imposed, outputs beside what was measured.

Imposed pressures and motion are smoothed, see `pamsim.comparison.link_inputs`. A run starts at
rest at the first of them; as read, noise and all, the start of a muscle whose valves are shut would
be wrong for the whole trial.

A rig comes to rest from the model's initial position, and what hysteresis keeps of that way lasts
until a muscle has moved on far enough. So the way is simulated with the joints free, and imposed
signals begin with the same pressures and motion: hysteresis begins as in any other run.

A joint that is given measured forces keeps its muscles in the simulation, since a joint under
forces alone would drift away with the noise of the load cells. The muscles have their measured
pressures, and the joint is given the torque of what the cells read beyond the muscles' simulated
forces along the measured motion: where the joint is modelled rightly, muscles and torque together
exert what was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pamsim.comparison.experiments import GRID_HZ, experiment_of, grid_rate
from pamsim.comparison.link_inputs import LinkInputs, smoothed, with_true_inputs
from pamsim.comparison.links import LinkRun
from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import moment_arms
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.signals import EFFORTS, MOTIONS
from pamsim.recordings.trial import Trial, TrialLead

Signals = Mapping[str, FloatArray]


_REST = 4.0
"""Time given to a rig to come to rest [s], as in every experiment."""

_LEAST = 0.1
"""Least time in which an imposed motion goes from rest to its first reading [s]: noise would
otherwise start it with a blow. It is that in which corners of imposed motions are rounded."""


def link_experiment(
    rig: Rig,
    trial: Trial,
    run: LinkRun,
    inputs: LinkInputs,
    *,
    way: FloatArray | None,
    torque: FloatArray | None,
) -> tuple[Trial, Experiment]:
    """A trial as a run drives it, and the experiment that repeats it.

    The imposed signals begin with the ``way`` (k, m + j) to rest, if there is one; a ``torque``
    (n,) acts on the joint that is pulled.
    """
    drives, muscles = trial.drives, len(rig.muscles)
    drive: dict[str, str] = {}
    for muscle, kind in zip(rig.muscles, drives.muscles, strict=True):
        drive[muscle] = "measured" if run.pressures else kind
    for joint, kind in rig.joints.items():
        if joint in run.moved:
            drive[joint] = MOTIONS[kind]
        elif joint in drives.joints or (joint == run.pulled and torque is not None):
            drive[joint] = EFFORTS[kind]

    def driving(given: FloatArray, read: LinkInputs, beyond: FloatArray | None) -> FloatArray:
        """Columns of what drives it, of those that drive the trial."""
        columns: list[FloatArray] = []
        for i, muscle in enumerate(rig.muscles):
            columns.append(read.pressures[i] if drive[muscle] == "measured" else given[:, i])
        for joint in (joint for joint in rig.joints if joint in drive):
            if joint in run.moved:
                columns.append(read.positions[joint])
                continue
            own = list(drives.joints).index(joint) if joint in drives.joints else None
            effort = np.zeros(len(given)) if own is None else given[:, muscles + own]
            columns.append(effort if beyond is None else effort + beyond)
        return np.column_stack(columns)

    driven = replace(trial, drive=drive, command=driving(trial.command, inputs, torque))
    if not (run.pressures or run.moved):
        return driven, with_true_inputs(rig, experiment_of(driven))
    lead, before = trial.lead_in, inputs.before
    if lead is None or before is None or run.pulled:  # by what, before the trial, is not known
        driven = replace(driven, lead_in=None)
    else:
        driven = replace(
            driven, lead_in=replace(lead, command=driving(lead.command, before, None), measured={})
        )
    if way is None:
        own = inputs if driven.lead_in is not None else replace(inputs, before=None)
        experiment = replace(experiment_of(driven), start_pressure=own.start(trial))
    else:
        start = inputs.start(trial)
        driven = replace(driven, lead_in=_way_as_lead(rig, driven, run, start, way))
        # All that is imposed runs on between its values, so that samples may be further apart.
        experiment = replace(
            experiment_of(driven, sample_rate=_way_rate(trial)),
            start_pressure=start,
            settle=0.0,
            approach=len(way) / _way_rate(trial),
            sample_rate=grid_rate(trial.time),
        )
    return driven, with_true_inputs(rig, experiment)


def with_effort(experiment: Experiment, joint: str, effort: FloatArray) -> Experiment:
    """An experiment with an effort (k,) more on one of its driven joints [N m or N]."""
    value, drives = experiment.command_value.copy(), experiment.drives
    value[:, len(drives.muscles) + list(drives.joints).index(joint)] += effort
    return replace(experiment, command_value=value)


def torques_beyond(
    rig: Rig, forces: FloatArray, arms: FloatArray, signals: Signals
) -> dict[str, FloatArray]:
    """Joint -> (n,) torque [N m] or force [N] of what cells read beyond the simulated forces.

    Args:
        rig: the rig.
        forces: (n, m) that the cells read, see `forces_read` [N].
        arms: (n, m, j) along the measured motion, see `arms_along` [m, or 1].
        signals: simulated along it, at the times of the trial.
    """
    channels = rig.names.of_muscles("force")
    beyond = forces - np.column_stack([signals[channel] for channel in channels])
    # A muscle pulls towards where its tendon is shorter.
    return dict(zip(rig.joints, -np.einsum("kmj,km->jk", arms, beyond), strict=True))


def forces_read(rig: Rig, trial: Trial) -> FloatArray:
    """Measured forces of all muscles, smoothed, (n, m) [N]."""
    channels = rig.names.of_muscles("force")
    return np.column_stack([smoothed(trial.time, trial.measured[c]) for c in channels])


def arms_along(rig: Rig, inputs: LinkInputs) -> FloatArray:
    """Change of each tendon's length with each joint along the measured motion, (n, m, j)."""
    measured = np.column_stack([inputs.positions[joint] for joint in rig.joints])
    positions = np.tile(rig.model.qpos0, (len(measured), 1))
    positions[:, rig.position_addresses] = measured
    return moment_arms(rig, positions)


def ways_to_rest(
    rig: Rig,
    inputs: Mapping[str, LinkInputs],
    trials: Sequence[Trial],
    run: Callable[[Sequence[tuple[Rig, Experiment]]], Sequence[Recording]],
) -> dict[str, FloatArray]:
    """Simulate the way to rest at the start pressures of each trial, whose inputs are by name.

    ``run`` simulates experiments, as `sensed_runs`.

    Returns:
        Trial -> (k, m + j) readings of pressures [Pa] and positions [rad or m] at `_way_rate`; none
        where the run breaks down.
    """
    jobs: list[tuple[Rig, Experiment]] = []
    for trial in trials:
        own, drives = inputs[trial.name], trial.drives
        start = own.start(trial)
        first = (trial if own.before is None else trial.with_lead_in).command[0]
        still = replace(drives, muscles=("pressure_set",) * start.size).stated(tuple(rig.muscles))
        alone = Experiment(
            drive=still,
            command_time=np.zeros(1),
            command_value=np.append(start, first[start.size :])[np.newaxis],
            start_pressure=start,
            duration=_REST,
            sample_rate=_way_rate(trial),
            load=trial.load,
            settle=0.0,
            approach=_REST,
        )
        jobs.append((rig, with_true_inputs(rig, alone)))
    recordings = run(jobs)
    return {
        trial.name: _until_still(recording, trial, inputs[trial.name])
        for trial, recording in zip(trials, recordings, strict=True)
        if recording.outcome is Outcome.COMPLETED
    }


def _way_rate(trial: Trial) -> float:
    """Rate of ways to rest [Hz]: the multiple of the trial's next below every step of the engine.

    Hysteresis keeps the last small swings of an arm, which the rate of a log may miss.
    """
    steps = round(GRID_HZ / grid_rate(trial.time))
    return GRID_HZ / next((n for n in range(2, steps) if steps % n == 0), steps)


def _until_still(recording: Recording, trial: Trial, inputs: LinkInputs) -> FloatArray:
    """A way to rest, until sensors would show no more motion, in whole samples of the trial."""
    way = np.hstack([recording.pressure, recording.positions])
    joints = list(recording.joints)
    last = round(_LEAST * _way_rate(trial))
    each = round(_way_rate(trial) / grid_rate(trial.time))
    for joint, noise in inputs.noise.items():
        own = way[:, recording.pressure.shape[1] + joints.index(joint)]
        last = max([last, *np.flatnonzero(np.abs(own - own[-1]) > noise).tolist()])
    return way[: (last // each + 1) * each]


def _way_as_lead(
    rig: Rig, trial: Trial, run: LinkRun, start: FloatArray, way: FloatArray
) -> TrialLead:
    """The way to rest as what precedes a trial, leading on to where its imposed signals begin.

    Its lead-in, if it has one, comes between the two. The way is (k, m + j) as of `ways_to_rest`,
    the first pressures of the trial (m,) [Pa].
    """
    count, muscles = len(way), start.size
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / count)
    whole, duration = trial.with_lead_in, count / _way_rate(trial)
    command = np.repeat(whole.command[:1], count, axis=0)
    columns = dict(enumerate(range(muscles)))
    for column, joint in enumerate(trial.drives.joints, start=muscles):
        if joint in run.moved:
            columns[column] = muscles + list(rig.joints).index(joint)
    for column, number in columns.items():
        own = way[:, number]
        command[:, column] = own + share * (command[:, column] - own[-1])
    time = np.arange(float(count)) / _way_rate(trial)
    if trial.lead_in is not None:
        time = np.concatenate([time, duration + trial.lead_in.time])
        command = np.concatenate([command, trial.lead_in.command])
        duration += trial.lead_in.duration
    return TrialLead(time=time, duration=duration, command=command, start_pressure=start)
