"""Mistakes in units, signs and columns of recordings, found by simulating recordings without them.

Where a rig's simulation misses a recording by a large part of what it moves, the recording is
simulated again as it would be without each mistake that people make. A correction that leaves
little of what was missed is likely, unless the rig with other numbers of its own leaves as little
of the recording as it stands. Most rigs are described before they are measured: lengths, stiffness
and friction are off by tens of per cent, valves and volumes by more. What such numbers explain is
no mistake of a recording.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize

from pamsim.comparison.experiments import as_read, experiment_of, sensed_signals
from pamsim.comparison.trial_corrections import Correction, corrections
from pamsim.core.errors import InputError, PamsimError, first_few
from pamsim.core.units import FloatArray
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.signals import JOINT_KINDS, kind_of
from pamsim.recordings.trial import Trial

Signals = Mapping[str, FloatArray]
"""Channel -> (n,) [SI]."""
Shares = Mapping[str, float]
"""Channel -> mean square that the simulation misses, as a share of the variance of both."""

_MISSED = 0.1
"""Share from which a channel is missed: an uncalibrated rig misses as much, and is then tried."""

_LEFT, _GAIN = 0.5, 0.15
"""Part of the changed channels' shares that a correction may leave, and how much it must remove, to
be worth a fit of the rig's numbers, which decides."""

_LIKE = (0.05, 1.5)
"""Sum of shares, and times the best sum, up to which a correction is as likely as the best."""

_WORSE = 1.5
"""Times what is left with a correction that a recording must be missed by as it stands, both with
the rig's numbers that suit best: below 0.3 where only these were off, above 1.7 where a mistake was
made, in 40 recordings of ten rigs."""

_ALL = 4.0  # highest share; that of a simulation that breaks down
_CHANGED = 0.02  # by which a share must differ to be one of the correction's
_TRIALS, _SECONDS, _FEWEST = 2, 5.0, 8  # simulated with each correction
_ABOVE = 1.1  # of the supply, which readings and a rig's file may be off by
_STILL = 1e-4  # of the mean square, so that a signal that stands still has no share by rounding

# scipy carries no types: what it returns is Any at this file's boundary.
_least_squares: Any = scipy.optimize.least_squares

_FACTORS = {
    "force.scale": 2.0,
    "force.area": 2.0,
    "force.stiffness": 2.0,
    "passive.stiffness": 2.0,
    "chamber.dead_volume": 5.0,
    "valve.conductance_fill": 5.0,
    "valve.conductance_exhaust": 5.0,
}
"""Number of all muscles -> factor by which it may be off: twice where a data sheet or a scale
states it, five times where only a test would."""

_DAMPING = 5.0  # of a joint, likewise
_LENGTH = 0.05  # share of a muscle's nominal length by which its mounting may be off
_STEP, _TRIES = 0.02, 6  # of each range; more tries gain little that would decide
_BROKEN = 10.0  # times what the rig as described misses


def likely_mistakes(
    rig: Rig,
    trials: Sequence[Trial],
    simulated: Mapping[str, Signals],
    *,
    threads: int | None = None,
) -> tuple[str, ...]:
    """Mistakes that recordings, as the rig names their signals, seem to have.

    What is ``simulated`` are trials with the rig as it is; those that are not there broke down.
    Takes no time where the simulation is roughly right, otherwise that of tens of short ones, and
    where a correction helps, of a hundred.

    Returns:
        A sentence, if there are any: what the numbers of which columns look like, what to do, and
        in which trials; several corrections that do as well are joined by "or".
    """
    shares = {t.name: _shares([t], [simulated.get(t.name)]) for t in trials}
    moving = {c for t in trials for c, read in t.measured.items() if np.ptp(read) > 0.0}
    missed = {
        name: {c for c, share in of.items() if share > _MISSED and c in moving}
        for name, of in shares.items()
    }
    if not any(missed.values()):
        return ()
    worst = max(trials, key=lambda t: sum(shares[t.name].values()))
    similar = [t for t in trials if missed[t.name] == missed[worst.name]]
    first: dict[tuple[str, float], Trial] = {}  # trial of every input
    for trial in (worst, *similar):
        first.setdefault((trial.protocol, trial.load), trial)
    chosen = list(first.values())[:_TRIALS]
    rows = [_rows(t, simulated.get(t.name)) for t in chosen]
    tried = corrections(worst, missed[worst.name])
    found = sorted(_helpful(rig, tried, chosen, rows, threads), key=lambda one: one.left)
    if not found:
        return ()
    best = found[0]
    as_it_stands = least_missed(rig, lambda one: _missed_by(one, best.trials[0], threads))
    if as_it_stands <= _WORSE * best.left:  # before the rig's numbers are fitted to it as well
        corrected = least_missed(rig, lambda one: _missed_by(one, best.trials[1], threads))
        if as_it_stands <= _WORSE * corrected:
            return ()
    likely = [one for one in found if one.left <= _LIKE[0] + _LIKE[1] * best.left]
    texts = [one.correction.text for one in likely]
    wrong = [t.name for t in trials if missed[t.name]]
    where = "all trials" if len(wrong) == len(trials) else first_few(wrong, 3)
    return (
        f"{', or '.join(texts)}; the simulation then misses {_percent(best.after)} instead of"
        f" {_percent(best.before)} of these signals' variation, in {where}",
    )


