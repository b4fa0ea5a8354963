"""What a diagnosis by link has found, and what it rests on, in plain words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

from pamsim.comparison.link_noise import Output, OutputNoise
from pamsim.comparison.links import in_links
from pamsim.comparison.noise_floor import FloorRoute
from pamsim.comparison.repeated_misfit import smallest_p_value
from pamsim.diagnosis.by_link.judged_units import VARIATION, VARYING
from pamsim.diagnosis.by_link.units import Units
from pamsim.inference.model_comparison import fewest_units

if TYPE_CHECKING:
    from pamsim.diagnosis.by_link.result import LinkReport
    from pamsim.diagnosis.by_link.whole_chain import ChannelGap


_KNOWN_BY = {
    FloorRoute.PERIODS: "by what periods of the command differ by",
    FloorRoute.HOLDS: "while commands are held, about a straight line: slower noise is unseen",
    FloorRoute.WITHIN_TRIALS: "from sample to sample: noise that drifts is unseen",
    FloorRoute.STATED: "as the recording states it: what differs from trial to trial is unseen",
}

_MISSED = 2.0
"""Noise floors by which the whole chain may miss a channel before it is stated: three quarters of
the mean square are then no noise."""


def verdict_sentence(result: LinkReport) -> str:
    """What is missing and how certain that is, effect by effect, and what is left."""
    sentences = [one.sentence for one in result.effects]
    left = [f"{n} ({_digits(size)} of the noise variance)" for n, size in result.remainder.items()]
    if result.undecided:
        where = ", ".join(f"{name} ({_digits(size)})" for name, size in result.undecided.items())
        sentences.append(
            f"{'' if sentences else 'No effect tried is certain. '}The misfit exceeds the noise"
            f" estimate; excess over its variance: {where}. What is held out does not show whether"
            " it is slow noise or a missing effect; the warnings state what would."
        )
    if not sentences and not left:
        if result.at_rest:
            if result.scatter:
                return _scatter(result.scatter)
            return (
                "No gap: no effect predicts held-out readings better, and near readings have no"
                " common error."
            )
        return (
            "No gap: on trials that no fit has seen every link is as near to the measurements as"
            " their noise allows, and no effect predicts them better."
        )
    if left and sentences:
        more = "Something more" if any(one.level for one in result.effects) else "Something"
        sentences.append(f"{more} is missing {in_links(left)}.")
    elif left:
        sentences.append(
            f"Unexplained: something is missing {in_links(left)} that no effect tried explains."
        )
    suspicions = [one.sentence for one in result.suspected]
    return " ".join([*sentences, *suspicions, *_learned(result)])


def _scatter(channels: Mapping[str, ChannelGap]) -> str:
    missed: list[str] = []
    for channel, gap in channels.items():
        assert gap.before is not None
        times = f", {gap.before / gap.floor:.3g} times its resolution" if gap.floor else ""
        missed.append(f"{channel.replace('_', ' ')} by {gap.before:.3g} {gap.unit} RMS{times}")
    return (
        f"Undecided: the model misses held-out readings ({'; '.join(missed)}), and no effect"
        " tried predicts them better. Without repeats this may be scatter or a missing effect; read"
        " every point three times or more."
    )


def _digits(size: float) -> str:
    """Two digits, and no power of ten for a large number."""
    return f"{size:.2g}" if abs(size) < 99.5 else f"{size:.0f}"


def _learned(result: LinkReport) -> list[str]:
    """What was learned of what has no name, in a sentence."""
    if not result.learned:
        return []
    first = result.learned[0]
    curves = " and ".join(
        f"{one.kind} of {one.acts_at}" + (f", like {one.words}" * bool(one.words))
        for one in result.learned
    )
    return [
        f"Without a name: {in_links(first.links)} {_digits(first.before - 1.0)} of the noise"
        f" variance is left, {_digits(max(first.after - 1.0, 0.0))} with {curves}."
    ]


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
