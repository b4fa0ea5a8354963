"""Angle and force given the measured pressures: whether air or arm is to blame, before any name.

Simulated pressures miss what the valves and the air do differently. If the arm is driven by the
pressures that were measured, only what the muscles, the joint and the transmission do differently
is left in angle and force.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.where import Cell, cells
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.inference.residual_block import ResidualBlock, layout, stacked
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome
from pamsim.recordings.signals import kind_of
from pamsim.recordings.trial import Trial


def cells_with_measured_pressures(
    rig: Rig, data: CalibrationData, floor: NoiseFloor, *, threads: int | None = None
) -> tuple[Cell, ...]:
    """Excess of angle and forces over the floor when the arm is driven by measured pressures.

    Args:
        rig: refitted, without effects.
        data: recordings.
        floor: of their noise.
        threads: simulations at a time; None for one per processor.

    Returns:
        The cells, the largest excess first; none where pressures were not measured, the floor holds
        neither angle nor forces, or a run breaks down.
    """
    compared = {channel for channel in floor.sd if kind_of(channel) != "pressure"}
    groups = _repeats(data.trials, compared)
    if not groups:
        return ()
    runs = simulate_batch([(rig, _driven(members)) for members in groups], threads=threads)
    blocks: list[ResidualBlock] = []
    for members, run in zip(groups, runs, strict=True):
        if run.outcome is not Outcome.COMPLETED:
            return ()
        for trial in members:
            simulated = at_times(run, trial, rig.sensor)
            blocks += [
                ResidualBlock(
                    trial=trial.name,
                    protocol=trial.protocol,
                    channel=channel,
                    residual=simulated[channel] - measured,
                    sample_interval=trial.sample_interval,
                )
                for channel, measured in trial.measured.items()
                if channel in compared
            ]
    places = layout(blocks)
    residual = stacked(blocks, places)
    if residual is None:
        return ()
    every = TrialLayout(places=places, held_out=frozenset())
    return cells(every, residual, floor, [t.name for members in groups for t in members])


def _repeats(trials: Sequence[Trial], compared: Collection[str]) -> list[list[Trial]]:
    """Repeats together, of trials with every pressure and a compared channel.

    Trials that are driven by their measured pressures are left out: they are compared so anyhow.
    """
    groups: dict[tuple[str, bytes, float, bytes], list[Trial]] = {}
    for trial in trials:
        driven = trial.drives.all_measured
        complete = set(trial.pressure_channels) <= trial.measured.keys()
        if complete and not driven and not trial.measured.keys().isdisjoint(compared):
            key = (trial.protocol, trial.command.tobytes(), trial.load, trial.time.tobytes())
            groups.setdefault(key, []).append(replace(trial, lead_in=None))
    return list(groups.values())


def _driven(repeats: Sequence[Trial]) -> Experiment:
    """The experiment of repeats with the pressures that were measured, the mean over them."""
    first = repeats[0]
    pressures = [np.stack([t.measured[c] for c in t.pressure_channels], axis=1) for t in repeats]
    mean = np.mean(pressures, axis=0)
    drives, joints = first.drives, first.command[:, first.muscles :]
    names = drives.names or [f"muscle {number}" for number in range(1, first.muscles + 1)]
    measured = replace(drives, muscles=("measured",) * first.muscles)
    return replace(
        experiment_of(first),
        drive=measured.stated(names),
        command_time=first.time,
        command_value=np.hstack([mean, joints]),
        start_pressure=np.maximum(mean[0], 0.0),
    )
