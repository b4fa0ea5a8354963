"""``pamsim calibrate``: parameters of a rig from recordings and static tables."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pamsim.calibration.calibration_problem import CalibrationProblem, possible
from pamsim.calibration.first_values import first_values
from pamsim.calibration.result import Calibration, write_calibrated_rig
from pamsim.comparison.compared_signal import Comparison, comparisons_of
from pamsim.comparison.experiments import experiment_of
from pamsim.comparison.free_parameters import (
    Bounds,
    FreedParameter,
    default_names,
    first_names,
    freed_parameters,
)
from pamsim.comparison.likely_mistakes import likely_mistakes
from pamsim.comparison.measurements import read_calibration_data, split_held_out
from pamsim.comparison.trial_prediction import AT_REST, CHANNELS, TrialPredictor, check_channels
from pamsim.core.computation import Progress, one_blas_thread
from pamsim.core.encoding import CheckpointFile
from pamsim.core.errors import InputError, nearest
from pamsim.core.files import refuse_file
from pamsim.core.units import FloatArray
from pamsim.engine.parameters import each_muscle
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig, given_or_recorded
from pamsim.inference.fit_simulator import fit_simulator, shown
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.profile_likelihood import profile
from pamsim.inference.simulator_fit import SearchProgress, SimulatorFit

DEFAULT_RIG = "mas20_arm"
CHECKPOINT = "checkpoint.json"

_ROUNDS = 4  # fits at the optimum at most
_ITERATIONS = 5  # of a fit, as a rule; only the time left is estimated by it
_STILL = 0.1  # standard errors
_COUNTS = ("evaluations", "calls", "iterations", "diverged")


@one_blas_thread()
def calibrate(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    rig: str | os.PathLike[str] | Rig | None = None,
    free: Sequence[str] = (),
    first: bool = False,
    bounds: Mapping[str, Bounds] | None = None,
    prior: bool = False,
    channels: Sequence[str] = CHANNELS,
    hold_out: Sequence[str] = (),
    starts: int = 1,
    seed: int = 0,
    max_iterations: int = 100,
    profiles: Sequence[str] = (),
    out: Path | None = None,
    resume: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Fit parameters of a rig to measurements, all trials at once, each channel by its own noise.

    Args:
        sources: one or more, see `pamsim.comparison.measurements.read_calibration_data`.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out, or
            ``mas20_arm`` for static tables alone.
        free: parameters to fit, see `freed_parameters`; if left out, those of `default_names` that
            the data show.
        first: the rig's file may be far off: the fit begins at values that are found link by link
            (see `first_values`), and frees `first_names` if ``free`` is left out.
        bounds: name -> (low, high) [SI], such as ``{"joint.shaft.damping": (0.1, 2.0)}``.
        prior: take the 95 % intervals of the rig's file as prior knowledge.
        channels: kinds of channel to compare.
        hold_out: names of trials, protocols or tables that are kept from the fit.
        starts: of the search; more show whether the optimum is the only one.
        seed: of the starts.
        max_iterations: steps tried per start.
        profiles: free parameters whose profile likelihoods are computed.
        out: folder for the calibrated rig and the checkpoint; None writes nothing.
        resume: go on from the checkpoint in ``out``.
        threads: simulations at a time; None for one per processor.
        progress: called with the number of simulations so far and an estimate of all.

    Returns:
        The calibration; read its status before its numbers.

    Raises:
        InputError: for data that cannot be read, an unknown rig, parameter, channel or trial, a
            range that cannot be found, or a checkpoint of another calibration.
        ParameterError: for a range that is empty or leaves the present value out.
    """
    began = time.perf_counter()
    given = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    data = read_calibration_data(given)
    loaded = given_or_recorded(rig, data.rig or DEFAULT_RIG)
    data = data.of_rig(loaded)
    fitted, held_out = split_held_out(data, hold_out)
    if first and not fitted.trials:
        raise InputError("`first` needs recordings over time; there are only tables of angles")
    usual = first_names(loaded) if first else default_names(loaded, moving=bool(fitted.trials))
    freed = freed_parameters(loaded, tuple(free) or usual, bounds=bounds, prior=prior)
    names = [f.name for f in freed]
    for name in profiles:
        if name not in names:
            raise InputError(f"`profiles` {name}: it is not free; {nearest(name, names)}")
    check_channels(channels)
    checkpoint = _checkpoint(out, resume)
    counter = _Counter(progress)
    of = partial(
        TrialPredictor, loaded, channels=channels, threads=threads, simulated=counter.simulated
    )
    if first:
        freed = first_values(
            loaded,
            fitted.trials,
            freed,
            threads=threads,
            simulated=counter.simulated,
            stage=counter.report,
        )
    jacobian, not_shown = None, dict[str, None]()
    if first and not free:
        # Friction that comes out as none, as it was, would only make the fit less smooth.
        none = [f.name for f in freed if f.free.start == f.free.low == f.before.value]
        not_shown = dict.fromkeys(name for name in none if name not in profiles)
        freed = tuple(f for f in freed if f.name not in not_shown)
    compared = CalibrationProblem(of(fitted), freed)
    if not free:
        seen, jacobian = shown(compared, [f.free for f in freed])
        seen |= [f.name in profiles for f in freed]
        if seen.any() and not seen.all():
            jacobian = jacobian[:, seen]
            not_shown |= {f.name: None for f, yes in zip(freed, seen, strict=True) if not yes}
            freed = tuple(f for f in freed if f.name not in not_shown)
            compared = CalibrationProblem(of(fitted), freed)
    unseen = CalibrationProblem(of(held_out), freed)
    parameters = [f.free for f in freed]
    fit = fit_simulator(
        compared,
        parameters,
        starts=starts,
        seed=seed,
        max_iterations=max_iterations,
        jacobian=jacobian,
        progress=counter.reached,
        checkpoint=checkpoint,
        central=False,
        # Several starts are compared by their optima, which must be sharp for that.
        rough=starts == 1,
    )
    fit = _at_the_optimum(compared, parameters, fit, max_iterations, counter)
    counter.report("profiles" if profiles else "comparison")
    profiled = tuple(profile(compared, parameters, fit, name) for name in profiles)
    comparisons = [c for p in (compared, unseen) for c in _comparisons(p, fit.values, p is unseen)]
    folder = None if out is None else write_calibrated_rig(loaded, freed, fit, data.sources, out)
    return Calibration(
        rig=loaded,
        sources=data.sources,
        notes=(
            *likely_mistakes(loaded, data.trials, _at_the_start(comparisons), threads=threads),
            *above_supply(loaded.muscles, map(experiment_of, data.trials)),
            *data.notes,
            *(f"{name} stays as it is: these data do not show it" for name in not_shown),
            *(f"{' and '.join(f.names)} are one number in this fit" for f in freed if f.names[1:]),
            *(
                f"{name} differs from muscle to muscle; in this fit it is one number for all"
                for name in _differing(loaded, freed)
            ),
            *(
                f"{table.name}: the pressures from which its rows started are not given; assumed:"
                " all muscles at the row's highest pressure, then the others vented"
                for table in data.tables
                if table.start is None
            ),
        ),
        freed=freed,
        fit=fit,
        profiles=profiled,
        comparisons=tuple(comparisons),
        seed=seed,
        simulations=counter.simulations,
        seconds=time.perf_counter() - began,
        folder=folder,
    )


