"""What each effect would look like in recordings: from which size on it shows, and where.

Each effect is simulated once, at its typical size, in one trial of every input, and of long ones in
their beginning: that suffices to judge what could be seen, not to name anything.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_prediction import TrialPredictor
from pamsim.core.computation import Steps
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray, common_unit, to_si
from pamsim.diagnosis.by_link.limits import MATERIAL
from pamsim.diagnosis.fitted_rig import possible_rig
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.projection import as_columns, orthonormal, project_out
from pamsim.inference.simulator_fit import BlockPlace, Blocks, layout
from pamsim.recordings.recording_checks import FEWEST_ROWS
from pamsim.recordings.signals import kind_of
from pamsim.recordings.trial import Trial

_SECONDS = 12.0
"""Of trials that are simulated with each effect; each of many inputs has its part."""

_SHORTEST = 2.0  # part of a trial that shows what the joints do [s]
_MOST = 6  # inputs
_LONGER = 2  # of the rig's time steps in one: changes of signals are off by some per cent
_STEP = 1e-3  # of a nuisance parameter's range, for sensitivities
_NUDGE = 1e-7
"""Relative change of the muscles' force that a smooth simulation hardly notices."""

_JUMPS = 1e-4
"""Change of a signal by `_NUDGE`, as a share of the widest range of its kind, from which a
simulation is not smooth; in a smooth one it is of the order of `_NUDGE`."""


@dataclass(frozen=True, kw_only=True)
class EffectInData:
    """What one effect would look like in recordings."""

    name: str  # of the effect, with its place
    parameter: str  # that measures its size
    unit: str  # of the sizes
    typical: float  # size that was simulated, as a change of the parameter
    # Size from which it would show, to first order; infinite if it changes nothing that nuisance
    # parameters do not explain
    shows_from: float
    seen: bool  # whether it would show at its typical size
    channel: str  # in which most of it would show
    protocol: str  # in which most of it would show


@dataclass(frozen=True, kw_only=True)
class EffectsInData:
    """What all effects would look like."""

    effects: tuple[EffectInData, ...]  # the clearest first
    broken: tuple[str, ...]  # effects with which the simulation breaks down
    trials: tuple[str, ...]  # that were simulated
    seconds: float  # of them together
    # Channels that jump when a parameter hardly changes -> by how much [SI]
    rough: Mapping[str, float]


def effects_in_data(
    rig: Rig,
    data: CalibrationData,
    floor: NoiseFloor,
    candidates: Sequence[Candidate],
    nuisance: Sequence[FreeParameter],
    *,
    held_out: Collection[str],
    threads: int | None,
    steps: Steps,
) -> EffectsInData:
    """Simulate recordings with each effect that a rig has not, in one form.

    What nuisance parameters can explain does not count, since they are refitted with every effect.
    Nor is a trial simulated that is held out. Each simulation is a step of the computation, which
    ends with this.

    Raises:
        InputError: if the simulation breaks down without any effect.
    """
    shown = _beginnings(data, held_out)
    # One of the rig, one nudged, one for each parameter's sensitivity and one with each effect.
    steps.expect(len(shown.trials) * (2 + len(nuisance) + len(candidates)))
    predictor = TrialPredictor(
        rig, shown, threads=threads, simulated=lambda: steps.begin("simulating each effect")
    )
    predictor.linearise_starts(None)  # starts as read: all simulations share their errors
    step = _long_step(rig, [e.sample_rate for e in predictor.experiments])

    def simulate(sets: Sequence[Mapping[str, float]]) -> list[Blocks | None]:
        rigs = [_possible(rig, values, step) for values in sets]
        found = predictor.predictions(rigs, timestep=step)
        return [None if one is None else predictor.blocks(one) for one in found]

    (here,) = simulate([{}])
    if here is None:
        raise InputError(
            "the simulation breaks down on these trials; check the rig's parameters and the"
            " recording's units"
        )
    places, stated = layout(here), _residual(here)
    weights = _weights(here, floor.sd)
    moved = [{p.name: p.start + _STEP * (p.high - p.low)} for p in nuisance]
    sets = [_typical(candidate) for candidate in candidates]
    scale = next(iter(rig.muscles.values())).force.scale
    found = simulate([*moved, *sets, {"force.scale": scale * (1.0 + _NUDGE)}])
    changes = [None if one is None else _residual(one) - stated for one in found]
    explained = [weights * one for one in changes[: len(moved)] if one is not None]
    basis = orthonormal(as_columns(explained, stated.size))
    effects: list[EffectInData] = []
    broken: list[str] = []
    for candidate, values, change in zip(candidates, sets, changes[len(moved) : -1], strict=True):
        if change is None:
            broken.append(candidate.name)
            continue
        left = project_out(basis, weights * change)
        effects.append(_effect(candidate, values, places, left))
    effects.sort(key=lambda one: one.shows_from / one.typical)
    jump = changes[-1]
    return EffectsInData(
        effects=tuple(effects),
        broken=tuple(broken),
        trials=tuple(trial.name for trial in shown.trials),
        seconds=float(sum(trial.time[-1] for trial in shown.trials)),
        rough={} if jump is None else _rough(jump, places, shown.trials, floor),
    )


