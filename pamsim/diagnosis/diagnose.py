"""``pamsim diagnose``: find where rig and recording disagree, name the missing effect, add it."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.comparison.measurements import CalibrationData, read_calibration_data
from pamsim.comparison.protocols import HELD_OUT_SUFFIX
from pamsim.comparison.trial_prediction import CHANNELS
from pamsim.comparison.trial_regressors import regressors
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.core.errors import InputError, nearest
from pamsim.core.progress import Progress
from pamsim.diagnosis.diagnosed_rig import DiagnosedRig
from pamsim.diagnosis.measured_pressures import given_pressures
from pamsim.diagnosis.method.procedure import Diagnosis
from pamsim.diagnosis.method.procedure import diagnose as find
from pamsim.diagnosis.method.where import Cell
from pamsim.diagnosis.remembered_fits import RememberedFits
from pamsim.engine.rig import Rig, load_rig

ORDINARY = ("force.scale", "passive.locking", "chamber.dead_volume")
"""Numbers of every rig that are known to a few per cent only: they are refitted with every effect,
so that none is named for what they can do."""


@dataclass(frozen=True, kw_only=True)
class DiagnosisReport:
    """A diagnosis with what it was made from.

    Attributes:
        rig: without effects.
        data: the measurements.
        held_out: names of the trials judged by.
        found: the diagnosis.
        given: excess of angle and forces when the arm is driven by the measured pressures.
        predictions_before: trial -> channel -> (n,) simulated by the refitted base model [SI].
        predictions_after: the same with the effects of the best model; empty without one.
        skipped: effect -> why it could not be tried.
        notes: what a reader should know, one sentence each.
        seed: of the maps' sign flips.
        rollouts: simulations that it took.
        seconds: it took.
    """

    rig: Rig
    data: CalibrationData
    held_out: tuple[str, ...]
    found: Diagnosis
    given: tuple[Cell, ...]
    predictions_before: Mapping[str, Mapping[str, NDArray[np.float64]]]
    predictions_after: Mapping[str, Mapping[str, NDArray[np.float64]]]
    skipped: dict[str, str]
    notes: tuple[str, ...]
    seed: int
    rollouts: int
    seconds: float


def diagnose(
    sources: Sequence[str | os.PathLike[str]],
    *,
    rig: str | os.PathLike[str] | Rig | None = None,
    effects: Sequence[str] = (),
    ordinary: Sequence[str] = ORDINARY,
    channels: Sequence[str] = CHANNELS,
    held_out: Sequence[str] = (),
    seed: int = 0,
    threads: int | None = None,
    out: Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> DiagnosisReport:
    """Diagnose a rig by recordings of it.

    Args:
        sources: recording folders.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out.
        effects: names of those that may be missing; all if left out.
        ordinary: rig parameters that are refitted with every effect.
        channels: kinds of channel to compare.
        held_out: trials or protocols to judge by; if left out, protocols whose name ends in
            ``_check``, or else every second repeat.
        seed: of the maps' sign flips.
        threads: simulations at a time; None for one per processor.
        out: folder in which fits that are done are kept; None keeps none.
        resume: go on with the fits in ``out``.
        progress: called with the number of parameter sets simulated so far.

    Raises:
        InputError: for what cannot be read or used, see `find`.
    """
    began = time.perf_counter()
    data = read_calibration_data(sources)
    if not data.trials:
        raise InputError("diagnose needs recordings over time; angles at rest alone have none")
    loaded = rig if isinstance(rig, Rig) else load_rig(rig or data.rig or "mas20_arm")
    names, notes = _held_out(data, held_out)
    freed = [f.free for f in freed_parameters(loaded, ordinary)]
    tried, skipped = candidates(loaded, effects)
    refitted = {p.name for p in freed}
    for one in tried:
        taken = sorted(refitted & {p.name for p in one.parameters})
        if taken:
            skipped[one.name] = f"{', '.join(taken)} is refitted with every effect (--ordinary)"
    engine = DiagnosedRig(loaded, data, names, channels=channels, threads=threads)
    simulator = TrialSimulator(engine.residuals, frozenset(names))
    fits = None
    if out is not None:
        of = [_fingerprint(data), loaded.name, names, [p.name for p in freed], list(channels)]
        fits = RememberedFits(out, of, resume=resume)

    def told(what: str) -> None:
        if progress is not None:
            progress(simulator.evaluations, None, what)

    found = find(
        simulator,
        freed,
        [c for c in tried if c.name not in skipped],
        {trial.name: regressors(trial) for trial in data.trials},
        menu=engine.menu,
        seed=seed,
        remembered=fits,
        told=told,
    )
    best = found.named.best
    return DiagnosisReport(
        rig=loaded,
        data=data,
        held_out=names,
        found=found,
        given=given_pressures(
            loaded.with_parameters(found.base.values), data, found.floor, threads=threads
        ),
        predictions_before=engine.signals(found.base.values),
        predictions_after={} if best is None else engine.signals(best.fit.values),
        skipped=skipped,
        notes=(*data.notes, *notes),
        seed=seed,
        rollouts=engine.rollouts,
        seconds=time.perf_counter() - began,
    )


def _fingerprint(data: CalibrationData) -> str:
    """What tells recordings apart."""
    digest = hashlib.sha256()
    for trial in data.trials:
        digest.update(trial.name.encode())
        for values in (trial.time, trial.command, *trial.measured.values()):
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _held_out(
    data: CalibrationData, wanted: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the trials to judge by, and what to say of the choice."""
    if wanted:
        known = {t.name for t in data.trials} | {t.protocol for t in data.trials}
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"--hold-out {name}: no trial of that name; {nearest(name, known)}"
                )
        return tuple(t.name for t in data.trials if {t.name, t.protocol} & set(wanted)), ()
    check = tuple(t.name for t in data.trials if t.protocol.endswith(HELD_OUT_SUFFIX))
    if check:
        return check, ()
    seen: dict[str, int] = {}
    chosen: list[str] = []
    for trial in data.trials:
        seen[trial.protocol] = seen.get(trial.protocol, 0) + 1
        if seen[trial.protocol] % 2 == 0:
            chosen.append(trial.name)
    return tuple(chosen), (
        "no protocol is kept for judging (a name ending in _check, or --hold-out); every second"
        " repeat is, which does not tell what holds for other inputs",
    )