def _at_the_optimum(
    problem: CalibrationProblem,
    parameters: Sequence[FreeParameter],
    fit: SimulatorFit,
    max_iterations: int,
    counter: _Counter,
) -> SimulatorFit:
    """Fit on with the trials' starts linearised where the fit ended, until that changes nothing.

    What a wrong start pressure does depends on the rig: far from the optimum it is mistaken
    for what the rig does, and the fit is biased by several of its standard errors.
    """
    counter.polishing = True

    def onward(fit: SimulatorFit, *, rough: bool) -> SimulatorFit:
        again = fit_simulator(
            problem,
            [replace(p, start=v) for p, v in zip(parameters, fit.values, strict=True)],
            max_iterations=max_iterations,
            central=not rough,
            rough=rough,
            jacobian=fit.linearisation.jacobian,
            progress=counter.reached,
        )
        counts = {count: getattr(fit, count) + getattr(again, count) for count in _COUNTS}
        return replace(again, starts=fit.starts, **counts)

    for _ in range(_ROUNDS if problem.predictor.starts_matter else 0):
        problem.linearise_starts(fit.values)
        before, fit = fit.values, onward(fit, rough=True)
        error = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
        moved = np.abs(fit.values - before)[error > 0.0] / error[error > 0.0]
        if not np.any(moved > _STILL):
            break
    return onward(fit, rough=False)


