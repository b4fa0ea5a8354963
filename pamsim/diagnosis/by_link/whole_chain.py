"""The whole chain: what a diagnosis by link has found is refitted and compared there.

What is imposed on a link, smoothed and between samples, is not quite what acted there. It moves
sizes by some per cent: inertia that an independent plant had was found 5 % too small. And it leaves
something in a link even where nothing is missing: of five training cases with the library's own
formula and a remainder by link four left noise alone in the whole chain, of six with another
formula none. The whole chain is driven by commands alone, but any link that misses something spoils
it for all. So it is refitted where every link is left with noise or the families of all effects are
certain. What links have left counts only if the whole chain is left with something as well. If it
is not, a size is that of the whole chain, with an interval that holds the one by link, too.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.compared_signal import (
    Comparison,
    comparisons_of,
    pooled_rms,
    shown_unit,
)
from pamsim.comparison.links import Link
from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.noise_floor import NoiseFloor, noise_floor
from pamsim.comparison.trial_prediction import Prediction, TrialPredictor
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.judged import Judged
from pamsim.diagnosis.by_link.limits import Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.sizes import Size, sharpened
from pamsim.diagnosis.by_link.units import Units
from pamsim.diagnosis.fitted_rig import possible_rig
from pamsim.engine.rig import Rig
from pamsim.inference.simulator_fit import layout

_MISSED = 2.0
"""Noise floors by which the whole chain may miss a channel before it is stated: three quarters of
the mean square are then no noise."""


@dataclass(frozen=True, kw_only=True)
class ChannelGap:
    """Root mean squares of one channel in the held-out trials, the whole chain simulated."""

    unit: str  # of all
    floor: float | None  # noise, as repeats or one trial show it; None if it is not known
    # What the rig misses, its nuisance parameters refitted, or as it is if that is nearer; None if
    # it breaks down, or parts of trials are held out and no whole one
    before: float | None
    after: float | None  # what it misses with the effects that were found; None without any


@dataclass(frozen=True, kw_only=True)
class WholeChain:
    """The simulations of the whole chain."""

    # Trial -> channel -> (n,) simulated by the rig as it is [SI]; empty if it breaks down
    as_it_is: Mapping[str, Mapping[str, FloatArray]]
    comparisons: tuple[Comparison, ...]  # every compared channel of every trial, before and after
    gap: Mapping[str, ChannelGap]  # channel -> what is missed


def whole_chain(
    rig: Rig,
    data: CalibrationData,
    before: Mapping[str, float],
    after: Mapping[str, float] | None,
    *,
    held_out: Collection[str],
    threads: int | None = None,
) -> WholeChain:
    """Simulate all trials from the command on, with refitted parameters and with effects [SI].

    Without effects the rig as it is stands for the refitted one where it misses less.
    ``after`` is None if there are no effects.
    """
    predictor = TrialPredictor(rig, data, threads=threads)
    # Starts as read: fitted to a held-out trial, they would take away some of what is missed there.
    predictor.linearise_starts(None)
    rigs = [rig, possible_rig(rig, before), None if after is None else possible_rig(rig, after)]
    stated, base, repaired = predictor.predictions(rigs)
    known = next((one for one in (stated, base, repaired) if one is not None), None)

    def beside(first: Prediction | None) -> tuple[tuple[Comparison, ...], dict[str, ChannelGap]]:
        comparisons = tuple(
            one
            for trial in data.trials
            for one in comparisons_of(
                trial,
                predictor.compared(trial),
                None if first is None else first.trials[trial.name],
                None if repaired is None else repaired.trials[trial.name],
                held_out=trial.name in held_out,
            )
        )
        return comparisons, {} if known is None else _gap(predictor, known, comparisons)

    # Refitted in each link, nuisance parameters make up for what is missing there, and may make the
    # whole chain worse than it is.
    comparisons, gap = min(map(beside, (base, stated)), key=lambda one: _missed_before(one[1]))
    return WholeChain(
        as_it_is={} if stated is None else stated.trials, comparisons=comparisons, gap=gap
    )


def misses_more(gap: Mapping[str, ChannelGap]) -> bool:
    """Whether the channels together are missed by more after than before, in noise floors."""
    change = 0.0
    for one in gap.values():
        if one.floor and one.before is not None and one.after is not None:
            change += (one.after**2 - one.before**2) / one.floor**2
    return change > 0.0


def _missed_before(gap: Mapping[str, ChannelGap]) -> float:
    """Sum of the squares of all channels, in noise floors; infinite where one is not known."""
    before = [(one.before, one.floor) for one in gap.values() if one.floor]
    return sum(math.inf if size is None else (size / floor) ** 2 for size, floor in before)


def slow_errors(gap: Mapping[str, ChannelGap]) -> tuple[str, ...]:
    """What a whole chain misses of which no link shows anything left.

    Tests weigh errors by the noise at their own speed. Where noise drifts, an error as slow is
    seen by none of them.
    """
    missed: list[str] = []
    for channel, one in gap.items():
        last = one.before if one.after is None else one.after
        if last is not None and one.floor and last > _MISSED * one.floor:
            missed.append(f"{channel} by {last / one.floor:.2g}")
    if not missed:
        return ()
    return (
        f"no link shows anything left, but the whole chain misses {', '.join(missed)} noise floors"
        " (RMS): an error as slow as the noise drifts is seen by no test",
    )


def floor_beside(predictor: TrialPredictor, prediction: Prediction) -> NoiseFloor:
    """Noise of the channels, by what a prediction misses of the trials."""
    blocks = predictor.blocks(prediction)
    residual = np.concatenate([block.residual for block in blocks])
    return noise_floor(layout(blocks), residual, predictor.data.trials)


def _gap(
    predictor: TrialPredictor, known: Prediction, comparisons: tuple[Comparison, ...]
) -> dict[str, ChannelGap]:
    floor = floor_beside(predictor, known).sd
    found: dict[str, ChannelGap] = {}
    for channel in dict.fromkeys(part.channel for part in comparisons):
        own = [part for part in comparisons if part.channel == channel and part.held_out]
        unit, scale = shown_unit(channel)
        found[channel] = ChannelGap(
            unit=unit,
            floor=floor[channel] * scale,
            before=pooled_rms(own, "before"),
            after=pooled_rms(own, "after"),
        )
    return found


def in_whole_chain(
    simulator: ChainSimulator, nuisance: Sequence[str], units: Units, model: LinkModel
) -> tuple[LinkFitter, LinkModel] | None:
    """Fitter of the whole chain and a model refitted there, from its sizes by link.

    None where the simulation of the chain breaks down.
    """
    fitter = LinkFitter(simulator, nuisance, units, short=1)
    # In the order of the effects: that of a set differs from run to run, and with it the rounding.
    begin = {p.name: model.values[p.name] for effect in model.effects for p in effect.parameters}
    fit = fitter.fit(fitter.stated, model.effects, begin, simulator.links)
    return None if fit is None else (fitter, sharpened(fitter, fit))


def left_in_both(
    by_link: Mapping[Link, Remainder], whole: Collection[Remainder]
) -> dict[Link, Remainder]:
    """What every link has left if the whole chain, in any trials, is left with something, too."""
    return {
        link: Remainder(
            excess=min(one.excess, max(other.excess for other in whole)),
            p_value=max(one.p_value, min(other.p_value for other in whole)),
            known=one.known and all(other.known for other in whole),
            limits=one.limits,
        )
        for link, one in by_link.items()
    }


def exact_effects(effects: Sequence[Judged]) -> tuple[Judged, ...]:
    """Effects beside which nothing is left after all."""
    return tuple(replace(one, exact=True, named=True, left=0.0, uncounted=0.0) for one in effects)


def confirmed(by_link: Mapping[str, Size], whole: Mapping[str, Size]) -> dict[str, Size]:
    """Sizes of the whole chain, with intervals that hold the values by link, too."""
    found: dict[str, Size] = {}
    for name, size in by_link.items():
        other = whole[name]
        ends = (size.value, *other.interval95)
        found[name] = Size(value=other.value, interval95=(min(ends), max(ends)))
    return found
