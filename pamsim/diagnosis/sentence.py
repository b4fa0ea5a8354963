"""The verdict of a diagnosis as one plain sentence, whatever the kind of data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import LARGE_REMAINDER_LOSS
from pamsim.diagnosis.sized import sized
from pamsim.effects.effect import FAMILIES

if TYPE_CHECKING:
    from pamsim.diagnosis.result import Diagnosis, FoundEffect, Place

_DIGITS = 3
_ENOUGH = "three repeats of three inputs would do"
_LISTED = 3  # alternatives that the sentence names


def verdict_sentence(result: Diagnosis) -> str:
    """What is missing, how certain that is, and what remains."""
    match result.verdict:
        case Verdict.NO_GAP:
            text = (
                "No gap: on held-out data the simulation is as near to the measurements as their"
                f" noise allows ({_level(result)}){_below_a_gap(result)}"
                if result.kind == "recordings"
                else "No gap: no effect improves predictions of held-out data significantly, and"
                f" what the model misses is not systematic ({_level(result)})"
            )
        case Verdict.NAMED | Verdict.NAMED_WITH_REMAINDER:
            text = _named(result)
        case Verdict.AMBIGUOUS:
            text = _ambiguous(result)
        case Verdict.UNEXPLAINED:
            text = (
                "Unexplained: something is missing that none of the"
                f" {result.effects_tried} effects tried explains"
                f"{_resemblance(result)}{_place(result)}"
            )
        case Verdict.NOT_IDENTIFIABLE:
            text = f"Not identifiable: {result.inconclusive}{_resemblance(result)}"
    return f"{text}{_far_nuisance(result)}."


def _far_nuisance(result: Diagnosis) -> str:
    """Nuisance parameters that no longer are what the rig states."""
    moved = [
        f"{n.parameter} to {_value(n.last, n.unit)}"
        f" ({'the end of its range; ' if n.at_bound else ''}the rig: {_value(n.before, n.unit)})"
        for n in result.nuisance
        if n.far
    ]
    return f"; refitted far from the rig: {', '.join(moved)}" if moved else ""


def _value(value: float, unit: str) -> str:
    return f"{value:.{_DIGITS}g}{'' if unit == '1' else f' {unit}'}"


def _named(result: Diagnosis) -> str:
    parts = [
        f"{_of_family(effect)}{effect.missing} ({effect.name}, "
        f"{', '.join(sized(name, p) for name, p in effect.parameters.items())})"
        for effect in result.effects
    ]
    what, left = " and ".join(parts), ""
    single = len(parts) == 1
    if result.verdict is Verdict.NAMED_WITH_REMAINDER and _only_untested(result):
        left = (
            "; whether exactly this is missing or something that resembles it is not testable with"
            f" these repeats ({_ENOUGH})"
        )
    elif result.verdict is Verdict.NAMED_WITH_REMAINDER:
        families = dict.fromkeys(e.family.replace("_", " ") for e in result.effects)
        what = f"something that resembles {what}"
        left = (
            f", and leave{'s' if single else ''} {_remainder(result)}: another effect, of the same"
            f" family ({', '.join(families)}) or one that resembles it"
        )
    return (
        f"Missing: {what}; {'it explains' if single else 'together they explain'}"
        f" {_share(result)} of the gap{left}; held-out {_levels(result)}"
    )


def _of_family(effect: FoundEffect) -> str:
    """What is certain before its kind, where the family has several kinds."""
    return f"{FAMILIES[effect.family]}, best described as " if effect.family in FAMILIES else ""


def _share(result: Diagnosis) -> str:
    """Share of the gap as text, such as ``75 [52, 93] %``."""
    return _percent(result.explained, result.explained_interval95)


def _percent(share: float, ends: tuple[float, float] | None) -> str:
    text = f"{100.0 * share:.0f}"
    if ends is not None:
        # Rounded outwards at the bottom: what is not shown is not claimed.
        text += f" [{math.floor(100.0 * ends[0])}, {100.0 * ends[1]:.0f}]"
    return f"{text} %"


def _below_a_gap(result: Diagnosis) -> str:
    """What repeats share although it is no gap, or that these repeats could not show it."""
    lack = result.details.lack_of_fit
    if lack is None or (lack["testable"] and not lack["significant"]):
        return ""
    if not lack["testable"]:
        return (
            "; whether all repeats share a remainder is not testable with these repeats"
            f" ({_ENOUGH})"
        )
    return (
        f"; all repeats share {lack['size']:.2g} of the noise variance that it does not predict"
        f" (p = {lack['p_value']:.1g}), less than counts as a gap"
    )


def _only_untested(result: Diagnosis) -> bool:
    """Whether repeats that cannot show a remainder are all that keeps it from a plain name."""
    lack, remainder = result.details.lack_of_fit, result.details.remainder
    small = remainder is None or remainder <= LARGE_REMAINDER_LOSS
    return lack is not None and not lack["testable"] and small


def _remainder(result: Diagnosis) -> str:
    """What the best model leaves, and how certain that is."""
    lack, remainder = result.details.lack_of_fit, result.details.remainder
    if lack is not None and lack["significant"]:
        return (
            f"{lack['size']:.2g} of the noise variance, shared by all repeats"
            f" (p = {lack['p_value']:.1g})"
        )
    if remainder is not None:
        return f"{remainder:.2g} of the noise variance"
    return "a significant remainder"


def _level(result: Diagnosis) -> str:
    before = result.over_floor(repaired=False)
    if before is not None:
        return f"RMS {before:#.3g} times the noise floor"
    return ", ".join(f"RMS {g.before.value:.2f} {g.unit}" for g in result.gap.values())


def _levels(result: Diagnosis) -> str:
    before, after = result.over_floor(repaired=False), result.over_floor(repaired=True)
    if before is not None and after is not None:
        return f"RMS {before:#.3g} times the noise floor before and {after:#.3g} after the repair"
    return ", ".join(
        f"RMS {g.before.value:.2f} {g.unit} before and {g.after.value:.2f} {g.unit} after the"
        " repair"
        for g in result.gap.values()
        if g.after is not None
    )


def _ambiguous(result: Diagnosis) -> str:
    models = result.alternatives
    kinds = [_described(model, result.certain) for model in models[: _LISTED + 1]]
    if len(models) > len(kinds):
        kinds.append(f"one of {len(models) - len(kinds)} others")
    choice = _either(list(dict.fromkeys(kinds)))
    if result.certain:
        text = (
            f"Ambiguous: {' and '.join(result.certain)} is missing, and these data cannot decide"
            f" whether the other cause is {choice}"
        )
    elif result.certain_families:
        families = " and ".join(name.replace("_", " ") for name in result.certain_families)
        text = (
            f"Ambiguous: an effect of the family {families} is missing, and these data cannot"
            f" decide which: {choice}"
        )
    else:
        text = (
            f"Ambiguous: something is missing, and these data cannot decide whether it is {choice}"
        )
    following = result.next_experiment
    if following is None:
        return text
    if following.protocol is None or following.before is None or following.after is None:
        return f"{text}; to decide: {following.advice}"
    return (
        f"{text}; recording {following.protocol} would decide ({following.shows}): it separates"
        f" them by {following.after:.2g} of the noise variance, these data by"
        f" {following.before:.2g}"
    )


def _described(model: FoundEffect, certain: Sequence[str]) -> str:
    """An alternative in words, without the effects that are certain."""
    rest = {name: missing for name, missing in model.members.items() if name not in certain}
    return f"{' and '.join(rest.values())} ({' + '.join(rest)})"


def _either(choices: Sequence[str]) -> str:
    return " or ".join([", ".join(choices[:-1]), choices[-1]] if len(choices) > 1 else choices)


def _resemblance(result: Diagnosis) -> str:
    near = result.resembles
    if near is None:
        return ""
    name = near.name.replace("+", " + ")
    if near.p_value is None and near.similarity is not None:
        return f"; {name} resembles it most (similarity {near.similarity:.2f})"
    text = f"; {name} resembles it most"
    if near.explained is not None:
        text += f", with {_percent(near.explained, near.explained_interval95)} of the gap"
    if near.leaves is not None:
        text += f", and leaves most in {_in(near.leaves)}"
    return text


def _place(result: Diagnosis) -> str:
    return f"; the gap is largest in {_in(result.where[0])}" if result.where else ""


def _in(place: Place) -> str:
    """A channel and protocol, such as ``angle of levels at 20 to 35 deg/s of speed``."""
    text = f"{_words(place.channel)} of {place.protocol}"
    over = place.region
    if over is None:
        return text
    unit = "" if over.unit == "1" else f" {over.unit}"
    quantity = _words(over.quantity)
    return f"{text} ({quantity} {over.low:.3g} to {over.high:.3g}{unit})"


def _words(signal: str) -> str:
    """A channel or quantity in words, such as ``knee angle``."""
    return signal.replace("_", " ").replace(".", " ")
