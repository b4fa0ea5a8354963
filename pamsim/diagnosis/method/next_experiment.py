"""Next experiment: the one that would best separate tied effects, by what each predicts for it.

T-optimality (Atkinson and Fedorov, Biometrika 62, 1975): the models are fitted to what there is,
and the input is chosen at which the best fit of one lies farthest from the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.refit import Fitter
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.inference.free_parameter import SearchScale

Signals = Mapping[str, Mapping[str, FloatArray]]
"""Name of an experiment -> channel -> simulated signal [SI]."""

SimulateMenu = Callable[[Sequence[Mapping[str, float]]], Sequence[Signals | None]]
"""Rig parameters [SI] by name to the signals of every experiment on the menu; None where the
simulation broke down."""

_STEP = 1e-3  # of a range, for differences: signals are free of noise


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """What to measure next.

    Attributes:
        protocol: name of the experiment on the menu.
        between: names of the two models that it separates.
        before: mean square distance of the two on the trials at hand, over the noise variance.
        after: the same on a trial of that experiment, once each has been refitted.
        menu: experiment -> the latter.
        advice: the experiment that separates the effects, in words.
    """

    protocol: str
    between: tuple[str, ...]
    before: float
    after: float
    menu: Mapping[str, float]
    advice: str


def next_experiment(
    best: TrialModel, tied: Sequence[TrialModel], fitter: Fitter, simulate: SimulateMenu
) -> NextExperiment | None:
    """Choose from a menu what separates the best model from the one most nearly tied with it.

    Args:
        best: the best model.
        tied: models that predict as well.
        fitter: of the trials.
        simulate: of the menu.

    Returns:
        The choice; None if nothing is tied or no experiment runs.
    """
    if not tied:
        return None
    rival = min(tied, key=lambda m: m.mean_loss)
    apart = fitter.weighted(best.fit.residual) - fitter.weighted(rival.fit.residual)
    distances = _distances(best, rival, fitter, simulate)
    if not distances:
        return None
    chosen = max(distances, key=lambda name: distances[name])
    return NextExperiment(
        protocol=chosen,
        between=(" + ".join(best.names), " + ".join(rival.names)),
        before=float(apart @ apart),
        after=distances[chosen],
        menu=distances,
        advice=best.candidates[-1].effect.separating,
    )


def _distances(
    best: TrialModel, rival: TrialModel, fitter: Fitter, simulate: SimulateMenu
) -> dict[str, float]:
    """Mean square that no parameter of the rival can remove, per experiment, over the noise."""
    scale = SearchScale(rival.fit.parameters)
    place = scale.place(rival.fit.values)
    sets: list[dict[str, float]] = [dict(best.fit.values), dict(rival.fit.values)]
    for i, parameter in enumerate(rival.fit.parameters):
        moved = place.copy()
        moved[i] += -_STEP if place[i] > 0.5 else _STEP
        sets.append({**rival.fit.values, parameter.name: float(scale.from_unit(moved)[i])})
    of_best, of_rival, *of_moved = simulate(sets)
    if of_best is None or of_rival is None:
        return {}
    sd = fitter.floor.sd
    distances: dict[str, float] = {}
    for name in of_rival:
        here = _weighted(of_rival[name], sd)
        change = _weighted(of_best[name], sd) - here
        columns = [_weighted(run[name], sd) - here for run in of_moved if run is not None]
        if columns:
            change = TangentSpace(np.stack(columns, axis=1)).project_out(change)
        distances[name] = float(change @ change)
    return distances


def _weighted(signals: Mapping[str, FloatArray], sd: Mapping[str, float]) -> FloatArray:
    """Signals of one experiment in units of noise: squares sum to the mean over all channels.

    Args:
        signals: channel -> (n,) simulated [SI]; channels without noise are not compared.
        sd: channel -> standard deviation of its noise [SI].
    """
    compared = [values / (sd[c] * np.sqrt(values.size)) for c, values in signals.items() if c in sd]
    return np.concatenate(compared) / np.sqrt(len(compared))
