"""Errors of start pressures: the difference between the first sample and the true start.

The start of a trial is its first measured pressures, which include sensor noise. With shut valves
a start error lasts as long as the trial, and a fit would attribute it to another cause. So each
trial's start may differ from the reading by about that noise. The best-fitting difference is added
through the sensitivity of the simulated signals to the start: a linear nuisance, profiled out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.link_inputs import sample_noise
from pamsim.comparison.repeats import same_input
from pamsim.core.units import FloatArray
from pamsim.recordings.start_pressures import start_pressures
from pamsim.recordings.step_metrics import rough_noise
from pamsim.recordings.trial import Trial

Signals = Mapping[str, FloatArray]

STEP = 1e3
"""Change of a start pressure from which sensitivities are taken [Pa]."""

_REACH = 4.0  # standard deviations of sensor noise that a first sample is not off by
_LAGS = 20  # parts of a trial, one of which is the longest time over which noise may drift
_PASSES = 2  # the second weights channels by their residual without the start error
_SAME_START = 6.0  # standard deviations by which starts of repeats may differ


@dataclass(frozen=True)
class StartError:
    """Prior knowledge of one trial's start error."""

    read: FloatArray  # (m,) first measured minus simulated start pressure [Pa]
    # (m,) largest difference between true and read pressure [Pa]; 0 where a set point gives the
    # start
    spread: FloatArray

    def adjusted(
        self, trial: Trial, simulated: Signals, sensitivity: Signals, channels: Sequence[str]
    ) -> dict[str, FloatArray]:
        """Signals from the start that fits the trial best.

        Args:
            trial: as measured.
            simulated: channel -> (n,) at the trial's times [SI].
            sensitivity: channel -> (n, m) change per change of the start pressures [SI / Pa].
            channels: that are compared.

        Returns:
            Channel -> (n,), all channels of ``simulated``.
        """
        free = self.spread > 0.0
        if not free.any():
            return dict(simulated)
        spread = self.spread[free]
        shift = np.zeros(free.size)
        for _ in range(_PASSES):
            # In units of the spread; channels are weighted by their residual, model error included.
            normal = np.eye(int(free.sum()))
            read = self.read[free] / spread
            right = read.copy()
            for channel in channels:
                miss = trial.measured[channel] - simulated[channel]
                missed = miss - sensitivity[channel] @ shift
                slope = sensitivity[channel][:, free] * spread
                weight = 1.0 / max(float(np.mean(missed**2)), np.finfo(float).tiny)
                normal += weight * slope.T @ slope
                right += weight * slope.T @ miss
            away = np.linalg.solve(normal, right) - read
            # A model with a large error would otherwise move the start by more than a sensor error.
            away /= (1.0 + away**4) ** 0.25
            shift[free] = (read + away) * spread
        return {name: signal + sensitivity[name] @ shift for name, signal in simulated.items()}


def start_groups(trials: Sequence[Trial]) -> list[tuple[FloatArray, list[int]]]:
    """Trials that can be simulated from one start: repeats whose first samples differ by noise.

    Returns:
        Start pressures (m,) [Pa] of each group, and the numbers of its trials.

    Raises:
        InputError: if a trial does not give its start pressures.
    """
    groups: list[tuple[list[FloatArray], list[int]]] = []
    for number, trial in enumerate(trials):
        start = start_pressures(trial)
        for starts, members in groups:
            first = trials[members[0]]
            if same_input(first, trial) and np.all(
                np.abs(start - starts[0]) <= _SAME_START * _noise_of_repeats(first, trial)
            ):
                starts.append(start)
                members.append(number)
                break
        else:
            groups.append(([start], [number]))
    return [(np.mean(starts, axis=0), members) for starts, members in groups]


def start_error(
    trial: Trial, simulated_start: FloatArray, simulated: Signals | None = None
) -> StartError:
    """The start error of a trial before it is compared.

    It was simulated from a start (m,) [Pa], channel -> (n,) at the trial's times [SI]. The residual
    shows drifting sensor noise; without it, noise is assumed white.
    """
    noise = _noise(trial)
    if simulated is not None:
        drift = _of_pressures(trial, lambda c: _drifting(trial.measured[c] - simulated[c]))
        noise = np.maximum(noise, drift)
    # Noise and all, measured pressures are those of the run.
    free = np.array([kind != "measured" for kind in trial.drives.muscles])
    return StartError((start_pressures(trial) - simulated_start) * free, _REACH * noise * free)


def _noise(trial: Trial) -> FloatArray:
    """Noise of each muscle's pressure sensor from sample to sample, (m,) [Pa]; 0 without sensor.

    At least that of rounding to the converter's step, and what the recording states.
    """

    def of(channel: str) -> float:
        stated = trial.noise[channel].rms if channel in trial.noise else 0.0
        return max(sample_noise(trial.measured[channel]), stated)

    return _of_pressures(trial, of)


def _noise_of_repeats(first: Trial, second: Trial) -> FloatArray:
    """Noise of each muscle's pressure sensor, (m,) [Pa], drift as two repeats show it included."""

    def drift(channel: str) -> float:
        if channel not in second.measured:
            return 0.0
        return _drifting((first.measured[channel] - second.measured[channel]) / np.sqrt(2.0))

    noise = np.maximum(_noise(first), _noise(second))
    return np.maximum(noise, _of_pressures(first, drift))


def _of_pressures(trial: Trial, value: Callable[[str], float]) -> FloatArray:
    """A value of each muscle's pressure channel, (m,); 0 of one that was not measured."""
    channels = trial.pressure_channels
    return np.array([value(one) if one in trial.measured else 0.0 for one in channels])


def _drifting(miss: FloatArray) -> float:
    """Noise of a signal without its smooth part, drift included [as the signal]."""
    return rough_noise(miss, lag=max(len(miss) // _LAGS, 1))
