"""The gap between simulation and data on trials that no fit has seen, beside what noise allows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.core.units import FloatArray
from pamsim.inference.effective_degrees import effective_degrees

Residuals = Mapping[str, Mapping[str, FloatArray]]
"""Trial -> channel -> (n,) simulated minus measured [SI]."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """A root mean square.

    Attributes:
        value: [SI].
        interval95: [SI]; None where a protocol has too few trials.
    """

    value: float
    interval95: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class ChannelGap:
    """One channel on the held-out trials.

    Attributes:
        channel: such as ``angle``.
        floor: what a perfect model would be off by: noise, and what differs between repeats.
        before: residual of the base model.
        after: residual of the repaired model; None where nothing is claimed.
    """

    channel: str
    floor: Level
    before: Level
    after: Level | None


def gaps(
    before: Residuals,
    after: Residuals,
    floor: NoiseFloor,
    protocol_of: Mapping[str, str],
    held_out: Collection[str],
    *,
    repeated: bool = True,
) -> tuple[ChannelGap, ...]:
    """Root mean square residual per channel, before and after a repair.

    Trials are the random units and protocols are fixed strata, as for every claim of a diagnosis.

    Args:
        before: of the base model, all trials.
        after: of the repaired model; empty where nothing is claimed.
        floor: of the noise.
        protocol_of: trial -> protocol.
        held_out: names of the trials that count.
        repeated: whether trials of a protocol are repeats; if not, the floor has no interval.
    """
    judged = {protocol_of[trial] for trial in held_out}
    channels: list[ChannelGap] = []
    for channel in floor.sd:
        repeats = _strata(before, protocol_of, channel, lambda t: protocol_of[t] in judged)
        if not repeats:
            continue
        base = _strata(before, protocol_of, channel, held_out.__contains__)
        repaired = _strata(after, protocol_of, channel, held_out.__contains__)
        noise = np.mean([floor.variance_in(channel, p) for p in repeats])
        channels.append(
            ChannelGap(
                channel=channel,
                floor=_level(float(noise), [_scatter(r) for r in repeats.values()], _about_mean)
                if repeated
                else Level(value=float(noise) ** 0.5, interval95=None),
                before=_own_level(base),
                after=_own_level(repaired) if repaired else None,
            )
        )
    return tuple(channels)


def _strata(
    residuals: Residuals,
    protocol_of: Mapping[str, str],
    channel: str,
    wanted: Callable[[str], bool],
) -> dict[str, list[FloatArray]]:
    """Protocol -> residuals of its trials."""
    strata: dict[str, list[FloatArray]] = {}
    for trial, channels in residuals.items():
        if wanted(trial) and channel in channels:
            strata.setdefault(protocol_of[trial], []).append(channels[channel])
    return strata


def _own_level(strata: Mapping[str, Sequence[FloatArray]]) -> Level:
    squares = [
        np.array([np.mean(r**2) for r in parts], dtype=np.float64) for parts in strata.values()
    ]
    return _level(float(np.mean([s.mean() for s in squares])), squares, _independent)


def _scatter(repeats: Sequence[FloatArray]) -> FloatArray:
    """Mean square of each repeat about the mean of all, as an estimate of the noise's variance."""
    shortest = min(map(len, repeats))
    stack = np.stack([repeat[:shortest] for repeat in repeats])
    spare = max(len(repeats) - 1, 1)
    return np.mean((stack - stack.mean(axis=0)) ** 2, axis=1) * len(repeats) / spare


def _independent(count: int) -> float:
    return 1.0 if count > 1 else np.inf


def _about_mean(count: int) -> float:
    """Squares about a common mean are correlated: of two repeats, they are the same number.

    With a correlation of 1/(n - 1)^2 between them, which holds for normal noise, the variance of
    their mean is (n - 1)/(n - 2) times that of independent values.
    """
    return (count - 1) / (count - 2) if count > 2 else np.inf


def _level(square: float, strata: Sequence[FloatArray], widening: Callable[[int], float]) -> Level:
    """A root mean square with a t interval on the mean square."""
    factors = [widening(s.size) for s in strata]
    if not np.all(np.isfinite(factors)):
        return Level(value=square**0.5, interval95=None)
    variances = np.array(
        [k * float(np.var(s, ddof=1)) / s.size for k, s in zip(factors, strata, strict=True)]
    )
    degrees = effective_degrees(variances, np.array([s.size - 1.0 for s in strata]))
    reach = float(student.ppf(0.975, degrees)) * float(np.sum(variances)) ** 0.5 / len(strata)
    return Level(
        value=square**0.5,
        interval95=(max(square - reach, 0.0) ** 0.5, (square + reach) ** 0.5),
    )
