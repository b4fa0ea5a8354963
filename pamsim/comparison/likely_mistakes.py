"""Mistakes in units, signs and columns of recordings, found by simulating recordings without them.

Where a rig's simulation misses a recording by a large part of what it moves, the recording is
simulated again as it would be without each mistake that people make. A correction that leaves
little of what was missed is likely. A rig whose numbers are merely not calibrated is helped by
none: mistakes change a quantity several times over, or turn it round.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.comparison.sensed_runs import as_read, sensed_runs
from pamsim.comparison.trial_corrections import Correction, corrections
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.rig import Rig
from pamsim.engine.simulate import whole_steps
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.recording import Outcome
from pamsim.recordings.signals import JOINT_KINDS, kind_of
from pamsim.recordings.trial import Trial

Signals = Mapping[str, FloatArray]
"""Channel -> (n,) [SI]."""
Shares = Mapping[str, float]
"""Channel -> mean square that the simulation misses, as a share of the variance of both."""

_MISSED = 0.1
"""Share from which a channel is missed: an uncalibrated rig misses as much, and is then tried."""

_LEFT, _GAIN = 0.35, 0.15
"""Part of the changed channels' shares that a correction may leave, and how much it must remove."""

_LIKE = (0.05, 1.5)
"""Sum of shares, and times the best sum, up to which a correction is as likely as the best."""

_ALL = 4.0  # highest share; that of a simulation that breaks down
_CHANGED = 0.02  # by which a share must differ to be one of the correction's
_TRIALS, _SECONDS, _FEWEST = 2, 5.0, 8  # simulated with each correction
_ABOVE = 1.1  # of the supply, which readings and a rig's file may be off by
_STILL = 1e-4  # of the mean square, so that a signal that stands still has no share by rounding


def likely_mistakes(
    rig: Rig,
    trials: Sequence[Trial],
    simulated: Mapping[str, Signals],
    *,
    threads: int | None = None,
) -> tuple[str, ...]:
    """Mistakes that recordings seem to have.

    Takes no time where the simulation is roughly right, otherwise that of tens of short ones.

    Args:
        rig: as it is.
        trials: as the rig names their signals.
        simulated: trial -> its simulation; trials that are not there broke down.
        threads: simulations at a time; None for one per processor.

    Returns:
        A sentence, if there are any: what the numbers of which columns look like, what to do, and
        in which trials; several corrections that do as well are joined by "or".
    """
    shares = {t.name: _shares([t], [simulated.get(t.name)]) for t in trials}
    missed = {n: {c for c, share in of.items() if share > _MISSED} for n, of in shares.items()}
    if not any(missed.values()):
        return ()
    worst = max(trials, key=lambda t: sum(shares[t.name].values()))
    similar = [t for t in trials if missed[t.name] == missed[worst.name]]
    chosen = _one_of_each([worst, *similar])
    rows = [_rows(t, simulated.get(t.name)) for t in chosen]
    tried = [
        _tried(correction, chosen, rows) for correction in corrections(worst, missed[worst.name])
    ]
    found = sorted(_helpful(rig, tried, threads), key=lambda one: one.left)
    if not found:
        return ()
    best = found[0]
    texts = [one.correction.text for one in found if one.left <= _LIKE[0] + _LIKE[1] * best.left]
    wrong = [t.name for t in trials if missed[t.name]]
    where = "all trials" if len(wrong) == len(trials) else ", ".join(wrong[:3])
    more = f" and {len(wrong) - 3} more" if 3 < len(wrong) < len(trials) else ""
    return (
        f"{', or '.join(texts)}; the simulation then misses {_percent(best.after)} instead of"
        f" {_percent(best.before)} of what these signals move, in {where}{more}",
    )


@dataclass(frozen=True)
class _Tried:
    """A correction, and the same beginnings of trials before and after it."""

    correction: Correction
    before: list[Trial]
    after: list[Trial]


@dataclass(frozen=True)
class _Helpful:
    """A correction that helps: shares of the channels it changes, and the sum left of all."""

    correction: Correction
    before: list[float]
    after: list[float]
    left: float


def _one_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """One trial of every input, of the first inputs."""
    first: dict[tuple[str, float], Trial] = {}
    for trial in trials:
        first.setdefault((trial.protocol, trial.load), trial)
    return list(first.values())[:_TRIALS]


