"""Diagnosis of recordings link by link: the whole of the method in one function."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.link_noise import Output, OutputNoise
from pamsim.comparison.links import Link, whole_run
from pamsim.comparison.noise_floor import FloorRoute
from pamsim.comparison.repeated_misfit import smallest_p_value
from pamsim.comparison.repeats import repeats
from pamsim.core.computation import Progress, Steps, one_blas_thread
from pamsim.diagnosis.by_link.held_out import HeldOut, refuse_unjudged
from pamsim.diagnosis.by_link.judge import claimed, judge
from pamsim.diagnosis.by_link.judged import Judged
from pamsim.diagnosis.by_link.judged_units import VARIATION, VARYING, judged_trials, units_of
from pamsim.diagnosis.by_link.learned_shape import LearnedShape, learned_shape
from pamsim.diagnosis.by_link.limits import USUAL, Limits, Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.search import search
from pamsim.diagnosis.by_link.sizes import Size, sharpened, sizes
from pamsim.diagnosis.by_link.units import Units
from pamsim.diagnosis.by_link.whole_chain import (
    confirmed,
    exact_effects,
    in_whole_chain,
    left_in_both,
)
from pamsim.engine.rig import Rig
from pamsim.inference.model_comparison import fewest_units
from pamsim.recordings.trial import Trial

FITS = 30
"""That a diagnosis of a few effects makes, for the progress bar."""


_KNOWN_BY = {
    FloorRoute.PERIODS: "by what periods of the command differ by",
    FloorRoute.HOLDS: "while commands are held, about a straight line: slower noise is unseen",
    FloorRoute.WITHIN_TRIALS: "from sample to sample: noise that drifts is unseen",
    FloorRoute.STATED: "as the recording states it: what differs from trial to trial is unseen",
}


@dataclass(frozen=True, kw_only=True)
class LinkDiagnosis:
    """What was found in each link."""

    links: tuple[Link, ...]  # from the command on
    # Mean square of the whitened rows of each link in the judged units, nuisance parameters
    # refitted; 1 is noise
    before: Mapping[Link, float]
    after: Mapping[Link, float]  # the same with the effects of which at least the place is certain
    effects: tuple[Judged, ...]  # that are there, the largest gain first
    # Without any of those, effects that fit what is fitted, none of them certain
    suspected: tuple[Candidate, ...] = ()
    sizes: Mapping[str, Size]  # parameter of an effect -> value and interval
    remainders: Mapping[Link, Remainder]  # what is left in every link with all effects
    # What is left with those of which at least the place is certain
    unexplained: Mapping[Link, Remainder]
    base: LinkModel  # the rig without effects, its nuisance parameters fitted
    model: LinkModel  # with these effects, as fitted
    # The same, refitted in the whole chain; None where something is left
    whole: LinkModel | None = None
    # Curves learned of what is left; None if nothing is, or no curve predicts it
    shape: LearnedShape | None = None
    notes: tuple[str, ...] = ()  # what it rests on, if that is not repeats and whole trials
    limits: Limits = USUAL  # from which an effect is claimed, and material


@one_blas_thread()
def diagnose_links(
    rig: Rig,
    trials: Sequence[Trial],
    candidates: Sequence[Candidate],
    *,
    held_out: Collection[str],
    nuisance: Sequence[str],
    limits: Limits = USUAL,
    learn: bool = True,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LinkDiagnosis:
    """Find the effects that a rig's model is missing, each in the link where it acts.

    1. Every link that the measured signals separate is simulated with its measured inputs. Its
       residual, in units of what repeats differ by, is white noise where nothing is missing.
    2. Effects are added one at a time, the nuisance parameters of each link refitted, as long as
       one promises more than the other forms of those already found.
    3. On units that no fit has seen each effect is compared with none and with its rivals.

    Units are trials, where enough of them are held out. Of inputs that were recorded once every
    second trial is, if there are many, or else every second part of each; parts of a few held-out
    trials are units, too. Noise is then what periods, holds or samples show. Slow noise, and what
    differs from log to log, are not seen in it, so that what is left cannot be decided: names are
    certain to the family at most.

    Trials have channels as the rig names them; none are held out where every input was recorded
    once. The nuisance parameters are refitted with every effect, in each link by itself.

    Raises:
        InputError: for trials that do not fit the rig, nothing to fit, trials that are too short to
            judge by, or a link that no judged trial measures.
    """
    steps = Steps(progress, FITS)
    steps.begin("the links of the rig as it is")
    judged = judged_trials(trials, held_out, limits)
    groups = (*repeats([t for t in trials if t.name not in judged]), *repeats([*judged.values()]))
    simulator = ChainSimulator(rig, groups, threads=threads)
    units = units_of(simulator, trials, judged, limits)
    fitter = LinkFitter(simulator, nuisance, units)
    refuse_unjudged(fitter)
    searched = search(fitter, candidates, steps=steps)
    unseen = HeldOut(fitter, seed=seed)
    model, effects = judge(searched, unseen)
    sure = claimed(searched, model, effects)
    before, after = unseen.losses(searched.base), unseen.losses(sure)
    left, unexplained, whole = unseen.remainders(model), unseen.remainders(sure), None
    suspected = () if effects else searched.model.effects
    found = sizes(fitter, sharpened(fitter, searched.model if suspected else model))
    nothing_left = not any(one.counts for one in left.values())
    if effects and (nothing_left or all(one.certain()["family"] for one in effects)):
        steps.begin("the whole chain with what was found")
        chain = ChainSimulator(rig, groups, divided=whole_run, threads=threads)
        whole = in_whole_chain(chain, nuisance, units_of(chain, trials, judged, limits), model)
    if whole is not None and not nothing_left:
        rest = HeldOut(whole[0], seed=seed).remainders(whole[1]).values()
        if all(one.excluded for one in rest):
            left = unexplained = left_in_both(left, rest)
            effects = exact_effects(effects)
        else:
            whole = None
    if whole is not None:
        found = confirmed(found, sizes(*whole))
    shape = None
    nameless = [link for link, one in unexplained.items() if one.counts]
    if nameless and learn:
        steps.begin("a shape for what has no name")

        def links_of(other: Rig) -> tuple[ChainSimulator, Units]:
            again = ChainSimulator(other, groups, threads=threads)
            return again, units_of(again, trials, judged, limits)

        shape = learned_shape(rig, trials, sure, nuisance, nameless, links_of, seed=seed)
    return LinkDiagnosis(
        links=simulator.links,
        before={link: float(np.mean(loss)) for link, loss in before.items()},
        after={link: float(np.mean(loss)) for link, loss in after.items()},
        effects=effects,
        suspected=suspected,
        sizes=found,
        remainders=left,
        unexplained=unexplained,
        base=searched.base,
        model=model,
        whole=None if whole is None else whole[1],
        shape=shape,
        notes=(
            *(f"not compared: {text}" for text in simulator.not_compared),
            *evidence_notes(simulator.noise, units),
        ),
        limits=limits,
    )


def evidence_notes(noise: Mapping[Output, OutputNoise], units: Units) -> tuple[str, ...]:
    """How the noise was estimated, and what is judged, where it is not repeats and trials."""
    notes: list[str] = []
    alpha = units.limits.alpha
    for source, known in _KNOWN_BY.items():
        channels = dict.fromkeys(c for (_, c), one in noise.items() if one.source is source)
        if channels:
            notes.append(f"without repeats the noise of {', '.join(channels)} is known {known}")
    if units.in_parts:
        notes.append(f"{len(units.judged.units)} parts of trials are judged instead of trials")
    if units.varies:
        notes.append(
            f"{', '.join(VARYING)} are assumed to differ by {100.0 * VARIATION:g} % from log to"
            " log: a larger difference looks like an effect"
        )
    if notes:
        repeated = all(one.source is FloorRoute.REPEATS for one in noise.values())
        notes.append(
            "whether anything is left cannot be decided from parts of trials, so that names are"
            f" certain to the family at most; hold out {fewest_units(alpha)} trials or more"
            if repeated
            else "whether anything is left cannot be decided without repeats, so that names are"
            " certain to the family at most; record every input three times or more"
        )
        return tuple(notes)
    counts = Counter(units.input(unit) for unit in units.judged.units).values()
    # A held-out trial that no other repeats is judged beside a fitted one.
    least = smallest_p_value(counts if max(counts) > 1 else [2] * len(counts))
    if least <= alpha:
        return ()
    return (
        f"{len(units.judged.units)} held-out trials show what is left at p = {least:.2g} at"
        " best, unless it is large: a gap that is small may be missed; record more repeats",
    )
