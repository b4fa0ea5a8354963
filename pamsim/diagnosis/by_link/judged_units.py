"""Which trials, or parts of trials, a diagnosis is judged by, and what differs from log to log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence

from pamsim.comparison.chain_runs import MIDDLE
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import LAG, FloorRoute
from pamsim.comparison.repeats import protocols_by_load, repeats
from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.limits import USUAL, Limits
from pamsim.diagnosis.by_link.units import Units, parts_of_trials, second_half, whole_trials
from pamsim.inference.blocks import correlation_length
from pamsim.inference.model_comparison import fewest_units
from pamsim.inference.projection import as_columns
from pamsim.recordings.trial import HELD_OUT_SUFFIX, Trial

VARYING = (
    "force.scale",
    "passive.stiffness",
    "valve.supply_pressure",
    "valve.conductance_fill",
    "valve.conductance_exhaust",
)
"""Parameters that change with temperature, seating of a muscle and supply."""

VARIATION = 0.01
"""Their relative standard deviation. It is an assumption, which a result states: one log does not
show it. What an effect does that is less than this changes is then not claimed."""


def held_out_split(
    data: CalibrationData, wanted: Sequence[str], limits: Limits = USUAL
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the trials to judge by, none of a few inputs recorded once, and warnings.

    Those are the trials or protocols ``wanted``; if there are none, protocols whose name ends in
    ``_check``, or else every second repeat, or else as `judged_trials`.

    Raises:
        InputError: for an unknown name.
    """
    if wanted:
        known = {t.name for t in data.trials} | {t.protocol for t in data.trials}
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"`hold_out` {name}: no trial of that name; {nearest(name, known)}"
                )
        chosen = set(wanted)
        return tuple(t.name for t in data.trials if {t.name, t.protocol} & chosen), ()
    check = tuple(t.name for t in data.trials if t.protocol.endswith(HELD_OUT_SUFFIX))
    if check:
        return check, ()
    seen: Counter[str] = Counter()
    second: list[str] = []
    for name, protocol in protocols_by_load(data.trials).items():
        seen[protocol] += 1
        if seen[protocol] % 2 == 0:
            second.append(name)
    if not second:
        return tuple(judged_trials(data.trials, (), limits)), ()
    return tuple(second), (
        "no protocol is held out (by a name that ends in _check, or by choice), so every second"
        " repeat is; this does not show whether the result holds for other inputs",
    )


def judged_trials(
    trials: Sequence[Trial], held_out: Collection[str], limits: Limits = USUAL
) -> dict[str, Trial]:
    """Trials that are held out; every second one if none is named and there are enough."""
    found = {trial.name: trial for trial in trials if trial.name in held_out}
    if len(found) == len(trials):
        raise InputError("all trials are held out, none is left to fit; name fewer in `hold_out`")
    if not found and len(trials) >= 2 * fewest_units(limits.alpha):
        return {trial.name: trial for k, trial in enumerate(trials) if second_half(k)}
    return found


def units_of(
    simulator: ChainSimulator,
    trials: Sequence[Trial],
    judged: Collection[str],
    limits: Limits = USUAL,
) -> Units:
    """Trials, or parts of them if fewer are held out than decide anything."""
    if len(judged) >= fewest_units(limits.alpha):
        inputs = {trial.name: group.name for group in repeats(trials) for trial in group.trials}
        repeated = all(one.source is FloorRoute.REPEATS for one in simulator.noise.values())
        varying = None if repeated else _log_variation(simulator)
        return whole_trials(simulator, judged, input_of=inputs, varying=varying, limits=limits)
    return parts_of_trials(
        simulator,
        judged,
        gap=_memory(simulator, trials),
        varying=_log_variation(simulator),
        limits=limits,
    )


def _memory(simulator: ChainSimulator, trials: Sequence[Trial]) -> int:
    """Samples over which noise may be correlated; what samples show of it is no measure of that."""
    shown = [
        correlation_length(one.noise, max(trial.time.size for trial in trials))
        for one in simulator.noise.values()
        if one.source is not FloorRoute.WITHIN_TRIALS
    ]
    return max([*(round(LAG / trial.sample_interval) for trial in trials), *shown])


def _log_variation(simulator: ChainSimulator) -> FloatArray:
    """Change of the residual with each parameter that varies, at its standard deviation, (N, k)."""
    sets: list[dict[str, float]] = []
    for name in VARYING:
        try:
            sets.append({name: (1.0 + VARIATION) * simulator.own_value(name)})
        except InputError:  # a bellows has no braid, a regulator no valve
            continue
    links = [simulator.acts_in(values) for values in sets]
    found = simulator.residuals(sets, links, simulator.stated, steps=MIDDLE)
    columns = [residual - simulator.stated for residual in found if residual is not None]
    return as_columns(columns, simulator.stated.size)
