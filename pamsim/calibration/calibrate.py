"""``pamsim calibrate``: parameters of a rig from recordings and static tables."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.calibration.calibrated_rig import calibrated_numbers, calibration_heading
from pamsim.calibration.calibration_problem import CalibrationProblem
from pamsim.calibration.report import CalibrationReport
from pamsim.comparison.compared_signal import Comparison
from pamsim.comparison.free_parameters import (
    FreedParameter,
    default_names,
    freed_parameters,
)
from pamsim.comparison.measurements import CalibrationData, hold_out, read_calibration_data
from pamsim.comparison.trial_prediction import AT_REST, CHANNELS, Prediction, check_channels
from pamsim.core.errors import InputError, nearest
from pamsim.core.progress import Progress
from pamsim.engine.rig import Rig, load_rig
from pamsim.inference.bounded_fit import calibrate as fit
from pamsim.inference.fit_result import Calibration
from pamsim.inference.fit_result import Progress as FitProgress
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.profile_likelihood import profile
from pamsim.store.checkpoint_file import CheckpointFile
from pamsim.store.rig_writer import write_rig

DEFAULT_RIG = "mas20_arm"
CHECKPOINT = "checkpoint.json"
RIG_FOLDER = "rig"

_ROUNDS = 4  # fits at the optimum at most
_STILL = 0.1  # standard errors
_COUNTS = ("evaluations", "calls", "iterations", "diverged")


def calibrate(
    sources: Sequence[str | os.PathLike[str]],
    *,
    rig: str | os.PathLike[str] | Rig | None = None,
    free: Sequence[str] = (),
    bounds: Mapping[str, str] | None = None,
    prior: bool = False,
    channels: Sequence[str] = CHANNELS,
    held_out: Sequence[str] = (),
    starts: int = 1,
    seed: int = 0,
    max_iterations: int = 100,
    profiles: Sequence[str] = (),
    out: Path | None = None,
    resume: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> CalibrationReport:
    """Fit parameters of a rig to measurements, all trials at once, each channel by its own noise.

    Args:
        sources: see `pamsim.comparison.measurements.read_calibration_data`.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out, or
            ``mas20_arm`` for static tables alone.
        free: parameters to fit, see `freed_parameters`; `default_names` if left out.
        bounds: name -> ``low:high``, see `freed_parameters`.
        prior: take the 95 % intervals of the rig's file as prior knowledge.
        channels: kinds of channel to compare.
        held_out: names of trials, protocols or tables that are kept from the fit.
        starts: of the search; more tell whether the optimum is the only one.
        seed: of the starts.
        max_iterations: steps tried per start.
        profiles: free parameters whose profile likelihood is wanted.
        out: folder for the calibrated rig and the checkpoint; None writes nothing.
        resume: go on from the checkpoint in ``out``.
        threads: simulations at a time; None for one per processor.
        progress: called with the number of simulations so far.

    Returns:
        The report; read its status before its numbers.

    Raises:
        InputError: for data that cannot be read, an unknown rig, parameter, channel or trial, a
            range that cannot be found, or a checkpoint of another calibration.
        ParameterError: for a range that is empty or leaves the present value out.
    """
    began = time.perf_counter()
    data = read_calibration_data(sources)
    fitted, held = hold_out(data, held_out)
    loaded = rig if isinstance(rig, Rig) else load_rig(rig or data.rig or DEFAULT_RIG)
    wanted = tuple(free) or default_names(loaded, moving=bool(fitted.trials))
    freed = freed_parameters(loaded, wanted, bounds=bounds, prior=prior)
    for name in profiles:
        if name not in (names := [f.name for f in freed]):
            raise InputError(f"--profile {name}: it is not free; {nearest(name, names)}")
    checkpoint = _checkpoint(out, resume)
    report = _Teller(progress)

    def problem(data: CalibrationData) -> CalibrationProblem:
        return CalibrationProblem(
            loaded,
            data,
            freed,
            channels=check_channels(channels),
            threads=threads,
            simulated=report.simulated,
        )

    compared, unseen = problem(fitted), problem(held)
    parameters = [f.free for f in freed]
    found = fit(
        compared,
        parameters,
        starts=starts,
        seed=seed,
        max_iterations=max_iterations,
        progress=report.reached,
        checkpoint=checkpoint,
        central=False,
        # Several starts are compared by their optima, which must be sharp for that.
        rough=starts == 1,
    )
    found = _at_the_optimum(compared, parameters, found, max_iterations, report)
    report.say("profiles" if profiles else "comparison")
    walked = tuple(profile(compared, parameters, found, name) for name in profiles)
    pair = np.array([[p.start for p in parameters], found.values])
    comparisons = [*_comparisons(compared, pair, False), *_comparisons(unseen, pair, True)]
    folder = None if out is None else out / RIG_FOLDER
    if folder is not None:
        write_rig(
            loaded.file,
            folder,
            calibrated_numbers(freed, found, data),
            heading=calibration_heading(data, found),
        )
    return CalibrationReport(
        rig=loaded.name,
        sources=data.sources,
        notes=(*data.notes, *_tie_notes(freed), *_start_notes(data)),
        freed=freed,
        calibration=found,
        profiles=walked,
        comparisons=tuple(comparisons),
        seed=seed,
        simulations=report.simulations,
        seconds=time.perf_counter() - began,
        folder=folder,
    )


def _at_the_optimum(
    problem: CalibrationProblem,
    parameters: Sequence[FreeParameter],
    found: Calibration,
    max_iterations: int,
    report: _Teller,
) -> Calibration:
    """Fit on with the trials' starts linearised where the fit ended, until that changes nothing.

    What a wrong start pressure does depends on the rig: far from the optimum it is taken for what
    the rig does, and the fit is biased by several of its standard errors.
    """
    for _ in range(_ROUNDS):
        if problem.predictor.starts_matter:
            problem.linearise_starts(found.values)
        begin = [replace(p, start=v) for p, v in zip(parameters, found.values, strict=True)]
        again = fit(problem, begin, max_iterations=max_iterations, progress=report.reached)
        error = np.sqrt(np.maximum(np.diag(again.covariance), 0.0))
        moved = np.abs(again.values - found.values)[error > 0.0] / error[error > 0.0]
        found = replace(
            again,
            starts=found.starts,
            **{count: getattr(found, count) + getattr(again, count) for count in _COUNTS},
        )
        if not problem.predictor.starts_matter or not np.any(moved > _STILL):
            break
    return found


class _Teller:
    """Counts simulations and tells how far a calibration is."""

    def __init__(self, tell: Progress | None) -> None:
        self._tell = tell
        self._what = "first simulations"
        self.simulations = 0

    def simulated(self, count: int) -> None:
        self.simulations += count
        self.say(self._what)

    def reached(self, now: FitProgress) -> None:
        self.say(
            f"start {now.start + 1}/{now.starts}, iteration {now.iteration},"
            f" mean square {now.cost:.4g}"
        )

    def say(self, what: str) -> None:
        self._what = what
        if self._tell is not None:
            self._tell(self.simulations, None, what)


def _checkpoint(out: Path | None, resume: bool) -> CheckpointFile | None:
    if out is None:
        if resume:
            raise InputError("--resume needs --out: the folder of the interrupted calibration")
        return None
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; name a folder to write into")
    checkpoint = CheckpointFile(out / CHECKPOINT)
    if not resume:
        checkpoint.clear()
    elif checkpoint.load() is None:
        raise InputError(f"nothing to resume: {out} has no {CHECKPOINT}; leave out --resume")
    return checkpoint


def _comparisons(
    problem: CalibrationProblem, pair: NDArray[np.float64], held: bool
) -> list[Comparison]:
    """Every channel of some measurements, simulated before and after."""
    before, after = problem.predictions(pair) if problem.predictor.experiments else (None, None)

    def signal(found: Prediction | None, trial: str, channel: str) -> NDArray[np.float64] | None:
        if found is None:
            return None
        return found.tables[trial] if channel == AT_REST else found.trials[trial][channel]

    places = [
        (trial.name, trial.protocol, channel, trial.time, trial.measured[channel], None)
        for trial in problem.data.trials
        for channel in problem.predictor.compared(trial)
    ]
    places += [
        (
            table.name,
            table.name,
            AT_REST,
            1.0 + np.arange(len(table.rows), dtype=np.float64),
            table.angle,
            table,
        )
        for table in problem.data.tables
    ]
    return [
        Comparison(
            trial=trial,
            protocol=protocol,
            channel=channel,
            held_out=held,
            time=at,
            measured=measured,
            before=signal(before, trial, channel),
            after=signal(after, trial, channel),
            table=table,
        )
        for trial, protocol, channel, at, measured, table in places
    ]


def _tie_notes(freed: Sequence[FreedParameter]) -> list[str]:
    return [
        f"{' and '.join(one.names)} are one number in this fit" for one in freed if one.names[1:]
    ]


def _start_notes(data: CalibrationData) -> list[str]:
    return [
        f"{table.name}: it does not say from which pressures its rows started; assumed: all muscles"
        " at the row's highest pressure, then the others vented"
        for table in data.tables
        if table.start is None
    ]
