"""Diagnose recordings on disk link by link."""

from __future__ import annotations

import os
from collections.abc import Sequence

from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.measurements import read_calibration_data
from pamsim.core.computation import Progress
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.diagnose_links import diagnose_links
from pamsim.diagnosis.by_link.result import LinkReport, report
from pamsim.diagnosis.held_out_split import held_out_split
from pamsim.diagnosis.recordings import NUISANCE
from pamsim.engine.rig import Rig, load_rig


def diagnose_by_link(
    data: Sequence[str | os.PathLike[str]],
    *,
    rig: str | os.PathLike[str] | Rig | None = None,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    nuisance: Sequence[str] = NUISANCE,
    hold_out: Sequence[str] = (),
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LinkReport:
    """Find what a rig's model is missing in each link of its chain.

    Args:
        data: recording folders. Every input should be recorded twice or more; of a single log of
            20 s or more parts are judged, and the result has a note on how its noise is known.
        rig: name or folder of the rig, or a loaded one; the recordings' own if left out.
        effects: names of those that may be missing; all if left out.
        without: names of those that are not tried.
        nuisance: parameters that are refitted with every effect, in each link by itself.
        hold_out: trials or protocols to judge by; see
            `pamsim.diagnosis.held_out_split.held_out_split`.
        seed: random seed of the sign flips, where they are drawn.
        threads: simulations at a time; None for one per processor.
        progress: called as each fit begins.

    Raises:
        InputError: for data that cannot be read, trials that are too few and too short, or a name
            that is not known.
    """
    read = read_calibration_data(data)
    if read.tables:
        raise InputError("`by_link` diagnoses recordings; leave out tables of angles at rest")
    own = rig if isinstance(rig, Rig) else load_rig(rig or read.rig or "mas20_arm")
    measured = read.of_rig(own)
    tried, _ = candidates(own, effects, without)
    free = set(nuisance)
    found = diagnose_links(
        own,
        measured.trials,
        [one for one in tried if not free & {p.name for p in one.parameters}],
        held_out=held_out_split(measured, hold_out).trials,
        nuisance=nuisance,
        seed=seed,
        threads=threads,
        progress=progress,
    )
    return report(own, found)
