"""``pamsim diagnose``: find where rig and recording disagree, name the missing effect, add it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pamsim.core.errors import InputError, ParameterError, nearest
from pamsim.diagnosis.diagnose import Diagnosis
from pamsim.diagnosis.diagnose import diagnose as find
from pamsim.diagnosis.trial_residuals import TrialSimulator, Values
from pamsim.engine.rig import Rig, load_rig
from pamsim.sysid.residual_block import Blocks
from pamsim.workflows.calibration_data import CalibrationData, read_calibration_data
from pamsim.workflows.calibration_parameters import freed_parameters
from pamsim.workflows.effect_candidates import candidates
from pamsim.workflows.trial_prediction import CHANNELS, TrialPredictor, check_channels
from pamsim.workflows.trial_regressors import regressors
from pamsim.workflows.twin_data import CHECK

ORDINARY = ("force.scale", "passive.locking", "chamber.dead_volume")
"""Numbers of every rig that are known to a few per cent only: they are refitted with every effect,
so that none is named for what they can do."""

Tell = Callable[[int, str], None]
"""Called as ``tell(parameter sets simulated so far, what is being tried)``."""


@dataclass(frozen=True, kw_only=True)
class DiagnosisReport:
    """A diagnosis with what it was made from.

    Attributes:
        rig: without effects.
        data: the measurements.
        held_out: names of the trials judged by.
        found: the diagnosis.
        skipped: effect -> why it could not be tried.
        notes: what a reader should know, one sentence each.
        seed: of the maps' sign flips.
        seconds: it took.
    """

    rig: Rig
    data: CalibrationData
    held_out: tuple[str, ...]
    found: Diagnosis
    skipped: dict[str, str]
    notes: tuple[str, ...]
    seed: int
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
    progress: Tell | None = None,
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
        progress: see `Tell`.

    Raises:
        InputError: for what cannot be read or used, see `find`.
    """
    began = time.perf_counter()
    data = read_calibration_data(sources)
    if not data.trials:
        raise InputError("diagnose needs recordings over time; angles at rest alone have none")
    loaded = rig if isinstance(rig, Rig) else load_rig(rig or data.rig or "mas20_arm")
    names, notes = _held_out(data, held_out)
    predictor = TrialPredictor(loaded, data, channels=check_channels(channels), threads=threads)
    predictor.linearise_starts(loaded)
    freed = [f.free for f in freed_parameters(loaded, ordinary)]
    tried, skipped = candidates(loaded, effects)

    def simulate(sets: Sequence[Values]) -> list[Blocks | None]:
        rigs = [_with(loaded, values) for values in sets]
        return [
            None if prediction is None else predictor.blocks(prediction)
            for prediction in predictor.predictions(rigs)
        ]

    simulator = TrialSimulator(simulate=simulate, held_out=frozenset(names))

    def told(what: str) -> None:
        if progress is not None:
            progress(simulator.evaluations, what)

    found = find(
        simulator,
        freed,
        [c for c in tried if not {p.name for p in c.parameters} & {p.name for p in freed}],
        {trial.name: regressors(trial) for trial in data.trials},
        seed=seed,
        told=told,
    )
    return DiagnosisReport(
        rig=loaded,
        data=data,
        held_out=names,
        found=found,
        skipped=skipped,
        notes=(*data.notes, *notes),
        seed=seed,
        seconds=time.perf_counter() - began,
    )


def _with(rig: Rig, values: Values) -> Rig | None:
    try:
        return rig.with_parameters(values)
    except ParameterError:  # an open end of a range
        return None


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
    check = tuple(t.name for t in data.trials if t.protocol.endswith(CHECK))
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