class _Helpful(NamedTuple):
    """A correction that helps."""

    correction: Correction
    trials: tuple[list[Trial], list[Trial]]  # the same beginnings before and after it
    before: list[float]  # shares of the channels that it changes
    after: list[float]
    left: float  # sum of the shares of all channels


def _rows(trial: Trial, simulated: Signals | None) -> int:
    """Rows by which half of what is missed has been missed: a log may begin with a long rest."""
    if simulated is None:
        return _FEWEST
    missed = np.zeros(trial.time.size)
    for channel in filter(simulated.__contains__, trial.measured):
        square = (simulated[channel] - trial.measured[channel]) ** 2
        missed += square / max(float(square.sum()), np.finfo(float).tiny)
    return int(np.searchsorted(np.cumsum(missed), 0.5 * missed.sum()))


def _helpful(
    rig: Rig,
    tried: Iterable[Correction],
    trials: Sequence[Trial],
    rows: Sequence[int],
    threads: int | None,
) -> Iterator[_Helpful]:
    """Corrections that leave little of what the channels that they change are missed by."""
    possible: list[tuple[Correction, list[Trial], list[Trial]]] = []
    jobs: list[tuple[Rig, Trial, Experiment]] = []
    for correction in tried:
        whole = [correction.applied(trial) for trial in trials]
        counts = [
            max(int(np.searchsorted(trial.time, _SECONDS, side="right")), least, _FEWEST)
            for trial, least in zip(whole, rows, strict=True)
        ]
        before, after = (
            [trial.rows(slice(count)) for trial, count in zip(own, counts, strict=True)]
            for own in (trials, whole)
        )
        try:
            given, corrected = _jobs(rig, before), _jobs(rig, after)
        except InputError:  # such as a set point below the atmosphere
            continue
        if all(_within_supply(rig, experiment) for *_, experiment in corrected):
            possible.append((correction, before, after))
            jobs += [*given, *corrected]
    signals = iter(sensed_signals(jobs, threads=threads))
    for correction, *both in possible:
        before, after = (_shares(own, [next(signals) for _ in own]) for own in both)
        # A reading that drives nothing is judged by itself: other channels may be off anyway.
        own = correction.reads(both[0][0]) or before
        changed = [c for c in own if abs(before[c] - after[c]) > _CHANGED]
        lost, left = sum(before[c] for c in changed), sum(after[c] for c in changed)
        if left <= _LEFT * lost and lost - left >= _GAIN:
            shares = [before[c] for c in changed], [after[c] for c in changed]
            yield _Helpful(correction, (both[0], both[1]), *shares, sum(after.values()))


def _jobs(rig: Rig, trials: Sequence[Trial]) -> list[tuple[Rig, Trial, Experiment]]:
    return [(rig, trial, as_read(rig, experiment_of(trial))) for trial in trials]


def _within_supply(rig: Rig, experiment: Experiment) -> bool:
    """Whether the supply can give the pressures of an experiment."""
    kinds = np.array(experiment.drives.kinds)
    pressures = experiment.command_value[:, np.isin(kinds, ("pressure_set", "measured"))]
    highest = max(float(pressures.max(initial=0.0)), float(experiment.start_pressure.max()))
    return highest <= _ABOVE * max(m.valve.supply_pressure for m in rig.muscles.values())


