"""Whether one model predicts unseen trials better than another, by more than luck.

Trials are the random units and protocols are fixed strata: samples of one trial share its
parameters and its drift, so that counting samples finds effects in data that have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """By how much the loss of one model is below that of another.

    Attributes:
        gain: mean difference of the losses, in floors.
        error: its standard error.
        degrees: of freedom of that error.
        p_value: one-sided, of no gain; 1 if there are no repeats to tell.
    """

    gain: float
    error: float
    degrees: int
    p_value: float

    @property
    def interval95(self) -> tuple[float, float]:
        """Two-sided 95 % interval of the gain; infinite without repeats."""
        if self.degrees < 1:
            return (-np.inf, np.inf)
        reach = float(student.ppf(0.975, self.degrees)) * self.error
        return self.gain - reach, self.gain + reach


def losses(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, *, held_out: bool
) -> dict[str, float]:
    """Mean square of each trial's residual, in units of the noise: 1 is a perfect model's.

    Args:
        layout: of the residual.
        residual: (n,) [SI].
        floor: of the noise.
        held_out: True for the trials that no fit has seen.

    Returns:
        Trial -> loss, the mean over its channels.
    """
    parts: dict[str, list[float]] = {name: [] for name in layout.trials(held_out=held_out)}
    for place in layout.places:
        if place.block.trial in parts:
            square = float(np.mean(residual[place.rows] ** 2))
            parts[place.block.trial].append(square / floor.sd[place.block.channel] ** 2)
    return {name: float(np.mean(values)) for name, values in parts.items()}


def compare(
    before: Mapping[str, float], after: Mapping[str, float], protocol_of: Mapping[str, str]
) -> Comparison:
    """Paired comparison of two models over the same trials.

    Args:
        before: trial -> loss.
        after: trial -> loss.
        protocol_of: trial -> protocol.
    """
    strata: dict[str, list[float]] = {}
    for trial, loss in before.items():
        strata.setdefault(protocol_of[trial], []).append(loss - after[trial])
    count = len(strata)
    gain = float(np.mean([np.mean(values) for values in strata.values()]))
    degrees = sum(len(values) - 1 for values in strata.values())
    variance = sum(
        float(np.var(values, ddof=1)) / len(values) for values in strata.values() if len(values) > 1
    )
    error = float(np.sqrt(variance)) / count
    if degrees < 1:
        return Comparison(gain=gain, error=np.inf, degrees=0, p_value=1.0)
    if error == 0.0:
        return Comparison(gain=gain, error=0.0, degrees=degrees, p_value=float(gain <= 0.0))
    p_value = float(student.sf(gain / error, degrees))
    return Comparison(gain=gain, error=error, degrees=degrees, p_value=p_value)
