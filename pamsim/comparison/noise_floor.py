"""Noise floor: how far a perfect model would still be off, from repeats or within trials.

A residual holds noise and what the model misses. Where no other trial repeats an input, they are
separated, in order of preference, by

* periods: where the command goes through three periods or more, all but the first are repeats;
* holds: while a command is held and has settled, what the model misses hardly changes over `LAG`;
  noise that drifts more slowly goes unseen;
* the trial: what the model misses is smooth from one sample to the next, but for the moments that a
  median ignores; noise that drifts at all goes unseen.

None of these is less than the rounding of what was read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

import numpy as np

from pamsim.comparison.link_inputs import rounding_noise
from pamsim.comparison.repeats import periods
from pamsim.core.units import FloatArray
from pamsim.inference.noise_model import Scatter, pooled_deviation, repeat_scatter
from pamsim.inference.simulator_fit import BlockPlace
from pamsim.recordings.step_metrics import rough_noise
from pamsim.recordings.trial import Trial

LAG = 0.5
"""Time over which residuals are compared [s]."""

SETTLED = 0.5
"""Time after a change of the command at which a hold begins to count [s]."""

_ENOUGH = 0.25  # share of the trial's samples that its holds must give


class FloorRoute(StrEnum):
    """How a noise floor is known."""

    REPEATS = "repeats"
    PERIODS = "periods"
    HOLDS = "holds"
    WITHIN_TRIALS = "within trials"
    STATED = "stated"


@dataclass(frozen=True, kw_only=True)
class NoiseFloor:
    """Noise of every channel."""

    sd: Mapping[str, float]  # channel -> standard deviation over all protocols [SI]
    variance: Mapping[tuple[str, str], float]  # (channel, protocol) -> variance [SI^2]
    routes: Mapping[tuple[str, str], FloorRoute]  # (channel, protocol) -> how it is known


def noise_floor(
    places: Sequence[BlockPlace],
    residual: FloatArray,
    trials: Sequence[Trial] = (),
) -> NoiseFloor:
    """Noise from what repeats of a protocol differ by, or else within trials.

    Whatever the model is, repeats have the same simulation, so their residuals differ by sensor
    noise and by what varies from trial to trial.

    Args:
        places: of the channels of all trials in the residual.
        residual: (n,) of any parameters [SI].
        trials: by whose commands, their periods and holds, single trials are judged, and whose
            stated noise is the least.
    """
    of_trial = {trial.name: trial for trial in trials}
    in_protocol: dict[tuple[str, str], list[BlockPlace]] = {}
    for place in places:
        key = place.block.channel, place.block.protocol
        in_protocol.setdefault(key, []).append(place)
    least = {channel: _smallest(places, channel) for channel, _ in in_protocol}
    scatter = repeat_scatter(places, residual)
    routes = dict.fromkeys(scatter, FloorRoute.REPEATS)
    for (channel, protocol), own in in_protocol.items():
        key, first = (channel, protocol), own[0]
        if key not in scatter:
            single = of_trial.get(first.block.trial)
            routes[key], scatter[key] = noise_within_trial(
                residual[first.rows],
                first.block.sample_interval or 1.0,
                None if single is None else single.command,
            )
        known = [of_trial[p.block.trial] for p in own if p.block.trial in of_trial]
        if known:
            rounding = rounding_noise(np.concatenate([t.measured[channel] for t in known]))
            square = max(scatter[key].square, rounding**2 * scatter[key].freedom)
            scatter[key] = replace(scatter[key], square=square)
        stated = [trial.noise[channel].rms for trial in known if channel in trial.noise]
        least[channel] = max(least[channel], *stated, 0.0)
    pooled = {
        channel: pooled_deviation([s for (name, _), s in scatter.items() if name == channel])
        for channel in least
    }
    return NoiseFloor(
        sd={channel: max(deviation, least[channel]) for channel, deviation in pooled.items()},
        variance={key: max(scatter[key].variance, least[key[0]] ** 2) for key in in_protocol},
        routes=routes,
    )


def _smallest(places: Sequence[BlockPlace], channel: str) -> float:
    """A noise below rounding would let the last bit of a simulation decide [SI]."""
    size = max(float(np.abs(p.block.residual).max()) for p in places if p.block.channel == channel)
    return max(1e-9 * size, np.finfo(float).tiny)


def noise_within_trial(
    residual: FloatArray, interval: float, command: FloatArray | None
) -> tuple[FloorRoute, Scatter]:
    """Route to the noise of one channel of one trial, and the noise's squares.

    The residual (n,) is of any parameters [SI], with an interval between samples [s]; the command
    is (n, m), None if it is not known.
    """
    if command is not None:
        runs = periods(residual, command)
        if runs is not None:
            square = float(np.sum((runs - runs.mean(axis=0)) ** 2))
            return FloorRoute.PERIODS, Scatter(square, (runs.shape[0] - 1) * runs.shape[1])
        # `LAG` in samples; less in a trial shorter than four of it.
        lag = min(max(round(LAG / interval), 1), max((residual.size - 1) // 4, 1))
        held = [residual[rows] for rows in settled_holds(command, interval)]
        held = [r for r in held if r.size > 2 * lag]
        count = sum(map(len, held))
        if count - 2 * lag * len(held) >= _ENOUGH * residual.size:
            return FloorRoute.HOLDS, Scatter(rough_noise(*held, lag=lag) ** 2 * count, count)
    count = residual.size
    return FloorRoute.WITHIN_TRIALS, Scatter(rough_noise(residual) ** 2 * count, count)


def settled_holds(command: FloatArray, interval: float) -> list[slice]:
    """Samples at which a command (n, m) is held and has been for `SETTLED`; interval in [s]."""
    changed = np.flatnonzero(np.any(np.diff(command, axis=0) != 0.0, axis=1)) + 1
    ends = [0, *changed.tolist(), command.shape[0]]
    wait = round(SETTLED / interval)
    return [slice(start + wait, stop) for start, stop in pairwise(ends) if stop - start > wait]
