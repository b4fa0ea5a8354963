"""What every identified model says of its numbers and of its trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.finite import safe
from pamsim.linear.fit_percent import fit_percent
from pamsim.linear.signal_record import SignalRecord
from pamsim.linear.step_fit import Interval

FloatArray = NDArray[np.float64]

_KEY_SUFFIX = {"s": "_s", "s^2": "_s2", "s^3": "_s3", "rad/s": "_rad_per_s"}


@dataclass(frozen=True)
class Estimate:
    """One identified number.

    Attributes:
        name: such as ``K``, ``T1``, ``L``, ``wn``, ``zeta``.
        unit: SI unit; ``-`` for none.
        value: the estimate [unit].
        interval95: lower and upper end; None where the data do not determine it [unit].
    """

    name: str
    unit: str
    value: float
    interval95: Interval | None

    @property
    def key(self) -> str:
        """Name with its unit, as files write it: ``T1_s``."""
        return self.name + _KEY_SUFFIX.get(self.unit, "")


@dataclass(frozen=True)
class TrialScore:
    """How a model's free run meets one trial.

    Attributes:
        name: the record's name.
        samples: number of samples.
        offset: output at rest under the first input value, estimated [output unit].
        fit_percent: normalised RMS fit of the free run [%].
        rms: root mean square of measured minus simulated [output unit].
    """

    name: str
    samples: int
    offset: float
    fit_percent: float
    rms: float

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-safe values."""
        return {
            "name": self.name,
            "samples": self.samples,
            "offset": safe(self.offset),
            "fit_percent": safe(self.fit_percent),
            "rms": safe(self.rms),
        }


def estimates_as_dict(estimates: Sequence[Estimate]) -> dict[str, Any]:
    """Return ``{"T1_s": value, "interval95_T1_s": [low, high] or None, ...}``, JSON-safe."""
    result: dict[str, Any] = {}
    for item in estimates:
        result[item.key] = safe(item.value)
        sides = item.interval95
        result[f"interval95_{item.key}"] = None if sides is None else [safe(v) for v in sides]
    return result


def complex_list(values: Sequence[complex]) -> list[list[float]]:
    """Return ``[[real, imaginary], ...]``, JSON-safe."""
    return [[float(v.real), float(v.imag)] for v in values]


def trial_score(record: SignalRecord, simulated: FloatArray, own: FloatArray) -> TrialScore:
    """Score a free run.

    Args:
        record: the trial.
        simulated: the free run, offset included, shape ``(n,)`` [output unit].
        own: the trial's own coefficients, offset first.

    Returns:
        The score.
    """
    miss = record.output - simulated
    return TrialScore(
        name=record.name,
        samples=record.output.size,
        offset=float(own[0]),
        fit_percent=fit_percent(record.output, simulated),
        rms=float(np.sqrt(np.mean(miss**2))),
    )


def pooled_fit_percent(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Return the fit percent over trials together, each measured output about its own mean.

    Args:
        pairs: (measured, simulated) of each trial, shape ``(n_i,)`` [output unit].

    Returns:
        The fit [%].
    """
    measured = np.concatenate([y - np.mean(y) for y, _ in pairs])
    simulated = np.concatenate([run - np.mean(y) for y, run in pairs])
    # The joint mean is 0 up to rounding, so that this is the definition of one trial.
    return fit_percent(measured, simulated)
