"""Measured trials and table rows as experiments, and their simulation as sensors report it."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.external import passable
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import whole_steps
from pamsim.engine.state import RestSteps
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.sensors import (
    MeasurementChain,
    distorted,
    encoder_offset,
    true_at_rest,
)
from pamsim.recordings.signals import IMPOSED, kind_of
from pamsim.recordings.start_pressures import start_pressures
from pamsim.recordings.static_table import StaticTable
from pamsim.recordings.trial import Trial

GRID_HZ = 2000
"""Steps of the shipped rigs per second; a sampling rate must divide it."""

REST_DURATION = 6.0
"""Time given to a step whose end is an angle at rest [s]: ten times the MAS-20's slow lag."""

_REST_HZ = 20.0  # of a run whose end alone counts
_ON_GRID = 0.02  # share of a sample by which written times may miss a grid


def experiment_of(trial: Trial, *, sample_rate: float | None = None) -> Experiment:
    """The experiment that repeats a trial in the engine.

    Args:
        trial: as measured.
        sample_rate: of the simulation [Hz]; it must divide the rig's steps per second. If left
            out: the trial's own where its clock is uniform and divides 2000 Hz, so that every
            command changes at its own instant; otherwise 2000 Hz, late by one step at most.

    Returns:
        The commands held, or what was measured imposed, from rest at the first measured
        pressures or, where a pressure was not measured, at the first set point. A lead-in comes
        first.

    Raises:
        InputError: if the start pressure of a muscle was neither measured nor commanded.
    """
    whole = trial.with_lead_in
    time, command = whole.time, whole.command
    rate = grid_rate(time) if sample_rate is None else sample_rate
    rows = np.arange(time.size)
    if not any(trial.drives.between):
        changed = np.any(np.diff(command, axis=0) != 0.0, axis=1)
        rows = np.concatenate([[0], np.flatnonzero(changed) + 1])
    return Experiment(
        drive=trial.drive,
        command_time=_snapped(time[rows], rate),
        command_value=command[rows],
        start_pressure=start_pressures(trial),
        # Up to the first sample that is not before the trial's last.
        duration=math.ceil(float(time[-1]) * rate - _ON_GRID) / rate,
        sample_rate=rate,
        load=trial.load,
        name=trial.name,
    )


def on_steps(experiment: Experiment, timestep: float) -> Experiment:
    """An experiment whose sampling period is a whole number of time steps [s], the next shorter.

    A clock that jitters is sampled on a grid that a rig with longer steps than the shipped ones
    does not have; what is read between samples is interpolated.
    """
    period = 1.0 / experiment.sample_rate
    with contextlib.suppress(InputError):
        whole_steps(period, timestep)
        return experiment
    rate = 1.0 / (max(math.floor(period / timestep), 1) * timestep)
    duration = math.ceil(experiment.duration * rate - _ON_GRID) / rate
    return replace(experiment, sample_rate=rate, duration=duration)


def grid_rate(time: FloatArray) -> float:
    """Rate that samples at all given times (n,) [s], or 2000 Hz if no divisor of it does [Hz]."""
    rate = (time.size - 1) / float(time[-1])
    whole = round(GRID_HZ / rate)
    if whole < 1:
        return float(GRID_HZ)
    near = GRID_HZ / whole
    on_grid = np.max(np.abs(time * near - np.arange(time.size))) <= _ON_GRID
    return near if on_grid else float(GRID_HZ)


def _snapped(time: FloatArray, rate: float) -> FloatArray:
    """Times moved to the grid: a command late by rounding alone would be a whole step late."""
    grid = np.round(time * rate) / rate
    return np.where(np.abs(time - grid) * rate <= _ON_GRID, grid, time)


