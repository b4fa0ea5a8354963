"""Whether one model predicts held-out data better than another, and how sure that is.

Of recordings, trials are the random units and protocols are fixed strata: samples of one trial
share its parameters and its drift, so that counting samples finds effects in data that have none.
Of a table, every row is a unit.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.units import FloatArray
from pamsim.inference.effective_degrees import effective_degrees
from pamsim.inference.permutation import sign_flip_p_value

_FLIPS = 9_999

_FEWEST_SIGNS = 10
"""Held-out trials from which the signs of their gains count: so many agree by chance in one of
1,000 cases."""


@dataclass(frozen=True, kw_only=True)
class Improvement:
    """By how much the held-out loss of one model is below that of another.

    Attributes:
        gain: mean difference of the losses: over the noise variance for trials, squared errors
            [SI squared] for rows.
        error: its standard error; infinite where there are no repeats.
        degrees: of freedom of that error; 0 where there are no repeats.
        p_value: one-sided, of no gain; 1 where there are no repeats.
    """

    gain: float
    error: float
    degrees: float
    p_value: float

    @property
    def standard_errors(self) -> float:
        """The gain in standard errors; 0 for identical models and without repeats."""
        return self.gain / self.error if self.error > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class Share:
    """Share of what a base model misses that a better one removes.

    Attributes:
        value: in [0, 1].
        interval95: from the scatter of trials, rows or levels; None where too few repeat.
    """

    value: float
    interval95: tuple[float, float] | None


def losses(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, *, held_out: bool
) -> dict[str, float]:
    """Mean square of each trial's residual over the noise variance: 1 is a perfect model's.

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


def perfect_losses(layout: TrialLayout, floor: NoiseFloor) -> dict[str, float]:
    """Loss of a perfect model on each held-out trial: the noise of its own protocol."""
    perfect: dict[str, float] = {}
    for trial in layout.trials(held_out=True):
        parts = [
            floor.variance_in(p.block.channel, p.block.protocol) / floor.sd[p.block.channel] ** 2
            for p in layout.places
            if p.block.trial == trial
        ]
        perfect[trial] = float(np.mean(parts))
    return perfect


def compare_models(
    before: Mapping[str, float], after: Mapping[str, float], layout: TrialLayout
) -> Improvement:
    """Whether one model predicts held-out trials better than another.

    The t test of `compare_trials` has few degrees of freedom where one protocol shows most of the
    gain. A gain in trial after trial is as unlikely without an effect: the signs of the trials'
    gains are flipped as well, and the smaller p-value counts twice. Signs are no evidence where few
    trials agree by chance, and of parts of one trial, which share what varies from trial to trial.

    Args:
        before: trial -> loss.
        after: trial -> loss.
        layout: of the trials.
    """
    protocol_of = layout.protocol_of
    found = compare_trials(before, after, protocol_of)
    if layout.origin or len(before) < _FEWEST_SIGNS:
        return found
    repeats = Counter(protocol_of[trial] for trial in before)
    gains = np.array([(before[t] - after[t]) / repeats[protocol_of[t]] for t in before])
    flipped = sign_flip_p_value(
        lambda signs: signs @ gains,
        gains.size,
        _FLIPS,
        np.random.default_rng(0),
        scale=float(np.mean(np.abs(gains))),
    )
    return replace(found, p_value=min(2.0 * min(found.p_value, flipped), 1.0))


