"""What a model leaves of the held-out trials, without what varies from trial to trial.

A rig is not the same in every trial: with forces that differ by 0.3 % a perfect model leaves as
much as the sensors' noise. Three repeats that happen to be strong ones look like a remainder. So
the directions in which the trials of one protocol differ are projected out of each held-out trial,
as long as what the repeats share in such a direction is within that variation: a model that misses
more there keeps its remainder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.noise_floor import NoiseFloor, floor_beside
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.evidence import losses, perfect_losses
from pamsim.diagnosis.method.lack_of_fit import fitted_trials, shared_by_repeats
from pamsim.diagnosis.method.refit import Fitter, Refit
from pamsim.diagnosis.method.repeated_trials import (
    RepeatedTrial,
    project_out_variation,
    repeated_rows,
)
from pamsim.diagnosis.method.screen import Screened
from pamsim.diagnosis.method.signature import TangentSpace

_CHANGE = 0.01
"""Share of a nuisance parameter's value by which it is changed to find its direction."""


@dataclass(frozen=True, kw_only=True)
class TrialVariation:
    """Changes that parameters which vary from trial to trial make.

    Attributes:
        changes: (n, k) of the residual of all trials [SI], those of the nuisance parameters first.
        nuisance: number of these.
    """

    changes: FloatArray
    nuisance: int = 0


def trial_variation(fitter: Fitter, base: Refit, screened: Sequence[Screened]) -> TrialVariation:
    """Find the directions in which trials vary, by the fitted trials, on all of them.

    Args:
        fitter: of the trials.
        base: fit of the base model; its parameters are directions in any case.
        screened: effects, whose signatures are further directions if the trials differ in them.
    """
    traces = [trace for effect in screened for trace in effect.traces]
    varying = project_out_variation(fitted_trials(fitter, base, screened))
    sets = [{**base.values, p.name: (1.0 + _CHANGE) * base.values[p.name]} for p in base.parameters]
    sets += [{**base.values, **traces[k].probe.values} for k in varying]
    # In coarse steps, as these are: the base fit's residual may be in fine ones.
    here, *there = fitter.simulator.wholes([base.values, *sets])
    changes = np.zeros((base.residual.size, len(sets)))
    for k, one in enumerate(there):
        if here is not None and one is not None:
            changes[:, k] = one - here
    return TrialVariation(changes=changes, nuisance=len(base.parameters))


def without_variation(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, variation: TrialVariation | None
) -> list[RepeatedTrial]:
    """Held-out trials that have repeats, without what varies from trial to trial.

    Args:
        layout: of the residual.
        residual: (n,) of a model [SI].
        floor: of the noise.
        variation: from trial to trial; None where it is not known: it then stays.
    """
    if variation is None:
        variation = TrialVariation(changes=np.zeros((residual.size, 0)))
    held_out = [p for p in layout.places if p.block.trial in layout.held_out]
    weights = layout.weights(floor.sd)
    weighted, directions = residual * weights, variation.changes * weights[:, np.newaxis]
    channels: dict[str, set[str]] = {}
    for place in held_out:
        channels.setdefault(place.block.trial, set()).add(place.block.channel)
    trials: list[RepeatedTrial] = []
    for protocol, rows_of in repeated_rows(held_out).items():
        for name, rows in rows_of.items():
            scale = 1.0 / np.sqrt(len(channels[name]))
            trial = RepeatedTrial(protocol, scale * weighted[rows], scale * directions[rows], name)
            trials.append(trial)
    _refit(trials, variation.nuisance)
    for k in range(directions.shape[1] if trials else 0):
        units = [trial.unit_directions()[:, [k]] for trial in trials]
        along = [
            replace(trial, residual=unit.T @ trial.residual)
            for trial, unit in zip(trials, units, strict=True)
        ]
        shared = shared_by_repeats(along)
        if shared.p_value >= shared.level:
            for trial, unit in zip(trials, units, strict=True):
                trial.project_out(unit)
    return trials


def _refit(trials: Sequence[RepeatedTrial], count: int) -> None:
    """Fit the first directions to all trials together, to first order.

    The nuisance parameters come from the fitted trials, which vary as well: their error is the same
    in all held-out trials and would look like a remainder that repeats share.
    """
    if not trials or not count:
        return
    columns = np.concatenate([trial.directions[:, :count] for trial in trials])
    residual = np.concatenate([trial.residual for trial in trials])
    ends = np.cumsum([trial.residual.size for trial in trials])[:-1]
    left = np.split(TangentSpace(columns).project_out(residual), ends)
    for trial, own in zip(trials, left, strict=True):
        trial.residual = own


def held_out_excess(
    layout: TrialLayout, residual: FloatArray, floor: NoiseFloor, variation: TrialVariation | None
) -> dict[str, float]:
    """What a model leaves of each held-out trial beyond noise, over the noise variance.

    Args:
        layout: of the residual.
        residual: (n,) of the model [SI].
        floor: of the noise.
        variation: from trial to trial; None where it is not known: it then counts.

    Returns:
        Trial -> excess; a perfect model's is 0 in the mean of many trials.
    """
    perfect = perfect_losses(layout, floor_beside(floor, layout, residual))
    loss = losses(layout, residual, floor, held_out=True)
    excess = {trial: loss[trial] - perfect[trial] for trial in loss}
    if variation is None or layout.origin:
        return excess
    trials = without_variation(layout, residual, floor, variation)
    for protocol in dict.fromkeys(trial.protocol for trial in trials):
        members = [trial for trial in trials if trial.protocol == protocol]
        stack = np.stack([trial.residual for trial in members])
        scatter = float(np.sum((stack - stack.mean(axis=0)) ** 2)) / (len(members) - 1)
        for trial in members:
            excess[trial.name] = float(trial.residual @ trial.residual) - scatter
    return excess
