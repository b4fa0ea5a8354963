"""Which trials, or parts of trials, a diagnosis is judged by."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.noise_floor import LAG, FloorRoute
from pamsim.comparison.repeats import repeats
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.log_variation import log_variation
from pamsim.diagnosis.by_link.units import Units, parts_of_trials, second_half, whole_trials
from pamsim.inference.blocks import correlation_length
from pamsim.inference.model_comparison import fewest_units
from pamsim.recordings.trial import Trial


def judged_trials(
    trials: Sequence[Trial], held_out: Collection[str], alpha: float
) -> dict[str, Trial]:
    """Trials that are held out; every second one if none is named and there are enough."""
    found = {trial.name: trial for trial in trials if trial.name in held_out}
    if len(found) == len(trials):
        raise InputError("all trials are held out, none is left to fit; name fewer in `hold_out`")
    if not found and len(trials) >= 2 * fewest_units(alpha):
        return {trial.name: trial for k, trial in enumerate(trials) if second_half(k)}
    return found


def units_of(
    simulator: ChainSimulator, trials: Sequence[Trial], judged: Collection[str], alpha: float
) -> Units:
    """Trials, or parts of them if fewer are held out than decide anything."""
    fewest = fewest_units(alpha)
    if len(judged) >= fewest:
        inputs = {trial.name: group.name for group in repeats(trials) for trial in group.trials}
        repeated = all(one.source is FloorRoute.REPEATS for one in simulator.noise.values())
        varying = None if repeated else log_variation(simulator)
        return whole_trials(simulator, judged, input_of=inputs, varying=varying)
    return parts_of_trials(
        simulator,
        judged,
        gap=_memory(simulator, trials),
        varying=log_variation(simulator),
        fewest=fewest,
    )


def _memory(simulator: ChainSimulator, trials: Sequence[Trial]) -> int:
    """Samples over which noise may be correlated; what samples show of it is no measure of that."""
    shown = [
        correlation_length(one.noise, max(trial.time.size for trial in trials))
        for one in simulator.noise.values()
        if one.source is not FloorRoute.WITHIN_TRIALS
    ]
    return max([*(round(LAG / trial.sample_interval) for trial in trials), *shown])
