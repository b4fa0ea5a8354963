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
from pamsim.comparison.trial_residuals import TrialLayout, TrialSimulator
from pamsim.core.computation import Steps
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray, common_unit, to_si
from pamsim.diagnosis.diagnosed_rig import DiagnosedRig
from pamsim.diagnosis.method.refit import Fitter
from pamsim.diagnosis.method.screen import VISIBLE
from pamsim.diagnosis.method.signature import TangentSpace, signature
from pamsim.engine.rig import Rig
from pamsim.inference.free_parameter import FreeParameter
from pamsim.recordings.recording_checks import FEWEST_ROWS
from pamsim.recordings.signals import kind_of
from pamsim.recordings.trial import Trial

_SECONDS = 12.0
"""Of trials that are simulated with each effect; each of many inputs has its part."""

_SHORTEST = 2.0  # part of a trial that shows what the joints do [s]
_MOST = 6  # inputs
_NUDGE = 1e-7
"""Relative change of the muscles' force that a smooth simulation hardly notices."""

_JUMPS = 1e-4
"""Change of a signal by `_NUDGE`, as a share of the widest range of its kind, from which a
simulation is not smooth; in a smooth one it is of the order of `_NUDGE`."""


@dataclass(frozen=True, kw_only=True)
class EffectInData:
    """What one effect would look like in recordings.

    Attributes:
        name: of the effect, with its place.
        parameter: that measures its size.
        unit: of the sizes.
        typical: size that was simulated, as a change of the parameter.
        shows_from: size from which it would show, to first order; infinite if it changes nothing
            that nuisance parameters do not explain.
        seen: whether it would show at its typical size.
        channel: in which most of it would show.
        protocol: in which most of it would show.
    """

    name: str
    parameter: str
    unit: str
    typical: float
    shows_from: float
    seen: bool
    channel: str
    protocol: str


@dataclass(frozen=True, kw_only=True)
class EffectsInData:
    """What all effects would look like.

    Attributes:
        effects: the clearest first.
        broken: effects with which the simulation breaks down.
        trials: that were simulated.
        seconds: of them together.
        rough: channels that jump when a parameter hardly changes -> by how much [SI].
    """

    effects: tuple[EffectInData, ...]
    broken: tuple[str, ...]
    trials: tuple[str, ...]
    seconds: float
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
    """Simulate recordings with each effect.

    Args:
        rig: without effects.
        data: the recordings, as the rig names its signals.
        floor: of their noise.
        candidates: effects, each in one form.
        nuisance: parameters that are refitted with every effect, so that what they can explain
            does not count.
        held_out: trials that no fit of a diagnosis sees.
        threads: simulations at a time; None for one per processor.
        steps: of a computation that ends with this; each simulation is one.

    Raises:
        InputError: if the simulation breaks down without any effect.
    """
    shown = _beginnings(data, held_out)
    # One of the rig, one nudged, one for each parameter's sensitivity and one with each effect.
    steps.expect(len(shown.trials) * (2 + len(nuisance) + len(candidates)))
    engine = DiagnosedRig(
        rig,
        shown,
        (),
        threads=threads,
        simulated=lambda: steps.begin("simulating each effect"),
    )
    simulator = TrialSimulator(engine.residuals)
    start = {p.name: p.start for p in nuisance}
    residual = simulator.whole(start)
    if residual is None:
        raise InputError(
            "the simulation breaks down on these trials; check the rig's parameters and the"
            " recording's units"
        )
    fitter = Fitter(simulator, floor)
    here = fitter.weighted(residual)
    space = TangentSpace(fitter.jacobian(nuisance, start, here))
    sets = [_typical(candidate) for candidate in candidates]
    nudged = {"force.scale": _scale(rig, start) * (1.0 + _NUDGE)}
    *changes, jump = fitter.changes(
        [*({**start, **values} for values in sets), {**start, **nudged}], here
    )
    effects: list[EffectInData] = []
    broken: list[str] = []
    for candidate, values, change in zip(candidates, sets, changes, strict=True):
        if change is None:
            broken.append(candidate.name)
        else:
            left = signature(space, change, 1.0)
            effects.append(
                _effect(candidate, values, left.visible, simulator.layout, left.projected)
            )
    effects.sort(key=lambda one: one.shows_from / one.typical)
    return EffectsInData(
        effects=tuple(effects),
        broken=tuple(broken),
        trials=tuple(trial.name for trial in shown.trials),
        seconds=float(sum(trial.time[-1] for trial in shown.trials)),
        rough={}
        if jump is None
        else _rough(jump / fitter.weights, simulator.layout, shown.trials, floor),
    )


def _beginnings(data: CalibrationData, held_out: Collection[str]) -> CalibrationData:
    """One trial of every input that a diagnosis fits, each cut short."""
    first: dict[tuple[str, float], Trial] = {}
    for trial in data.trials:
        if trial.name not in held_out:
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


def _scale(rig: Rig, start: Mapping[str, float]) -> float:
    return start.get("force.scale") or next(iter(rig.muscles.values())).force.scale


def _effect(
    candidate: Candidate,
    values: Mapping[str, float],
    visible: float,
    layout: TrialLayout,
    projected: FloatArray,
) -> EffectInData:
    size = candidate.parameters[0]
    unit = common_unit(size.unit)
    change = values[size.name] - candidate.neutral[size.name]
    typical = abs(change) / to_si(1.0, unit, size.unit, where=size.name)
    energies = {
        (place.block.channel, place.block.protocol): float(np.sum(projected[place.rows] ** 2))
        for place in layout.places
    }
    channel, protocol = max(energies, key=lambda key: energies[key])
    return EffectInData(
        name=candidate.name,
        parameter=size.name,
        unit=unit,
        typical=typical,
        shows_from=typical * float(np.sqrt(VISIBLE / visible)) if visible > 0.0 else np.inf,
        seen=visible > VISIBLE,
        channel=channel,
        protocol=protocol,
    )


def _rough(
    jump: FloatArray, layout: TrialLayout, trials: Sequence[Trial], floor: NoiseFloor
) -> dict[str, float]:
    """Channels that change by more than a share of what their kind moves, and by how much [SI]."""
    moved = dict.fromkeys(map(kind_of, floor.sd), 0.0)
    for channel in floor.sd:
        ranges = [float(np.ptp(t.measured[channel])) for t in trials if channel in t.measured]
        moved[kind_of(channel)] = max(moved[kind_of(channel)], floor.sd[channel], *ranges)
    found: dict[str, float] = {}
    for place in layout.places:
        channel = place.block.channel
        change = float(np.abs(jump[place.rows]).max())
        if change > _JUMPS * moved[kind_of(channel)]:
            found[channel] = max(change, found.get(channel, 0.0))
    return found
