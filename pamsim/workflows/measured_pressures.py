"""Angle and force given the measured pressures: whether air or arm is to blame, before any name.

Simulated pressures miss what the valves and the air do differently. If the arm is driven by the
pressures that were measured, only what the muscles, the joint and the transmission do differently
is left in angle and force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamsim.actuator.regulation import regulator_time_constant
from pamsim.core.errors import InputError
from pamsim.core.trial import Trial
from pamsim.diagnosis.noise_floor import NoiseFloor
from pamsim.diagnosis.trial_residuals import TrialLayout
from pamsim.diagnosis.where import Cell, cells
from pamsim.engine.rig import Rig
from pamsim.sysid.residual_block import layout, stacked
from pamsim.workflows.calibration_data import CalibrationData
from pamsim.workflows.trial_prediction import TrialPredictor

_DIRECT = {
    "valve.line_lag": 0.0,
    "valve.delay": 0.0,
    "valve.dead_zone": 0.0,
    "valve.regulator_dead_band": 0.0,
    "valve.supply_resistance": 0.0,
    "chamber.leak_conductance": 0.0,
}

_FASTEST = 8.0  # times larger valves
_STEPS = 3.0  # time steps in which pressures follow at the quickest


def given_pressures(
    rig: Rig, data: CalibrationData, floor: NoiseFloor, *, threads: int | None = None
) -> tuple[Cell, ...]:
    """Excess of angle and forces over the floor when the arm is driven by measured pressures.

    Args:
        rig: refitted, without effects.
        data: recordings.
        floor: of their noise.
        threads: simulations at a time; None for one per processor.

    Returns:
        The cells, the largest excess first; none where pressures, or angle and forces, were not
        measured, or the arm cannot be driven so.
    """
    direct = with_direct_air(rig)
    lag = max(map(regulator_time_constant, direct.muscles.values()))
    driven = driven_by_pressures(data.trials, lag)
    if not driven:
        return ()
    given = replace(data, trials=tuple(driven), tables=())
    try:
        predictor = TrialPredictor(rig, given, channels=("angle", "force"), threads=threads)
        (found,) = predictor.predictions([direct])
    except InputError:
        return ()
    if found is None:
        return ()
    blocks = predictor.blocks(found)
    places = layout(blocks)
    residual = stacked(blocks, places)
    if residual is None:
        return ()
    every = TrialLayout(places=places, held_out=frozenset())
    return cells(every, residual, floor, [trial.name for trial in driven])


def driven_by_pressures(trials: Sequence[Trial], lag: float) -> list[Trial]:
    """Trials whose command is what the pressure sensors read, the mean over repeats.

    Args:
        trials: all of one rig; those without every pressure, or without anything else, are left
            out.
        lag: of the pressures behind their set points, made up for [s].

    Returns:
        The same measurements under other commands, without the pressures to compare.
    """
    groups: dict[tuple[str, bytes, float, int], list[Trial]] = {}
    for trial in trials:
        channels = [f"pressure_{m + 1}" for m in range(trial.muscles)]
        if set(channels) < set(trial.measured):
            key = (trial.protocol, trial.command.tobytes(), trial.load, trial.time.size)
            groups.setdefault(key, []).append(trial)
    found: list[Trial] = []
    for members in groups.values():
        stacks = [
            np.stack([t.measured[f"pressure_{m + 1}"] for m in range(t.muscles)], axis=1)
            for t in members
        ]
        mean = np.maximum(np.mean(stacks, axis=0), 0.0)
        # Held from sample to sample, the mean of the two neither leads nor lags.
        between = 0.5 * (mean[:-1] + mean[1:])
        rate = np.diff(mean, axis=0) / np.diff(members[0].time)[:, np.newaxis]
        held = np.concatenate([np.maximum(between + lag * rate, 0.0), mean[-1:]])
        for trial in members:
            rest = {n: v for n, v in trial.measured.items() if not n.startswith("pressure")}
            found.append(replace(trial, command=held, command_kind="pressure", measured=rest))
    return found


def with_direct_air(rig: Rig) -> Rig:
    """The rig with valves that follow any set point at once, and nothing in the air's way."""
    direct = rig.with_parameters(_DIRECT)
    slowest = _STEPS * float(rig.model.opt.timestep)
    flows: dict[str, float] = {}
    for name, muscle in direct.muscles.items():
        larger = min(max(regulator_time_constant(muscle) / slowest, 1.0), _FASTEST)
        for side in ("conductance_fill", "conductance_exhaust"):
            flows[f"{name}:valve.{side}"] = larger * float(getattr(muscle.valve, side))
    return direct.with_parameters(flows)
