"""Recordings set beside a rig: what is held out, refitted and tried, and the simulations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.diagnosed_rig import DiagnosedRig
from pamsim.diagnosis.held_out_split import HeldOutSplit, held_out_split
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.physics.chamber import Chamber
from pamsim.physics.valves import ValvePair


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Recordings beside a rig, ready to be compared.

    Attributes:
        data: the recordings, as the rig names its signals.
        split: what is held out.
        nuisance: parameters that are refitted with every effect.
        tried: effects that may be missing.
        skipped: name of an effect that cannot be tried -> why.
        engine: the rig's simulations.
        simulator: the same as residuals.
    """

    data: CalibrationData
    split: HeldOutSplit
    nuisance: Sequence[FreeParameter]
    tried: Sequence[Candidate]
    skipped: dict[str, str]
    engine: DiagnosedRig
    simulator: TrialSimulator


def compared(
    data: CalibrationData,
    rig: Rig,
    effects: Sequence[str],
    without: Sequence[str],
    nuisance: Sequence[str],
    channels: Sequence[str],
    hold_out: Sequence[str],
    threads: int | None,
) -> Compared:
    """Set recordings beside a rig; see `pamsim.diagnosis.recordings.diagnose_recordings`."""
    data = data.of_rig(rig)
    split = held_out_split(data, hold_out)
    if all(trial.drives.all_measured for trial in data.trials):
        nuisance = [name for name in nuisance if not _is_of_air(name)]
    freed = [f.free for f in freed_parameters(rig, nuisance)]
    tried, skipped = candidates(rig, effects, without)
    refitted = {p.name for p in freed}
    for candidate in tried:
        shared = sorted(refitted & {p.name for p in candidate.parameters})
        if shared:
            skipped[candidate.name] = (
                f"{', '.join(shared)} is a nuisance parameter, refitted with every effect"
            )
    engine = DiagnosedRig(rig, data, split.trials, channels=channels, threads=threads)
    return Compared(
        data=data,
        split=split,
        nuisance=freed,
        tried=[c for c in tried if c.name not in skipped],
        skipped=skipped,
        engine=engine,
        simulator=TrialSimulator(engine.residuals, frozenset(split.names), split.parts),
    )


def _is_of_air(name: str) -> bool:
    """Whether a parameter has no influence where all pressures are imposed.

    Refitted, it would end anywhere, and be announced as far from what the rig states.
    """
    return ParameterName.parse(name).group in (Chamber.group, ValvePair.group)
