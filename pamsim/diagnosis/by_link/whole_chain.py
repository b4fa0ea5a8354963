"""Recordings beside the whole chain, before and after what a diagnosis by link has found."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.compared_signal import Comparison, comparisons_of, shown_unit
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor, noise_floor
from pamsim.comparison.trial_prediction import Prediction, TrialPredictor
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.engine.parameters import each_muscle
from pamsim.engine.rig import Rig
from pamsim.inference.residual_block import layout


@dataclass(frozen=True, kw_only=True)
class ChannelGap:
    """Root mean squares of one channel in the held-out trials, the whole chain simulated.

    Attributes:
        unit: of all.
        floor: noise, as repeats or one trial show it; None if it is not known.
        before: what the rig misses, its nuisance parameters refitted; None if it breaks down, or
            parts of trials are held out and no whole one.
        after: what it misses with the effects that were found; None without any.
    """

    unit: str
    floor: float | None
    before: float | None
    after: float | None


@dataclass(frozen=True, kw_only=True)
class WholeChain:
    """The simulations of the whole chain.

    Attributes:
        as_it_is: trial -> channel -> (n,) simulated by the rig as it is [SI]; empty if it breaks
            down.
        comparisons: every compared channel of every trial, before and after.
        gap: channel -> what is missed.
    """

    as_it_is: Mapping[str, Mapping[str, FloatArray]]
    comparisons: tuple[Comparison, ...]
    gap: Mapping[str, ChannelGap]


def whole_chain(
    rig: Rig,
    data: CalibrationData,
    before: Mapping[str, float],
    after: Mapping[str, float] | None,
    *,
    held_out: Collection[str],
    threads: int | None = None,
) -> WholeChain:
    """Simulate all trials from the command on.

    Args:
        rig: as it is.
        data: recordings, as the rig names their signals.
        before: values of the refitted parameters [SI].
        after: of these and of the effects; None if there are none.
        held_out: names of trials.
        threads: simulations at a time; None for one per processor.
    """
    predictor = TrialPredictor(rig, data, threads=threads)
    # Starts as read: fitted to a held-out trial, they would take away some of what is missed there.
    predictor.linearise_starts(None)
    rigs = [rig, _with(rig, before), None if after is None else _with(rig, after)]
    stated, base, repaired = predictor.predictions(rigs)
    comparisons = tuple(
        one
        for trial in data.trials
        for one in comparisons_of(
            trial,
            predictor.compared(trial),
            None if base is None else base.trials[trial.name],
            None if repaired is None else repaired.trials[trial.name],
            held_out=trial.name in held_out,
        )
    )
    known = next((one for one in (stated, base, repaired) if one is not None), None)
    return WholeChain(
        as_it_is={} if stated is None else stated.trials,
        comparisons=comparisons,
        gap={} if known is None else _gap(predictor, known, comparisons),
    )


def floor_beside(predictor: TrialPredictor, prediction: Prediction) -> NoiseFloor:
    """Noise of the channels, by what a prediction misses of the trials."""
    blocks = predictor.blocks(prediction)
    residual = np.concatenate([block.residual for block in blocks])
    return noise_floor(layout(blocks), residual, predictor.data.trials)


def _with(rig: Rig, values: Mapping[str, float]) -> Rig | None:
    try:
        return rig.with_parameters(each_muscle(rig, values))
    except (InputError, ParameterError):  # an open end of a range
        return None


def _gap(
    predictor: TrialPredictor, known: Prediction, comparisons: tuple[Comparison, ...]
) -> dict[str, ChannelGap]:
    floor = floor_beside(predictor, known).sd
    found: dict[str, ChannelGap] = {}
    for channel in dict.fromkeys(part.channel for part in comparisons):
        own = [part for part in comparisons if part.channel == channel and part.held_out]
        unit, scale = shown_unit(channel)
        found[channel] = ChannelGap(
            unit=unit,
            floor=floor[channel] * scale,
            before=_rms([(part.rms(part.before), part.measured.size) for part in own]),
            after=_rms([(part.rms(part.after), part.measured.size) for part in own]),
        )
    return found


def _rms(levels: list[tuple[float | None, int]]) -> float | None:
    """Root mean square of all samples, by that of each trial and its number of samples."""
    known = [(level, count) for level, count in levels if level is not None]
    squares = sum(level**2 * count for level, count in known)
    return math.sqrt(squares / sum(count for _, count in known)) if known else None
