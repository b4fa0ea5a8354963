"""Spectrum of periodic residuals: linear misfit, even and odd distortion, noise.

At lines that the command excites, a model may miss linear dynamics. At the others it can only miss
distortion: what is even in the motion appears at even lines, what is odd at odd ones
(Pintelon and Schoukens, System Identification, 2012, section 4.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.periodicity import samples_per_period
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.gap import Residuals
from pamsim.recordings.trial import Trial

_EXCITED = 1e-6  # of the strongest line: weaker is rounding
_JITTER = 0.02  # of a sample, by which a clock may be off and still be uniform


@dataclass(frozen=True, kw_only=True)
class SpectrumSplit:
    """One channel of one periodic protocol, after the first period.

    Attributes:
        protocol: its name.
        channel: such as ``angle``.
        period: of the command [s].
        segments: periods of all repeats that were averaged.
        mean: of the residual [SI].
        excited: root mean square at lines of the command [SI].
        even: at even lines that are not excited [SI].
        odd: at odd lines that are not excited [SI].
        noise: of what differs between the periods [SI]; None of a single one, and the other numbers
            then hold noise too.
    """

    protocol: str
    channel: str
    period: float
    segments: int
    mean: float
    excited: float
    even: float
    odd: float
    noise: float | None


def spectrum_splits(trials: Sequence[Trial], residuals: Residuals) -> tuple[SpectrumSplit, ...]:
    """Split the residuals of all protocols whose command is periodic.

    Args:
        trials: as measured.
        residuals: of one model.
    """
    groups: dict[str, list[Trial]] = {}
    for trial in trials:
        if trial.name in residuals:
            groups.setdefault(trial.protocol, []).append(trial)
    splits: list[SpectrumSplit] = []
    for protocol, repeats in groups.items():
        first = repeats[0]
        count = samples_per_period(first.command)
        if count is None or not all(map(_uniform, repeats)):
            continue
        excited = _excited(first.command[:count])
        for channel in residuals[first.name]:
            parts = [_periods(residuals[t.name][channel], count) for t in repeats]
            splits.append(
                _split(
                    protocol,
                    channel,
                    count * first.sample_interval,
                    np.concatenate(parts),
                    excited,
                )
            )
    return tuple(splits)


def _uniform(trial: Trial) -> bool:
    steps = np.diff(trial.time)
    return bool(np.ptp(steps) < _JITTER * trial.sample_interval)


def _excited(command: FloatArray) -> NDArray[np.bool_]:
    """Mask of the lines that any column of one period excites, the mean not among them."""
    size = np.abs(np.fft.rfft(command, axis=0)).max(axis=1)
    size[0] = 0.0
    return size > _EXCITED * size.max()


def _periods(residual: FloatArray, count: int) -> FloatArray:
    """Whole periods but the first, in which the transient dies out, shape (k, count)."""
    whole = residual.size // count
    return residual[count : whole * count].reshape(whole - 1, count)


def _split(
    protocol: str,
    channel: str,
    period: float,
    segments: FloatArray,
    excited: NDArray[np.bool_],
) -> SpectrumSplit:
    many, count = segments.shape
    lines = np.fft.rfft(segments, axis=1) / count
    share = np.full(lines.shape[1], 2.0)  # a line and its mirror image
    share[0] = 1.0
    if count % 2 == 0:
        share[-1] = 1.0
    middle = lines.mean(axis=0)
    scatter = np.zeros(share.size)
    if many > 1:
        scatter = np.sum(np.abs(lines - middle) ** 2, axis=0) / (many - 1)
    # What is left of the noise in the mean over periods is no distortion.
    power = share * (np.abs(middle) ** 2 - scatter / many)
    order = np.arange(share.size)
    quiet = ~excited & (order > 0)

    def level(mask: NDArray[np.bool_]) -> float:
        return max(float(power[mask].sum()), 0.0) ** 0.5

    return SpectrumSplit(
        protocol=protocol,
        channel=channel,
        period=period,
        segments=many,
        mean=float(middle[0].real),
        excited=level(excited),
        even=level(quiet & (order % 2 == 0)),
        odd=level(quiet & (order % 2 == 1)),
        noise=float(np.sum(share * scatter)) ** 0.5 if many > 1 else None,
    )
