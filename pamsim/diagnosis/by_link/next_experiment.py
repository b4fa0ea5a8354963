"""What to measure next: the input on which tied effects differ most, or what shows the rest.

T-optimality (Atkinson and Fedorov, Biometrika 62, 1975): the models are fitted to what there is,
and the input is chosen at which the best fit of one lies farthest from the other.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.comparison.protocols import PROTOCOLS, Protocol
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.entries import chain_values
from pamsim.diagnosis.by_link.judged import Judged, Rival
from pamsim.diagnosis.by_link.result import NextExperiment
from pamsim.diagnosis.fitted_rig import possible_rig
from pamsim.engine.batch import simulate_batch
from pamsim.engine.rig import Rig
from pamsim.inference.projection import orthonormal, project_out
from pamsim.recordings.recording import Outcome
from pamsim.recordings.sensors import distorted

_FILLING = 0.6  # time for which a valve is opened before it shuts [s]
_MOVED = 0.05  # of a fitted size of the rival, for what its refit can take away


def next_experiment(
    rig: Rig, found: LinkDiagnosis, noise: Mapping[str, float], *, threads: int | None = None
) -> NextExperiment | None:
    """Choose what to measure next; None if nothing is open.

    ``noise`` is the standard deviation of each channel [SI].
    """
    tied = next(_tied(found), None)
    if tied is not None:
        return _between(rig, found, *tied, noise, threads)
    left = [link for link in found.links if found.unexplained[link].counts]
    return NextExperiment(advice=_divided(left[0], found.links)) if left else None


def next_reading(found: LinkDiagnosis) -> NextExperiment | None:
    """What to measure next of a rig at rest, in words; None if nothing is open."""
    tied = next(_tied(found), None)
    if tied is not None:
        return NextExperiment(advice=tied[0].effect.effect.separating)
    if any(found.unexplained[link].counts for link in found.links):
        return NextExperiment(advice="more readings in between: near readings have a common error")
    return None


def _tied(found: LinkDiagnosis) -> Iterator[tuple[Judged, Rival]]:
    """Effects and rivals that may be the cause instead, with another name."""
    for one in found.effects:
        for rival in one.rivals:
            if rival.ties() and rival.effect.name != one.effect.name:
                yield one, rival


def _divided(link: Link, links: Collection[Link]) -> str:
    """How a link in which something is left is divided further, or shown better."""
    divided = any(set(other.parts) < set(link.parts) for other in links)
    if MUSCLE in link.parts and JOINT in link.parts and not divided:
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
    # The effort on a joint that a machine moved is in no trial in which it moves freely.
    menu = {
        name: _distance(own, shared)
        for name, own in runs.items()
        if (shared := {channel: sd for channel, sd in noise.items() if channel in own[0]})
    }
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
    rigs = [own for values in sets if (own := possible_rig(rig, values)) is not None]
    if len(rigs) < len(sets):
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
        name: [
            (run if own.sensor is None else distorted(run, own.sensor)).signals()
            for own, run in pairs
        ]
        for name, pairs in done.items()
        if all(run.outcome is Outcome.COMPLETED for _, run in pairs)
    }


def _distance(signals: list[Mapping[str, FloatArray]], noise: Mapping[str, float]) -> float:
    """Mean square between the models that no size of the rival takes away, over the noise."""
    best, rival, *moved = (
        np.concatenate([own[c] / (sd * np.sqrt(own[c].size)) for c, sd in noise.items()])
        for own in signals
    )
    basis = orthonormal(np.column_stack([own - rival for own in moved]))
    left = project_out(basis, best - rival)
    return float(left @ left) / len(noise)


def _shut_hold(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Muscle 1 filled, muscle 2 left; then both shut."""
    opening = np.where(time < _FILLING, 0.3, 0.0)
    return np.stack([opening, 0.3 * opening], axis=1)


def _small_reversals(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Slow turns that grow from nothing, at a low common pressure."""
    half = 5e3 * (1.0 + time) * np.sin(2.0 * np.pi * 0.5 * time)
    return np.maximum(np.stack([1.2e5 + half, 1.2e5 - half], axis=1), 0.0)


def _pressure_ladder(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The same small turn at three common pressures."""
    common = np.select([time < 2.7, time < 5.4], [1.2e5, 2.5e5], 3.8e5)
    half = 4e4 * np.sin(2.0 * np.pi * time / 1.35)
    return np.stack([common + half, common - half], axis=1)


def _long_hold(time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """One step, then set points held to the end."""
    half = np.where(time < 0.5, 0.0, 1.5e5)
    return np.stack([2.5e5 + half, 2.5e5 - half], axis=1)


MENU: dict[str, Protocol] = {
    protocol.name: protocol
    for protocol in (
        *PROTOCOLS.values(),
        Protocol(
            name="shut_hold",
            shows="leaks, as the pressure that a chamber loses while its valves are shut",
            command="valve",
            drive=_shut_hold,
        ),
        Protocol(
            name="small_reversals",
            shows="backlash, dry friction and dead zones: turns that grow from nothing",
            command="pressure_set",
            drive=_small_reversals,
        ),
        Protocol(
            name="pressure_ladder",
            shows="what grows with pressure: equal turns at three common pressures",
            command="pressure_set",
            drive=_pressure_ladder,
        ),
        Protocol(
            name="long_hold",
            shows="creep and drift: one step, then hold",
            command="pressure_set",
            drive=_long_hold,
        ),
        Protocol(
            name="long_hold_loaded",
            shows="what depends on the load: one step with a mass on the arm, then hold",
            command="pressure_set",
            drive=_long_hold,
            load=2.4,
        ),
    )
}
"""Name -> safe experiment. Those of `pamsim.comparison.protocols` vary with the seed."""