def _missed_by(rig: Rig, trials: Sequence[Trial], threads: int | None) -> FloatArray | None:
    """What a rig misses of trials, (n,), so that its squares add up to the shares of all channels.

    None if a simulation breaks down.
    """
    signals = sensed_signals(_jobs(rig, trials), threads=threads)
    done = [one for one in signals if one is not None]
    if len(done) < len(trials):
        return None
    away, moved = _away(trials, done)
    return np.concatenate(
        [
            part / np.sqrt(part.size * len(parts) * moved[kind_of(channel)])
            for channel, parts in away.items()
            for part in parts
        ]
    )


def _shares(trials: Sequence[Trial], simulated: Sequence[Signals | None]) -> Shares:
    """What is missed of each channel in trials together, `_ALL` if a simulation broke down."""
    done = [signals for signals in simulated if signals is not None]
    if len(done) < len(trials):
        return {channel: _ALL for trial in trials for channel in trial.measured}
    away, moved = _away(trials, done)
    return {
        channel: min(
            float(np.mean([np.mean(part**2) for part in parts])) / moved[kind_of(channel)], _ALL
        )
        for channel, parts in away.items()
    }


def _away(
    trials: Sequence[Trial], simulated: Sequence[Signals]
) -> tuple[dict[str, list[FloatArray]], dict[str, float]]:
    """Channel -> simulated minus read in each trial, and kind of channel -> variance of both.

    One variance for all of a kind, so that a muscle or joint that hardly moves beside others does
    not count. Joints are compared without their mean, which an encoder's zero decides.
    """
    away: dict[str, list[FloatArray]] = {}
    moved: dict[str, list[float]] = {}
    for trial, signals in zip(trials, simulated, strict=True):
        for channel, read in trial.measured.items():
            if channel not in signals:
                continue
            expected, kind = signals[channel], kind_of(channel)
            one = expected - read
            away.setdefault(channel, []).append(one - one.mean() if kind in JOINT_KINDS else one)
            still = _STILL * np.mean(read**2 + expected**2)
            moved.setdefault(kind, []).append(float(np.var(read) + np.var(expected) + still))
    return away, {kind: max(float(np.mean(of)), 1e-300) for kind, of in moved.items()}


def _percent(shares: Sequence[float]) -> str:
    """Root mean square of shares."""
    return f"{100.0 * float(np.sqrt(np.mean(shares))):.0f} %"


def least_missed(rig: Rig, missed: Callable[[Rig], FloatArray | None]) -> float:
    """Sum of squares of what a rig misses with the numbers that make it least.

    ``missed`` is what a rig misses (n,), None where it breaks down; infinite if it does as
    described.
    """
    first, numbers = missed(rig), list(_numbers(rig))
    if first is None:
        return np.inf

    def residual(place: FloatArray) -> FloatArray:
        values: dict[str, float] = {}
        for (names, end), at in zip(numbers, place - 1.0, strict=True):
            values |= {name: end(value, float(at)) for name, value in names.items()}
        try:
            found = missed(rig.with_parameters(values))
        except PamsimError:  # such as a muscle longer than its fibres
            found = None
        return _BROKEN * first if found is None else found

    # The rig as described is at 1, because scipy's steps are shares of the place.
    start = np.ones(len(numbers))
    best = _least_squares(
        residual, start, bounds=(start - 1.0, start + 1.0), diff_step=_STEP, max_nfev=_TRIES
    )
    return min(2.0 * float(best.cost), float(first @ first))


def _numbers(
    rig: Rig,
) -> Iterator[tuple[dict[str, float], Callable[[float, float], float]]]:
    """Parameters that change together with their values; value, place in [-1, 1] -> new value."""
    groups = [([f"{m}:{name}" for m in rig.muscles], most) for name, most in _FACTORS.items()]
    groups += [([f"joint.{joint}.damping"], _DAMPING) for joint in rig.joints]
    for names, most in groups:
        values: dict[str, float] = {}
        for name in names:
            with contextlib.suppress(PamsimError):  # the rig has none
                values[name] = rig_parameter(rig, name).value
        if any(values.values()):
            yield values, lambda value, place, most=most: value * most**place
    for muscle, one in rig.muscles.items():
        reach = _LENGTH * (one.stroke or one.braided).nominal_length
        length = {f"{muscle}:mounting.length_at_zero": one.mounting.length_at_zero}
        yield length, lambda value, place, reach=reach: value + reach * place
