"""What to measure next: the input on which tied effects differ most, or what shows the rest.

T-optimality (Atkinson and Fedorov, Biometrika 62, 1975): the models are fitted to what there is,
and the input is chosen at which the best fit of one lies farthest from the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.chain_values import chain_values
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.judged import ALPHA, Judged, Rival
from pamsim.diagnosis.by_link.result import NextExperiment
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.inference.projected_effect import orthonormal
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.sensors import distorted

_MOVED = 0.05  # of a fitted size of the rival, for what its refit can take away


def next_experiment(
    rig: Rig, found: LinkDiagnosis, noise: Mapping[str, float], *, threads: int | None = None
) -> NextExperiment | None:
    """Choose what to measure next.

    Args:
        rig: that was diagnosed.
        found: what was found.
        noise: channel -> standard deviation [SI].
        threads: simulations at a time; None for one per processor.

    Returns:
        The choice; None if nothing is open.
    """
    tied = next(_tied(found), None)
    if tied is not None:
        return _between(rig, found, *tied, noise, threads)
    left = [link for link in found.links if found.unexplained[link].counts(ALPHA)]
    return NextExperiment(advice=_divided(left[0])) if left else None


def next_reading(found: LinkDiagnosis) -> NextExperiment | None:
    """What to measure next of a rig at rest, in words; None if nothing is open."""
    tied = next(_tied(found), None)
    if tied is not None:
        return NextExperiment(advice=tied[0].effect.effect.separating)
    if any(found.unexplained[link].counts(ALPHA) for link in found.links):
        return NextExperiment(advice="more readings in between: near ones miss the same together")
    return None


def _tied(found: LinkDiagnosis) -> Iterator[tuple[Judged, Rival]]:
    """Effects and rivals that may be the cause instead, with another name."""
    for one in found.effects:
        for rival in one.rivals:
            if rival.ties(ALPHA) and rival.effect.name != one.effect.name:
                yield one, rival


def _divided(link: Link) -> str:
    """How a link in which something is left is divided further, or shown better."""
    if MUSCLE in link.parts and JOINT in link.parts:
        signal = "pressures" if VALVES in link.parts else "muscles' forces"
        return f"measure the {signal}, too: they divide {link.name}, in which something is left"
    return (
        f"record {link.name}, in which something is left, with slower, faster and smaller inputs"
        " one at a time, each three times or more"
    )


def _between(
    rig: Rig,
    found: LinkDiagnosis,
    one: Judged,
    rival: Rival,
    noise: Mapping[str, float],
    threads: int | None,
) -> NextExperiment:
    advice = one.effect.effect.separating
    values = chain_values(found, rival.model)
    sets = [chain_values(found, found.model), values]
    for parameter in rival.effect.parameters:
        value = values[parameter.name]
        step = _MOVED * (value or parameter.high - parameter.low)
        low, high = parameter.low, parameter.high
        step = step if low <= value + step <= high else -step
        sets.append({**values, parameter.name: value + step})
    runs = _simulated(rig, sets, threads)
    menu = {name: _distance(own, noise) for name, own in runs.items()}
    if not menu:
        return NextExperiment(advice=advice)
    chosen = max(menu, key=lambda name: menu[name])
    apart = found.model.rows - rival.model.rows
    return NextExperiment(
        advice=advice,
        protocol=chosen,
        shows=MENU[chosen].shows,
        between=(one.effect.label, rival.effect.label),
        before=float(np.mean(apart**2)),
        after=menu[chosen],
        menu=menu,
    )


def _simulated(
    rig: Rig, sets: list[dict[str, float]], threads: int | None
) -> dict[str, list[Mapping[str, FloatArray]]]:
    """Experiment -> signals [SI] with each set of values; those that break down are left out."""
    try:
        rigs = [rig.with_parameters(values) for values in sets]
    except (InputError, ParameterError):  # an open end of a range
        return {}
    menu = {
        name: one.experiment(muscles=len(rig.muscles), supply=rig.supply_pressure)
        for name, one in MENU.items()
        if rig.takes_load or not one.load
    }
    jobs = [(own, experiment) for experiment in menu.values() for own in rigs]
    runs = iter(simulate_batch(jobs, threads=threads, above_supply=True))
    done = {name: [(own, next(runs)) for own in rigs] for name in menu}
    return {
        name: [_read(own, run) for own, run in pairs]
        for name, pairs in done.items()
        if all(run.outcome is Outcome.COMPLETED for _, run in pairs)
    }


def _read(rig: Rig, run: Recording) -> Mapping[str, FloatArray]:
    return (run if rig.sensor is None else distorted(run, rig.sensor)).signals()


def _distance(signals: list[Mapping[str, FloatArray]], noise: Mapping[str, float]) -> float:
    """Mean square between the models that no size of the rival takes away, over the noise."""
    best, rival, *moved = (
        np.concatenate(
            [own[c] / (sd * np.sqrt(own[c].size)) for c, sd in noise.items() if c in own]
        )
        for own in signals
    )
    apart = best - rival
    basis = orthonormal(np.column_stack([own - rival for own in moved]))
    left = apart - basis @ (basis.T @ apart)
    return float(left @ left) / len(noise)