class _Counter:
    """Counts simulations and reports how far a calibration is."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._what = "first simulations"
        self._iterations, self._total, self.polishing = 0, 0, False
        self.simulations = 0

    def simulated(self) -> None:
        self.simulations += 1
        self.report(self._what)

    def reached(self, now: SearchProgress) -> None:
        self._iterations += 1
        fits = now.starts - now.start - self.polishing  # a start of each, and one at the optimum
        ahead = max(_ITERATIONS - now.iteration, 1) + _ITERATIONS * fits
        self._total = round(self.simulations * (1.0 + ahead / self._iterations))
        self.report(
            f"start {now.start + 1}/{now.starts}, iteration {now.iteration},"
            f" mean square {now.cost:.4g}"
        )

    def report(self, what: str) -> None:
        self._what = what
        if self._progress is not None:
            total = max(self._total, self.simulations) if self._iterations else None
            self._progress(self.simulations, total, what)


def _checkpoint(out: Path | None, resume: bool) -> CheckpointFile | None:
    if out is None:
        if resume:
            raise InputError("`resume` needs `out`: the folder of the interrupted calibration")
        return None
    refuse_file(out)
    checkpoint = CheckpointFile(out / CHECKPOINT)
    if not resume:
        checkpoint.clear()
    elif checkpoint.load() is None:
        raise InputError(f"nothing to resume: {out} has no {CHECKPOINT}; leave out `resume`")
    return checkpoint


def _comparisons(problem: CalibrationProblem, values: FloatArray, held: bool) -> list[Comparison]:
    """Every channel of some measurements, simulated with the rig as it is and with a fit."""
    predictor = problem.predictor
    before = after = None
    if predictor.experiments:
        (after,) = problem.predictions(values)
        # Muscles may differ in a number that is freed: its value before is not that of each.
        (before,) = possible(predictor.predictions, [predictor.rig], begun=True)
    both = before, after
    found: list[Comparison] = []
    for trial in predictor.data.trials:
        ends = (None if p is None else p.trials[trial.name] for p in both)
        found += comparisons_of(trial, predictor.compared(trial), *ends, held_out=held)
    for table in predictor.data.tables:
        rows = [None if p is None else p.tables[table.name] for p in both]
        found.append(
            Comparison(
                trial=table.name,
                protocol=table.name,
                channel=AT_REST,
                held_out=held,
                time=1.0 + np.arange(len(table.rows), dtype=np.float64),
                measured=table.angle,
                before=rows[0],
                after=rows[1],
                table=table,
            )
        )
    return found


def _differing(rig: Rig, freed: Sequence[FreedParameter]) -> list[str]:
    """Freed parameters that name one number of all muscles, which differ in it."""
    values = {name: one.before.value for one in freed for name in one.names}
    return [name for name in values if name not in each_muscle(rig, values)]


def _at_the_start(comparisons: Sequence[Comparison]) -> dict[str, dict[str, FloatArray]]:
    """Trial -> channel -> simulated before the fit; without those where that broke down."""
    found: dict[str, dict[str, FloatArray]] = {}
    for one in comparisons:
        if one.table is None and one.before is not None:
            found.setdefault(one.trial, {})[one.channel] = one.before
    return found
