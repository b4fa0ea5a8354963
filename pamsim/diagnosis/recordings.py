"""Diagnose a rig by recordings of it over time."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pamsim.comparison.experiments import experiment_of
from pamsim.comparison.likely_mistakes import likely_mistakes
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.noise_within_trial import LAG, FloorRoute
from pamsim.comparison.trial_prediction import CHANNELS
from pamsim.comparison.trial_regressors import regressors
from pamsim.core.computation import Progress, versions
from pamsim.diagnosis.compared_recordings import about_the_drive, compared
from pamsim.diagnosis.measured_pressures import cells_with_measured_pressures
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.diagnosis.method.where import Regressors
from pamsim.diagnosis.recordings_result import result_of
from pamsim.diagnosis.remembered_fits import RememberedFits
from pamsim.diagnosis.result import Diagnosis
from pamsim.engine.preflight import above_supply
from pamsim.engine.rig import Rig, rig_digest

NUISANCE = ("force.scale", "passive.locking", "chamber.dead_volume")
"""Numbers of every rig that are known to a few per cent only: they are refitted with every effect,
so that none is named for what they can do."""


def diagnose_recordings(
    data: CalibrationData,
    rig: Rig,
    *,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    nuisance: Sequence[str] = NUISANCE,
    channels: Sequence[str] = CHANNELS,
    hold_out: Sequence[str] = (),
    seed: int = 0,
    threads: int | None = None,
    out: Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose a rig by recordings of it; see `pamsim.diagnosis.diagnose.diagnose`.

    Args:
        data: the recordings.
        rig: without effects.
        effects: names of those that may be missing; all if left out.
        without: names of those that are not tried.
        nuisance: rig parameters that are refitted with every effect.
        channels: kinds of channel to compare.
        hold_out: trials or protocols to judge by; see `held_out_split`.
        seed: random seed of the sign flips.
        threads: simulations at a time; None for one per processor.
        out: folder in which finished fits are kept; None keeps none.
        resume: go on with the fits in ``out``.
        progress: called as each model is fitted; how many there will be is an upper estimate.

    Raises:
        InputError: for what cannot be used, or if the simulation breaks down.
    """
    began = time.perf_counter()
    comparison = compared(data, rig, effects, without, nuisance, channels, hold_out, threads)
    data, split, parts = comparison.data, comparison.split, comparison.split.parts
    engine, simulator = comparison.engine, comparison.simulator
    fits = None
    if out is not None:
        free = [p.name for p in comparison.nuisance]
        of = [_fingerprint(data), rig_digest(rig), versions()]
        settings = [*of, split.names, free, list(channels)]
        fits = RememberedFits(out, settings, resume=resume)

    def quantities(values: Mapping[str, float]) -> Regressors:
        simulated = engine.signals(values)
        known = [trial for trial in data.trials if trial.name in simulated]
        whole = {trial.name: regressors(trial, simulated[trial.name]) for trial in known}
        return whole if parts is None else parts.signals(whole)

    method = diagnose_trials(
        simulator,
        comparison.nuisance,
        comparison.tried,
        quantities,
        commands={trial.name: trial.command for trial in data.trials},
        menu=engine.menu,
        seed=seed,
        remembered=fits,
        progress=progress,
    )
    best = method.conclusion.best
    before = engine.signals(method.base.values)
    after = {} if best is None else engine.signals(best.fit.values)
    as_it_is = engine.signals({p.name: p.start for p in comparison.nuisance})
    given = cells_with_measured_pressures(
        rig.with_parameters(method.base.values), data, method.floor, threads=threads
    )
    return result_of(
        rig,
        data,
        method,
        split=split,
        given=given,
        before=before,
        after=after,
        skipped=comparison.skipped,
        warnings=(
            *likely_mistakes(rig, data.trials, as_it_is, threads=threads),
            *data.notes,
            *split.warnings,
            *about_the_drive(data),
            *above_supply(rig.muscles, map(experiment_of, data.trials)),
            *_about_the_floor(method.floor),
        ),
        seed=seed,
        rollouts=engine.rollouts,
        seconds=time.perf_counter() - began,
    )


def _about_the_floor(floor: NoiseFloor) -> tuple[str, ...]:
    """How noise was estimated without repeats."""
    how = {
        FloorRoute.PERIODS: "what the periods of the command differ by",
        FloorRoute.HOLDS: f"what changes within {LAG:g} s while the command is held",
        FloorRoute.WITHIN_TRIALS: "what changes from sample to sample",
    }
    routes = [r for r in how if r in floor.routes.values()]
    if not routes:
        return ()
    every = "each input" if FloorRoute.REPEATS not in floor.routes.values() else "some input"
    return (
        f"{every} was recorded once: its noise is estimated from"
        f" {' or '.join(how[r] for r in routes)}; what only repeats show is unknown",
    )


def _fingerprint(data: CalibrationData) -> str:
    """Identifies the recordings."""
    digest = hashlib.sha256()
    for trial in data.trials:
        digest.update(f"{trial.name} {trial.drives}".encode())
        lead = trial.lead_in
        before = () if lead is None else (lead.time, lead.command, lead.start_pressure)
        for values in (*before, trial.time, trial.command, *trial.measured.values()):
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
