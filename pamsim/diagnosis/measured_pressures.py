"""Angle and force given the measured pressures: whether air or arm is to blame, before any name.

Simulated pressures miss what the valves and the air do differently. If the arm is driven by the
pressures that were measured, only what the muscles, the joint and the transmission do differently
is left in angle and force.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from pamsim.actuator.regulation import regulator_time_constant
from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.errors import InputError
from pamsim.core.experiment import Experiment
from pamsim.core.recording import Outcome
from pamsim.core.signal_names import kind_of
from pamsim.core.trial import Trial
from pamsim.diagnosis.method.where import Cell, cells
from pamsim.effects.catalog import EFFECTS
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.inference.residual_block import ResidualBlock, layout, stacked

_DIRECT = {"valve.regulator_dead_band": 0.0} | {
    parameter.name: parameter.neutral
    for effect in EFFECTS.values()
    if effect.upstream_of_pressure
    for parameter in effect.parameters
    if parameter.neutral is not None and not parameter.shape
}
"""Rig parameters with which pressures follow their set points without delay or loss."""

_RATE = 500.0  # of set points [Hz]: several within a sample of a usual recording
_STEPS = 3.0  # time steps in which pressures follow at the quickest


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
        neither angle nor forces, or the arm cannot be driven so.
    """
    compared = {channel for channel in floor.sd if kind_of(channel) != "pressure"}
    direct = with_direct_air(rig)
    groups = _repeats(data.trials, compared)
    if not groups:
        return ()
    jobs = [(direct, driven(members, _lag(direct))) for members in groups]
    try:
        runs = simulate_batch(jobs, threads=threads)
    except InputError:
        return ()
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
    """Repeats together, of trials with every pressure and a compared channel."""
    groups: dict[tuple[str, bytes, float, bytes], list[Trial]] = {}
    for trial in trials:
        pressures = set(trial.pressure_channels)
        if pressures <= trial.measured.keys() and not trial.measured.keys().isdisjoint(compared):
            key = (trial.protocol, trial.command.tobytes(), trial.load, trial.time.tobytes())
            groups.setdefault(key, []).append(trial)
    return list(groups.values())


def driven(repeats: Sequence[Trial], lag: float) -> Experiment:
    """The experiment whose set points are what the pressure sensors read, the mean over repeats.

    Args:
        repeats: of one experiment, with every pressure measured.
        lag: of the pressures behind their set points, made up for [s].
    """
    first = repeats[0]
    mean = np.mean(
        [
            np.stack([t.measured[channel] for channel in t.pressure_channels], axis=1)
            for t in repeats
        ],
        axis=0,
    )
    commanded = experiment_of(first)
    count = round(commanded.duration * _RATE)
    # Each value is held to the next: taken in the middle, it neither leads nor lags.
    time = np.arange(count) / _RATE
    ahead = np.stack(
        [np.interp(time + lag + 0.5 / _RATE, first.time, column) for column in mean.T], axis=1
    )
    return replace(
        commanded,
        command="pressure",
        command_time=time,
        command_value=np.maximum(ahead, 0.0),
        start_pressure=np.maximum(mean[0], 0.0),
        sample_rate=_RATE,
    )


def _lag(rig: Rig) -> float:
    return 2.0 * max(map(regulator_time_constant, rig.muscles.values()))


def with_direct_air(rig: Rig) -> Rig:
    """The rig with valves that follow any set point at once, and nothing in the air's way."""
    direct = rig.with_parameters(_DIRECT)
    slowest = _STEPS * float(rig.model.opt.timestep)
    flows: dict[str, float] = {}
    for name, muscle in direct.muscles.items():
        larger = max(regulator_time_constant(muscle) / slowest, 1.0)
        for side in ("conductance_fill", "conductance_exhaust"):
            flows[f"{name}:valve.{side}"] = larger * float(getattr(muscle.valve, side))
    return direct.with_parameters(flows)