def compare_trials(
    before: Mapping[str, float], after: Mapping[str, float], protocol_of: Mapping[str, str]
) -> Improvement:
    """Paired t test of two losses over the same trials, with protocols as strata.

    Protocols that show an effect scatter more than those that do not: the error has the degrees of
    freedom of the strata that it comes from, not of all.

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
    repeated = [np.array(values) for values in strata.values() if len(values) > 1]
    if not repeated:
        return Improvement(gain=gain, error=np.inf, degrees=0.0, p_value=1.0)
    # A protocol with a single trial is taken to scatter as the others do in the mean.
    alone = (count - len(repeated)) / len(repeated)
    variances = np.array([float(np.var(v, ddof=1)) * (1.0 / v.size + alone) for v in repeated])
    error = float(np.sqrt(np.sum(variances))) / count
    degrees = float(effective_degrees(variances, np.array([v.size - 1.0 for v in repeated])))
    if error == 0.0:
        return Improvement(gain=gain, error=0.0, degrees=degrees, p_value=float(gain <= 0.0))
    p_value = float(student.sf(gain / error, degrees))
    return Improvement(gain=gain, error=error, degrees=degrees, p_value=p_value)


def mean_over_trials(values: Mapping[str, float], protocol_of: Mapping[str, str]) -> Improvement:
    """Mean of what is known of each trial, with its error as in `compare_trials`.

    Args:
        values: trial -> value.
        protocol_of: trial -> protocol.
    """
    return compare_trials(values, dict.fromkeys(values, 0.0), protocol_of)


def share_of_trials(
    before: Mapping[str, float],
    after: Mapping[str, float],
    perfect: Mapping[str, float],
    protocol_of: Mapping[str, str],
) -> Share:
    """Share of the base model's excess over the noise that a model removes.

    Args:
        before: held-out trial -> loss of the base model.
        after: the same of the model.
        perfect: the same of a perfect model; the interval takes it as known.
        protocol_of: trial -> protocol.
    """
    return _share(
        {trial: loss - after[trial] for trial, loss in before.items()},
        {trial: loss - perfect[trial] for trial, loss in before.items()},
        protocol_of,
    )


def share_of_rows(before: FloatArray, after: FloatArray) -> Share:
    """Share of the base model's mean square at unseen rows or levels that a model removes.

    Args:
        before: (n,) errors of the base model.
        after: (n,) of the model.
    """
    rows = [str(row) for row in range(before.size)]
    removed = dict(zip(rows, (before**2 - after**2).tolist(), strict=True))
    missed = dict(zip(rows, (before**2).tolist(), strict=True))
    return _share(removed, missed, dict.fromkeys(rows, "rows"))


def _share(
    removed: Mapping[str, float], missed: Mapping[str, float], stratum_of: Mapping[str, str]
) -> Share:
    """Ratio of two means over the same units, with its interval by the delta method."""
    whole = mean_over_trials(missed, stratum_of).gain
    part = mean_over_trials(removed, stratum_of).gain
    if part <= 0.0:
        return Share(value=0.0, interval95=None)
    if whole <= 0.0:  # less than the noise floor is missed in all: what is removed is all of it
        return Share(value=1.0, interval95=None)
    ratio = part / whole
    scatter = {unit: (value - ratio * missed[unit]) / whole for unit, value in removed.items()}
    spread = mean_over_trials(scatter, stratum_of)
    value = min(ratio, 1.0)
    if not np.isfinite(spread.error):
        return Share(value=value, interval95=None)
    reach = float(student.ppf(0.975, spread.degrees)) * spread.error
    low, high = np.clip([ratio - reach, ratio + reach], 0.0, 1.0).tolist()
    return Share(value=value, interval95=(low, high))


def compare_rows(before: FloatArray, after: FloatArray, *, seed: int = 0) -> Improvement:
    """Paired sign-flip test of two models at rows that neither has seen.

    Where neither is better, each row's difference of squared errors may as well have the other
    sign: the p-value counts these, whatever the errors' distribution.

    Args:
        before: (n,) errors of the one [SI].
        after: (n,) of the other.
        seed: random seed of the sign flips.
    """
    # In the order of size, so that the order of a table's rows changes nothing.
    difference = before**2 - after**2
    difference = difference[np.lexsort((difference, np.abs(difference)))]
    count = difference.size
    error = float(np.std(difference, ddof=1)) / np.sqrt(count) if count > 1 else np.inf
    p_value = sign_flip_p_value(
        lambda signs: signs @ difference / count,
        count,
        _FLIPS,
        np.random.default_rng(seed),
        scale=float(np.mean(np.abs(difference))),
    )
    return Improvement(
        gain=float(np.mean(difference)), error=float(error), degrees=count - 1.0, p_value=p_value
    )