def _rows(trial: Trial, simulated: Signals | None) -> int:
    """Rows by which half of what is missed has been missed: a log may begin with a long rest."""
    if simulated is None:
        return _FEWEST
    missed = np.zeros(trial.time.size)
    for channel in trial.measured.keys() & simulated.keys():
        square = (simulated[channel] - trial.measured[channel]) ** 2
        missed += square / max(float(square.sum()), np.finfo(float).tiny)
    return int(np.searchsorted(np.cumsum(missed), 0.5 * missed.sum()))


def _tried(correction: Correction, trials: Sequence[Trial], rows: Sequence[int]) -> _Tried:
    after = [correction.applied(trial) for trial in trials]
    counts = [
        max(int(np.searchsorted(trial.time, _SECONDS, side="right")), least, _FEWEST)
        for trial, least in zip(after, rows, strict=True)
    ]
    return _Tried(
        correction,
        [_first(trial, count) for trial, count in zip(trials, counts, strict=True)],
        [_first(trial, count) for trial, count in zip(after, counts, strict=True)],
    )


def _first(trial: Trial, count: int) -> Trial:
    return replace(
        trial,
        time=trial.time[:count],
        command=trial.command[:count],
        measured={channel: values[:count] for channel, values in trial.measured.items()},
    )


def _helpful(rig: Rig, tried: Sequence[_Tried], threads: int | None) -> Iterator[_Helpful]:
    """Corrections that leave little of what the channels that they change are missed by."""
    possible: list[tuple[_Tried, list[Experiment], list[Experiment]]] = []
    for one in tried:
        try:
            before = [as_read(rig, experiment_of(t)) for t in one.before]
            after = [as_read(rig, experiment_of(t)) for t in one.after]
            for experiment in (*before, *after):
                whole_steps(1.0 / experiment.sample_rate, rig.model.opt.timestep)
        except InputError:  # such as a set point below the atmosphere, or a clock between steps
            continue
        if all(_within_supply(rig, experiment) for experiment in after):
            possible.append((one, before, after))
    jobs = [(rig, e) for _, before, after in possible for e in (*before, *after)]
    runs = iter(sensed_runs(jobs, threads=threads))
    for one, *_ in possible:
        shares: list[Shares] = []
        for trials in (one.before, one.after):
            of_each = [(trial, next(runs)) for trial in trials]
            done = [
                at_times(run, trial, rig.sensor) if run.outcome is Outcome.COMPLETED else None
                for trial, run in of_each
            ]
            shares.append(_shares(trials, done))
        before, after = shares
        changed = [c for c in before if abs(before[c] - after[c]) > _CHANGED]
        lost, left = sum(before[c] for c in changed), sum(after[c] for c in changed)
        if left <= _LEFT * lost and lost - left >= _GAIN:
            yield _Helpful(
                one.correction,
                [before[c] for c in changed],
                [after[c] for c in changed],
                sum(after.values()),
            )


def _within_supply(rig: Rig, experiment: Experiment) -> bool:
    """Whether the supply can give the pressures of an experiment."""
    kinds = np.array(experiment.drives.kinds)
    pressures = experiment.command_value[:, np.isin(kinds, ("pressure_set", "measured"))]
    highest = max(float(pressures.max(initial=0.0)), float(experiment.start_pressure.max()))
    return highest <= _ABOVE * max(m.valve.supply_pressure for m in rig.muscles.values())


def _shares(trials: Sequence[Trial], simulated: Sequence[Signals | None]) -> Shares:
    """What is missed of each channel in trials together.

    In units of the variance of its kind, so that a muscle or joint that hardly moves beside others
    does not count. Joints are compared without their mean, which an encoder's zero decides.
    """
    missed: dict[str, list[float]] = {}
    moved: dict[str, list[float]] = {}
    broken = any(signals is None for signals in simulated)
    for trial, signals in zip(trials, simulated, strict=True):
        for channel, read in trial.measured.items():
            expected = read if signals is None else signals.get(channel)
            if expected is None:
                continue
            kind, away = kind_of(channel), expected - read
            if kind in JOINT_KINDS:
                away = away - away.mean()
            missed.setdefault(channel, []).append(float(np.mean(away**2)))
            both = np.var(read) + np.var(expected)
            still = _STILL * np.mean(read**2 + expected**2)
            moved.setdefault(kind, []).append(float(both + still))
    return {
        channel: _ALL
        if broken
        else min(float(np.mean(squares) / max(np.mean(moved[kind_of(channel)]), 1e-300)), _ALL)
        for channel, squares in missed.items()
    }


def _percent(shares: Sequence[float]) -> str:
    """Root mean square of shares."""
    return f"{100.0 * float(np.sqrt(np.mean(shares))):.0f} %"