def _residual(blocks: Blocks) -> FloatArray:
    """Simulated minus measured of all blocks, (n,) [SI]."""
    return np.concatenate([block.residual for block in blocks])


def _weights(blocks: Blocks, noise: Mapping[str, float]) -> FloatArray:
    """Of each row, (n,): the sum of squares is the mean over trials and channels."""
    channels, trials = {b.channel for b in blocks}, {b.trial for b in blocks}
    of_each = [
        np.full(b.residual.size, noise[b.channel] * np.sqrt(b.residual.size)) for b in blocks
    ]
    return 1.0 / (np.concatenate(of_each) * np.sqrt(len(channels) * len(trials)))


def _possible(rig: Rig, values: Mapping[str, float], step: float | None) -> Rig | None:
    """The rig with some values; None out of range, or too quick for a time step [s]."""
    moved = possible_rig(rig, values)
    return None if moved is None or _too_quick(moved, step) else moved


def _long_step(rig: Rig, rates: Sequence[float]) -> float | None:
    """Long time step [s]; None where the rig or a sampling rate needs the rig's own."""
    step = _LONGER * float(rig.model.opt.timestep)
    ratios = [1.0 / (rate * step) for rate in rates]
    if any(abs(r - round(r)) > 1e-6 * r or round(r) < 1 for r in ratios):
        return None
    return None if _too_quick(rig, step) else step


def _too_quick(rig: Rig, step: float | None) -> bool:
    """Whether a rig needs a shorter time step [s]."""
    try:
        check_timestep(rig.model_for(timestep=step), rig.limits)
    except InputError:
        return True
    return False


def _beginnings(data: CalibrationData, held_out: Collection[str]) -> CalibrationData:
    """One trial of every input that a diagnosis fits, each cut short."""
    first: dict[tuple[str, float], Trial] = {}
    for trial in data.trials:
        if trial.name not in held_out or len(held_out) >= len(data.trials):
            first.setdefault((trial.protocol, trial.load), trial)
    chosen = list(first.values())[:_MOST]
    share = max(_SECONDS / len(chosen), _SHORTEST)
    return replace(data, trials=tuple(_beginning(trial, share) for trial in chosen), tables=())


def _beginning(trial: Trial, seconds: float) -> Trial:
    count = max(int(np.searchsorted(trial.time, seconds, side="right")), FEWEST_ROWS)
    return replace(
        trial,
        time=trial.time[:count],
        command=trial.command[:count],
        measured={channel: values[:count] for channel, values in trial.measured.items()},
    )


def _typical(candidate: Candidate) -> dict[str, float]:
    """Parameters of an effect at its typical size."""
    probe = candidate.probes[0]
    return candidate.moved(probe, 1.0 / probe.size)


def _effect(
    candidate: Candidate,
    values: Mapping[str, float],
    places: Sequence[BlockPlace],
    projected: FloatArray,
) -> EffectInData:
    visible = float(projected @ projected)
    size = candidate.parameters[0]
    unit = common_unit(size.unit)
    change = values[size.name] - candidate.neutral[size.name]
    typical = abs(change) / to_si(1.0, unit, size.unit, where=size.name)
    energies = {
        (place.block.channel, place.block.protocol): float(np.sum(projected[place.rows] ** 2))
        for place in places
    }
    channel, protocol = max(energies, key=lambda key: energies[key])
    return EffectInData(
        name=candidate.name,
        parameter=size.name,
        unit=unit,
        typical=typical,
        shows_from=typical * float(np.sqrt(MATERIAL / visible)) if visible > 0.0 else np.inf,
        seen=visible > MATERIAL,
        channel=channel,
        protocol=protocol,
    )


def _rough(
    jump: FloatArray, places: Sequence[BlockPlace], trials: Sequence[Trial], floor: NoiseFloor
) -> dict[str, float]:
    """Channels that change by more than a share of what their kind moves, and by how much [SI]."""
    moved = dict.fromkeys(map(kind_of, floor.sd), 0.0)
    for channel in floor.sd:
        ranges = [float(np.ptp(t.measured[channel])) for t in trials if channel in t.measured]
        moved[kind_of(channel)] = max(moved[kind_of(channel)], floor.sd[channel], *ranges)
    found: dict[str, float] = {}
    for place in places:
        channel = place.block.channel
        change = float(np.abs(jump[place.rows]).max())
        if change > _JUMPS * moved[kind_of(channel)]:
            found[channel] = max(change, found.get(channel, 0.0))
    return found
