"""The experiment that would best tell tied effects apart, by what each predicts for it.

T-optimality (Atkinson and Fedorov, Biometrika 62, 1975): the models are fitted to what there is,
and the input is chosen at which the best fit of one lies farthest from the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.diagnosis.method.judge import Trialled
from pamsim.diagnosis.method.refit import Fitter
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.diagnosis.method.verdict import Named
from pamsim.inference.free_parameter import SearchScale

FloatArray = NDArray[np.float64]

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
        between: names of the two models that it tells apart.
        before: mean square distance of the two on the trials at hand, in noise floors.
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


def next_experiment(named: Named, fitter: Fitter, simulate: SimulateMenu) -> NextExperiment | None:
    """Choose from a menu what tells the best model from the one most nearly tied with it.

    Args:
        named: the verdict.
        fitter: of the trials.
        simulate: of the menu.

    Returns:
        The choice; None if nothing is tied or no experiment runs.
    """
    if named.best is None or not named.tied:
        return None
    best, rival = named.best, min(named.tied, key=lambda m: m.mean_loss)
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
    best: Trialled, rival: Trialled, fitter: Fitter, simulate: SimulateMenu
) -> dict[str, float]:
    """What no parameter of the rival can take back, per experiment, in noise floors."""
    scale = SearchScale(rival.fit.parameters)
    at = np.array([rival.fit.values[p.name] for p in rival.fit.parameters])
    place = scale.to_unit(at)
    sets: list[dict[str, float]] = [dict(best.fit.values), dict(rival.fit.values)]
    for i, parameter in enumerate(rival.fit.parameters):
        moved = place.copy()
        moved[i] += -_STEP if place[i] > 0.5 else _STEP
        sets.append({**rival.fit.values, parameter.name: float(scale.from_unit(moved)[i])})
    found = simulate(sets)
    if found[0] is None or found[1] is None:
        return {}
    distances: dict[str, float] = {}
    for name in found[1]:
        channels = [c for c in found[1][name] if c in fitter.floor.sd]

        def stacked(
            signals: Signals, name: str = name, channels: list[str] = channels
        ) -> FloatArray:
            parts = [
                signals[name][c] / (fitter.floor.sd[c] * np.sqrt(signals[name][c].size))
                for c in channels
            ]
            return np.concatenate(parts) / np.sqrt(len(channels))

        here = stacked(found[1])
        slopes = [stacked(moved) - here for moved in found[2:] if moved is not None]
        change = stacked(found[0]) - here
        if slopes:
            change = TangentSpace(np.stack(slopes, axis=1)).across(change)
        distances[name] = float(change @ change)
    return distances
