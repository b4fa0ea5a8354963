"""Noise of the outputs of links: by what repeats differ by, or else within trials.

Without repeats noise is taken from what no model misses:

* periods of a command, which repeat each other;
* residuals while a command is held and the rig has settled, their trends taken off, since what a
  model misses then is constant or drifts: noise that changes more slowly than holds last is unseen;
* a second reading of every measured signal, drawn with the noise that shows from sample to sample.
  Links are simulated with it as with the first, so that noise which inputs bring along counts.
  Noise that drifts at all is unseen, but for what a recording states.

What a recording states of its sensors is drawn in the same way, and is the least noise there is.

What differs from trial to trial is in none of them. So without repeats a residual above this noise
does not show that a model is missing something, and one with the colour of this noise does not show
that nothing is left.

Source: H. D. Patterson and R. Thompson, Biometrika 58 (1971) (variances beside fitted trends).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg

from pamsim.comparison.chain_runs import Residuals, link_residuals
from pamsim.comparison.link_inputs import rounding_noise, sample_noise
from pamsim.comparison.links import Link, Runs, joined_runs
from pamsim.comparison.noise_floor import FloorRoute, settled_holds
from pamsim.comparison.repeats import Repeats, periods, repeats
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.inference.blocks import noise_from_repeats
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise
from pamsim.recordings.signals import DRIVES, kind_of
from pamsim.recordings.trial import Trial

_toeplitz_times: Any = scipy.linalg.matmul_toeplitz

Output = tuple[Link, str]
"""Link and channel."""

_SHORTEST = 20  # samples of a hold: two orders and more of an autoregressive model beside a trend
_ENOUGH = 0.25  # share of the samples that holds must give, as for `noise_within_trial`
_PASSES = 10
"""Of trends and noise: the deviation of noise that remembers a sixth of a hold is then known to a
tenth (0.89 of it; 0.73 as left by the trends)."""


@dataclass(frozen=True)
class OutputNoise:
    """Noise of an output."""

    noise: ArNoise  # of its residual
    source: FloorRoute  # how it is known


def link_noise(
    rig: Rig,
    trials: Sequence[Trial],
    exact: Residuals,
    *,
    divided: Runs = joined_runs,
    threads: int | None = None,
) -> dict[Output, OutputNoise]:
    """Noise of every output of every link.

    ``exact`` is the residual of the rig as it is, each trial driven by its own measured inputs;
    other arguments are those of `pamsim.comparison.chain_runs.link_residuals`.
    """
    found: dict[Output, OutputNoise] = {}
    groups = repeats(trials)
    read_again: Residuals | None = None
    stated = any(
        one.rms > sample_noise(trial.measured[channel])
        for trial in trials
        for channel, one in trial.noise.items()
    )
    unrepeated = FloorRoute.STATED if stated else FloorRoute.WITHIN_TRIALS
    for link, channel in dict.fromkeys((link, channel) for link, _, channel in exact):
        names = [t.name for t in trials if (link, t.name, channel) in exact]
        own = {name: exact[link, name, channel] for name in names}
        logs = [(trial, own[trial.name]) for trial in trials if trial.name in own]
        repeated = _by_repeats(groups, own)
        one = repeated or _by_periods(logs) or _by_holds(logs)
        if one is None or stated:
            read_again = read_again or _read_again(rig, trials, exact, divided, threads)
            keys = [(link, name, channel) for name in names]
            again = fit_ar_noise([read_again[key] for key in keys if key in read_again])
            if one is None or again.standard_deviation > one.noise.standard_deviation:
                one = OutputNoise(again, FloorRoute.REPEATS if repeated else unrepeated)
        # A reading that does not change while a command is held has the noise of its rounding, as
        # have repeats that read the same.
        shown = sample_noise if repeated is None else rounding_noise
        least = float(np.mean([shown(trial.measured[channel]) for trial, _ in logs]))
        if one.noise.standard_deviation < least:
            one = replace(one, noise=ArNoise((), least**2))
        found[link, channel] = one
    return found


def _by_repeats(
    groups: Sequence[Repeats], residuals: Mapping[str, FloatArray]
) -> OutputNoise | None:
    """Noise by what trials of one input differ by; None without such trials."""
    runs = [
        np.stack([residuals[trial.name] for trial in group.trials])
        for group in groups
        if len(group.trials) > 1 and all(trial.name in residuals for trial in group.trials)
    ]
    return OutputNoise(noise_from_repeats(runs), FloorRoute.REPEATS) if runs else None


def _by_periods(logs: Sequence[tuple[Trial, FloatArray]]) -> OutputNoise | None:
    """Noise by what the periods of a command differ by, all but the first."""
    each = [periods(residual, trial.command) for trial, residual in logs]
    runs = [own for own in each if own is not None]
    return OutputNoise(noise_from_repeats(runs), FloorRoute.PERIODS) if runs else None


def _by_holds(logs: Sequence[tuple[Trial, FloatArray]]) -> OutputNoise | None:
    """Noise of settled holds about a straight line each; None if there are too few."""
    held = [
        residual[rows]
        for trial, residual in logs
        for rows in settled_holds(trial.command, trial.sample_interval)
    ]
    held = [part for part in held if part.size >= _SHORTEST]
    if sum(map(len, held)) < _ENOUGH * sum(residual.size for _, residual in logs):
        return None
    return OutputNoise(_about_trends(held), FloorRoute.HOLDS)


def _about_trends(parts: Sequence[FloatArray]) -> ArNoise:
    """Noise of series about a straight line each, with what the lines have taken up."""
    trends = [np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, part.size), 2))[0] for part in parts]
    left = [part - q @ (q.T @ part) for part, q in zip(parts, trends, strict=True)]
    noise = fit_ar_noise(left)
    for _ in range(_PASSES):
        lags = noise.autocovariance(max(map(len, trends)))
        absorbed: list[FloatArray] = []
        for q in trends:
            covariance = q.T @ _toeplitz_times(lags[: len(q)], q)
            squares, turn = np.linalg.eigh(covariance)
            root = turn * np.sqrt(np.clip(squares, 0.0, None))
            absorbed.append(np.asarray(q @ root, dtype=np.float64))
        noise = fit_ar_noise(left, absorbed=absorbed)
    return noise


def _read_again(
    rig: Rig,
    trials: Sequence[Trial],
    exact: Residuals,
    divided: Runs,
    threads: int | None,
) -> Residuals:
    """By what residuals change if every signal has its noise once more."""
    rng = np.random.default_rng(0)
    second = [_second_reading(rig, trial, rng) for trial in trials]
    found = link_residuals(rig, second, divided=divided, threads=threads)
    return {key: again - exact[key] for key, again in found.items() if key in exact}


def _second_reading(rig: Rig, trial: Trial, rng: np.random.Generator) -> Trial:
    """A trial whose signals have their noise once more, those that drive it included."""
    measured = {
        channel: values + _noise_of(trial, channel, rng)
        for channel, values in trial.measured.items()
    }
    command, drives = trial.command.copy(), trial.drives
    channels = (*trial.pressure_channels, *map(rig.names.joint_channel, drives.joints))
    for column, (channel, kind) in enumerate(zip(channels, drives.kinds, strict=True)):
        if channel in measured and DRIVES[kind].quantity == kind_of(channel):
            command[:, column] = measured[channel]
    return replace(trial, measured=measured, command=command)


def _noise_of(trial: Trial, channel: str, rng: np.random.Generator) -> FloatArray:
    """Noise as samples show it, or as it is stated where that is more."""
    values = trial.measured[channel]
    shown, stated = sample_noise(values), trial.noise.get(channel)
    if stated is None or stated.rms <= shown:
        return shown * rng.standard_normal(values.size)
    return stated.drawn(values.size, trial.sample_interval, rng)
