"""Predictions of measurements: the simulated signal for every measured one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pamsim.comparison.experiments import (
    as_read,
    at_times,
    experiment_of,
    identity,
    sensed_runs,
    table_experiments,
)
from pamsim.comparison.links import free_channels
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.repeats import protocols_by_load
from pamsim.comparison.start_errors import STEP, StartError, start_error, start_groups
from pamsim.core.errors import InputError, refuse_unknown
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.inference.simulator_fit import Blocks, ResidualBlock
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.sensors import true_at_rest
from pamsim.recordings.signals import KINDS, kind_of
from pamsim.recordings.static_table import StaticTable
from pamsim.recordings.trial import Trial

CHANNELS = tuple(KINDS)
"""Kinds of channel: ``angle``, ``position``, ``pressure``, ``force``, ``torque``."""

AT_REST = "angle_at_rest"
"""Channel of static tables: its misfit is of another kind than the noise of a recorded angle."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """The measurements as one rig predicts them."""

    # Name of the trial -> channel -> simulated signal at the trial's times [SI]
    trials: dict[str, dict[str, FloatArray]]
    tables: dict[str, FloatArray]  # name of the table -> (n,) angles at rest [rad]


class TrialPredictor:
    """Simulates every trial and every row of measurements with rigs that differ in parameters.

    Trials and rows with equal experiments are simulated once.

    Args:
        rig: any of them; its number of muscles counts.
        data: what is compared.
        channels: kinds of channel to compare, of `CHANNELS`.
        threads: simulations at a time; None for one per processor.
        simulated: called as each simulation ends.

    Raises:
        InputError: if a trial has none of the channels, does not fit the rig, or does not give its
            start pressures.
    """

    def __init__(
        self,
        rig: Rig,
        data: CalibrationData,
        *,
        channels: Sequence[str] = CHANNELS,
        threads: int | None = None,
        simulated: Callable[[], None] | None = None,
    ) -> None:
        self.rig = rig
        self.data = data
        self._channels = tuple(channels)
        self._run = partial(sensed_runs, threads=threads, simulated=simulated)
        self._experiments: list[Experiment] = []  # the different ones
        self._numbers: dict[tuple[object, ...], int] = {}
        for trial in data.trials:
            _check_muscles(rig, trial.name, trial.muscles)
            if not self.compared(trial):
                raise InputError(
                    f"trial {trial.name!r} has none of the channels {', '.join(channels)}; it has"
                    f" {', '.join(trial.measured) or 'none'}"
                )
        for table in data.tables:
            check_table(rig, table)
        self._of_trial = [0] * len(data.trials)
        self._start_of = [np.zeros(0)] * len(data.trials)
        for start, members in start_groups(data.trials):
            experiment = replace(experiment_of(data.trials[members[0]]), start_pressure=start)
            for member in members:
                self._of_trial[member] = self._number(experiment)
                self._start_of[member] = start
        self._starts: list[tuple[StartError, dict[str, FloatArray]]] | None = None
        self._of_row = [[self._number(e) for e in table_experiments(t)] for t in data.tables]

    def _number(self, experiment: Experiment) -> int:
        """Number of an experiment among the different ones."""
        key = identity(experiment)
        if key not in self._numbers:
            self._numbers[key] = len(self._experiments)
            self._experiments.append(experiment)
        return self._numbers[key]

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """What one parameter vector is simulated with."""
        return tuple(self._experiments)

    def compared(self, trial: Trial) -> tuple[str, ...]:
        """Channels of a trial that are compared; not those that drive it."""
        free = free_channels(self.rig, trial)
        return tuple(name for name in free if kind_of(name) in self._channels)

    def predictions(
        self,
        rigs: Sequence[Rig | None],
        *,
        timestep: float | None = None,
    ) -> list[Prediction | None]:
        """Predictions of rigs; None where there is none or a run broke down.

        Time steps of ``timestep`` [s] are each rig's own if left out.
        """
        if self._starts is None:
            self.linearise_starts(next((rig for rig in rigs if rig is not None), None))
        return [
            None if found is None else self.adjusted(found)
            for found in self.as_simulated(rigs, timestep=timestep)
        ]

    def adjusted(self, simulated: Prediction) -> Prediction:
        """A prediction of `as_simulated` from the starts that fit the trials best."""
        assert self._starts is not None
        trials = dict(simulated.trials)
        for trial, (start, sensitivities) in zip(self.data.trials, self._starts, strict=True):
            if sensitivities and trial.name in trials:
                signals, compared = trials[trial.name], self.compared(trial)
                trials[trial.name] = start.adjusted(trial, signals, sensitivities, compared)
        return replace(simulated, trials=trials)

    def as_simulated(
        self,
        rigs: Sequence[Rig | None],
        *,
        timestep: float | None = None,
    ) -> list[Prediction | None]:
        """Predictions from the starts as they were read; arguments as of `predictions`."""
        runs = iter(
            self._run(
                [
                    (rig, as_read(rig, e) if number in self._of_trial else rest_as_read(rig, e))
                    for rig in rigs
                    if rig is not None
                    for number, e in enumerate(self._experiments)
                ],
                timestep=timestep,
            )
        )
        return [
            None if rig is None else self._read_off([next(runs) for _ in self._experiments])
            for rig in rigs
        ]

    @property
    def starts_matter(self) -> bool:
        """Whether a trial starts at a pressure that a sensor has read."""
        return any(np.any(start.spread > 0.0) for start, _ in self._starts or ())

    def linearise_starts(
        self,
        rig: Rig | None,
        *,
        simulated: Prediction | None = None,
    ) -> None:
        """Compute the starts' noise and the sensitivities to them at a rig.

        Call it before the first prediction, and again where a fit has ended. If a run breaks down
        there, or for None, starts are used as read. Trials that `as_simulated` has predicted there
        need not be simulated again.
        """
        starts = zip(self.data.trials, self._start_of, strict=True)
        self._starts = [(start_error(trial, start), {}) for trial, start in starts]
        if rig is None:
            return
        shifts = STEP * np.eye(len(rig.muscles))
        if simulated is None:
            shifts = np.vstack([np.zeros(len(rig.muscles)), shifts])
        for number in set(self._of_trial):
            experiment = self._experiments[number]
            if experiment.drives.all_measured:
                continue
            start = experiment.start_pressure
            runs = self._run(
                [
                    (rig, as_read(rig, replace(experiment, start_pressure=start + shift)))
                    for shift in shifts
                ]
            )
            if any(run.outcome is not Outcome.COMPLETED for run in runs):
                continue
            for i, (trial, of) in enumerate(zip(self.data.trials, self._of_trial, strict=True)):
                if of == number:
                    signals = [at_times(run, trial, self.rig.sensor) for run in runs]
                    base = signals.pop(0) if simulated is None else simulated.trials[trial.name]
                    sensitivities = {
                        name: np.column_stack([(other[name] - signal) / STEP for other in signals])
                        for name, signal in base.items()
                    }
                    self._starts[i] = start_error(trial, self._start_of[i], base), sensitivities

    def _read_off(self, runs: Sequence[Recording]) -> Prediction | None:
        if any(run.outcome is not Outcome.COMPLETED for run in runs):
            return None
        return Prediction(
            trials={
                trial.name: at_times(runs[number], trial, self.rig.sensor)
                for trial, number in zip(self.data.trials, self._of_trial, strict=True)
            },
            tables={
                table.name: np.array([runs[index].angle[-1] for index in rows])
                for table, rows in zip(self.data.tables, self._of_row, strict=True)
            },
        )

    def blocks(self, prediction: Prediction) -> Blocks:
        """Residuals of a prediction, simulated minus measured."""
        inputs = protocols_by_load(self.data.trials)
        blocks = [
            ResidualBlock(
                trial=trial.name,
                protocol=inputs[trial.name],
                channel=channel,
                residual=prediction.trials[trial.name][channel] - trial.measured[channel],
                sample_interval=trial.sample_interval,
            )
            for trial in self.data.trials
            if trial.name in prediction.trials
            for channel in self.compared(trial)
        ]
        blocks += [
            ResidualBlock(
                trial=table.name,
                protocol=table.name,
                channel=AT_REST,
                residual=prediction.tables[table.name] - table.angle,
            )
            for table in self.data.tables
        ]
        return blocks


def rest_as_read(rig: Rig, experiment: Experiment) -> Experiment:
    """A step to a row at rest with the true pressures, given what the rig's sensors read.

    A row states the pressure that was read, where a trial states what was commanded.
    """
    if rig.sensor is None:
        return experiment
    true = np.maximum(true_at_rest(experiment.command_value, rig.sensor, "pressure"), 0.0)
    return replace(as_read(rig, experiment), command_value=true)


def check_channels(channels: Sequence[str]) -> None:
    """Refuse a kind of channel that there is not.

    Raises:
        InputError: for an unknown one.
    """
    for name in channels:
        refuse_unknown(name, CHANNELS, f"`channels`: no channel {name!r}")


def check_table(rig: Rig, table: StaticTable) -> None:
    """Refuse a table at rest that is not of a rig.

    Raises:
        InputError: for another number of muscles, or a rig of several joints or one that slides.
    """
    _check_muscles(rig, table.name, table.pressure.shape[1])
    if not rig.names.short:
        raise InputError(
            f"{table.name!r} gives angles at rest of one joint that turns, rig {rig.name!r} has"
            f" {', '.join(rig.joints)}; compare recordings over time"
        )


def _check_muscles(rig: Rig, name: str, count: int) -> None:
    if count != len(rig.muscles):
        raise InputError(f"{name!r} is of {count} muscles, rig {rig.name!r} has {len(rig.muscles)}")