def at_times(
    recording: Recording, trial: Trial, sensor: MeasurementChain | None = None
) -> dict[str, FloatArray]:
    """Simulated signals at the times of a trial, interpolated linearly between samples.

    Args:
        recording: of the trial's experiment.
        trial: as measured.
        sensor: instruments of the rig, or None. An encoder that counts whole increments reads low
            on average, or high with its sign turned, and so do the angles returned, if the trial's
            come in such increments.

    Returns:
        Channel -> (n,), as `Recording.signals` names them [SI].

    Raises:
        SimulationError: if the run ended early.
    """
    done = recording.completed()
    signals = done.signals()
    if sensor is not None:
        for channel in trial.measured.keys() & done.names.joint_channels:
            if kind_of(channel) == "angle":
                signals[channel] = signals[channel] + encoder_offset(
                    trial.measured[channel],
                    sensor.encoder_increments,
                    turned=channel in trial.turned,
                )
    time = trial.time if trial.lead_in is None else trial.lead_in.duration + trial.time
    return {name: np.interp(time, done.time, values) for name, values in signals.items()}


def table_experiments(table: StaticTable) -> list[Experiment]:
    """The pressure steps that lead to the rows of a static table.

    If the table does not give the pressures before a row, all muscles rest at its highest pressure
    before the others are vented: the operating concept of Matiskova 2021, section 3.1.
    """
    start = table.start
    if start is None:
        start = np.broadcast_to(table.pressure.max(axis=1, keepdims=True), table.pressure.shape)
    return [
        pressure_step(
            before,
            after,
            duration=REST_DURATION,
            load=float(load),
            sample_rate=_REST_HZ,
            name=f"{table.name}, {row}",
        )
        for row, before, after, load in zip(
            table.rows, start, table.pressure, table.load, strict=True
        )
    ]


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
    """An experiment with the true pressures and motion, given what the rig's sensors read.

    An error of a sensor moves no imposed motion further beyond a joint's stops than these give way:
    no machine moved it there.
    """
    if rig.sensor is None:
        return experiment
    true = np.maximum(true_at_rest(experiment.start_pressure, rig.sensor, "pressure"), 0.0)
    kinds = np.array(experiment.drives.kinds)
    value = experiment.command_value.copy()
    read = kinds == "measured"
    value[:, read] = true_at_rest(value[:, read], rig.sensor, "pressure")
    moved = np.isin(kinds, IMPOSED)
    value[:, moved] = true_at_rest(value[:, moved], rig.sensor, "angle")
    for column, joint in enumerate(experiment.drives.joints, start=len(experiment.drives.muscles)):
        if moved[column]:
            reading, (low, high) = experiment.command_value[:, column], passable(rig.model, joint)
            ends = min(low, reading.min()), max(high, reading.max())  # one beyond them is refused
            value[:, column] = np.clip(value[:, column], *ends)
    return replace(experiment, start_pressure=true, command_value=value)


def sensed_runs(
    jobs: Sequence[tuple[Rig, Experiment]],
    *,
    timestep: float | None = None,
    rest_steps: RestSteps | None = None,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
) -> list[Recording]:
    """Simulate rigs; those that differ in their sensors alone share a model and are run once.

    Each is sampled as its experiment asks, or more often where the time steps do not allow that.
    Options are those of `pamsim.engine.batch.simulate_batch`.
    """
    jobs = [
        (rig, on_steps(one, float(rig.model.opt.timestep) if timestep is None else timestep))
        for rig, one in jobs
    ]
    keys = [(id(rig.model), identity(experiment)) for rig, experiment in jobs]
    different = dict(zip(reversed(keys), reversed(jobs), strict=True))
    runs = simulate_batch(
        list(different.values()),
        timestep=timestep,
        rest_steps=rest_steps,
        threads=threads,
        simulated=simulated,
        above_supply=True,
    )
    of_key = dict(zip(different, runs, strict=True))
    return [
        of_key[key] if rig.sensor is None else distorted(of_key[key], rig.sensor)
        for key, (rig, _) in zip(keys, jobs, strict=True)
    ]


def sensed_signals(
    jobs: Sequence[tuple[Rig, Trial, Experiment]], **options: Any
) -> list[dict[str, FloatArray] | None]:
    """Signals of rigs' experiments at the times of trials, channel -> (n,) [SI].

    They are None where a run breaks down; options are those of `sensed_runs`.
    """
    runs = sensed_runs([(rig, experiment) for rig, _, experiment in jobs], **options)
    return [
        at_times(run, trial, rig.sensor) if run.outcome is Outcome.COMPLETED else None
        for run, (rig, trial, _) in zip(runs, jobs, strict=True)
    ]
