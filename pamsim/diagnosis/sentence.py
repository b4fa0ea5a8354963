"""The verdict of a diagnosis as one plain sentence, whatever the kind of data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pamsim.diagnosis.method.verdict import Verdict

if TYPE_CHECKING:
    from pamsim.diagnosis.result import Diagnosis, Estimate, FoundEffect

_DIGITS = 3
_LISTED = 3  # alternatives that the sentence names


def verdict_sentence(found: Diagnosis) -> str:
    """What is missing, how certain that is, and what remains."""
    match found.verdict:
        case Verdict.NO_GAP:
            text = (
                "No gap: on held-out data the simulation is as near to the measurements as their"
                f" noise allows ({_level(found)})"
                if found.kind == "recordings"
                else "No gap: no effect improves predictions of held-out data significantly, and"
                f" what the model misses is not systematic ({_level(found)})"
            )
        case Verdict.NAMED | Verdict.NAMED_WITH_REMAINDER:
            text = _named(found)
        case Verdict.AMBIGUOUS:
            text = _ambiguous(found)
        case Verdict.UNEXPLAINED:
            text = (
                "Unexplained: something is missing that none of the"
                f" {found.effects_tried} effects tried explains{_resemblance(found)}{_place(found)}"
            )
        case Verdict.NOT_IDENTIFIABLE:
            text = f"Not identifiable: {found.inconclusive}{_resemblance(found)}"
    return f"{text}."


def sized(name: str, estimate: Estimate) -> str:
    """A fitted parameter as text, such as ``leak conductance 2.00 [1.92, 2.07] mm^3/(s*kPa)``."""
    label = name.rpartition(".")[2].replace("_", " ")
    text = f"{label} {estimate.value:.{_DIGITS}g}"
    if estimate.interval95 is not None:
        text += f" [{', '.join(f'{end:.{_DIGITS}g}' for end in estimate.interval95)}]"
    return text if estimate.unit == "1" else f"{text} {estimate.unit}"


def _named(found: Diagnosis) -> str:
    parts = [
        f"{effect.missing} ({effect.name}, "
        f"{', '.join(sized(name, p) for name, p in effect.parameters.items())})"
        for effect in found.effects
    ]
    what, left = " and ".join(parts), ""
    one = len(parts) == 1
    if found.verdict is Verdict.NAMED_WITH_REMAINDER:
        families = dict.fromkeys(e.family.replace("_", " ") for e in found.effects)
        what = f"something that resembles {what}"
        left = (
            f", and leave{'s' if one else ''} {_remainder(found)}: another effect, of the same"
            f" family ({', '.join(families)}) or one that resembles it"
        )
    return (
        f"Missing: {what}; {'it explains' if one else 'together they explain'}"
        f" {100.0 * found.explained:.0f} % of the gap{left}; held-out {_levels(found)}"
    )


def _remainder(found: Diagnosis) -> str:
    """What the best model leaves, and how certain that is."""
    lack, remainder = found.details.lack_of_fit, found.details.remainder
    if lack is not None and lack["significant"]:
        return (
            f"{lack['size']:.2g} of the noise variance, shared by all repeats"
            f" (p = {lack['p_value']:.1g})"
        )
    if remainder is not None:
        return f"{remainder:.2g} of the noise variance"
    return "a significant remainder"


def _level(found: Diagnosis) -> str:
    before = found.over_floor(repaired=False)
    if before is not None:
        return f"RMS {before:#.3g} times the noise floor"
    return ", ".join(f"RMS {g.before.value:.2f} {g.unit}" for g in found.gap.values())


def _levels(found: Diagnosis) -> str:
    before, after = found.over_floor(repaired=False), found.over_floor(repaired=True)
    if before is not None and after is not None:
        return f"RMS {before:#.3g} times the noise floor before and {after:#.3g} after the repair"
    return ", ".join(
        f"RMS {g.before.value:.2f} {g.unit} before and {g.after.value:.2f} {g.unit} after the"
        " repair"
        for g in found.gap.values()
        if g.after is not None
    )


def _ambiguous(found: Diagnosis) -> str:
    models = found.alternatives
    kinds = [_described(model, found.certain) for model in models[: _LISTED + 1]]
    if len(models) > len(kinds):
        kinds.append(f"one of {len(models) - len(kinds)} others")
    choice = _either(list(dict.fromkeys(kinds)))
    if found.certain:
        text = (
            f"Ambiguous: {' and '.join(found.certain)} is missing, and these data cannot decide"
            f" whether the other cause is {choice}"
        )
    else:
        text = (
            f"Ambiguous: something is missing, and these data cannot decide whether it is {choice}"
        )
    following = found.next_experiment
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


def _resemblance(found: Diagnosis) -> str:
    near = found.resembles
    if near is None:
        return ""
    name = near.name.replace("+", " + ")
    if near.p_value is None and near.similarity is not None:
        return f"; {name} resembles it most (similarity {near.similarity:.2f})"
    share = "" if near.explained is None else f", with {100.0 * near.explained:.0f} % of the gap"
    return f"; {name} resembles it most{share}"


def _place(found: Diagnosis) -> str:
    if not found.where:
        return ""
    worst = found.where[0]
    return f"; it is largest in {worst.channel.replace('_', ' ')} of {worst.protocol}"
