"""What a diagnosis by link has found, in plain words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from pamsim.core.digits import significant_digits
from pamsim.core.units import common_unit, to_si
from pamsim.diagnosis.physical_size import PhysicalSize
from pamsim.effects.effect import FAMILIES

if TYPE_CHECKING:
    from pamsim.diagnosis.by_link.effect_entry import (
        EffectEntry,
        InsteadEntry,
        SizeEntry,
        SuspectEntry,
    )
    from pamsim.diagnosis.by_link.result import LinkReport
    from pamsim.diagnosis.by_link.whole_chain import ChannelGap


def verdict_sentence(result: LinkReport) -> str:
    """What is missing and how certain that is, effect by effect, and what is left."""
    sentences = [effect_sentence(one) for one in result.effects]
    left = [f"{name} ({size:.2g} of the noise variance)" for name, size in result.remainder.items()]
    if result.undecided:
        where = " and ".join(f"{name} ({size:.2g})" for name, size in result.undecided.items())
        sentences.append(
            f"{'' if sentences else 'No effect tried is certain. '}The misfit exceeds the noise"
            f" estimate; excess over its variance: {where}. Without repeats it may be slow noise"
            " or a missing effect; record every input three times or more."
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
        sentences.append(f"{more} is missing in {' and '.join(left)}.")
    elif left:
        sentences.append(
            f"Unexplained: something is missing in {' and '.join(left)} that no effect tried"
            " explains."
        )
    return " ".join([*sentences, *map(_suspicion, result.suspected), *_learned(result)])


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


def _suspicion(one: SuspectEntry) -> str:
    """The size of an effect that is not certain, as a condition."""
    name, size = next(iter(one.sizes.items()))
    return f"If it is {one.missing}: {_sized(name, size)} ({one.effect})."


def _learned(result: LinkReport) -> list[str]:
    """What was learned of what has no name, in a sentence."""
    if not result.learned:
        return []
    first = result.learned[0]
    curves = " and ".join(
        f"a torque over the {one.over} of {one.joint}" + (f", like {one.words}" * bool(one.words))
        for one in result.learned
    )
    return [
        f"Without a name: in {' and '.join(first.links)} {first.before - 1.0:.2g} of the noise"
        f" variance is left, {max(first.after - 1.0, 0.0):.2g} with {curves}."
    ]


def certain_words(one: EffectEntry) -> str:
    """What is certain of an effect, in a few words: as deep as its name holds."""
    match one.level:
        case "form":
            return one.missing
        case "name":
            return one.name.replace("_", " ")
        case "family":
            return FAMILIES.get(one.family, one.family.replace("_", " "))
        case "place":
            return f"something at {one.place}"
        case _:
            return f"something in {' and '.join(one.links)}"


def effect_sentence(one: EffectEntry) -> str:
    """What is certain of an effect, its size, and the nearest formula."""
    parameters = [_sized(name, size) for name, size in one.sizes.items()]
    certain = f"Certain: {certain_words(one)}"
    if one.level == "form":
        return f"{certain} ({one.effect}), {', '.join(parameters)}."
    # Where no repeats show it, a formula may be exact that is not known to be.
    exact = "" if one.exact or one.left <= 0.0 else f", not exact: {100.0 * one.left:.2g} % left"
    nearest = f"Nearest formula: {one.effect}, {parameters[0]}{exact}."
    match one.level:
        case "name" | "family":
            return f"{certain}{_physical(one.physical)}. {nearest}"
        case "place":
            return f"{certain}. {nearest}"
        case _:
            instead = "" if one.instead is None else f" {one.instead.sentence}"
            if one.upstream:
                instead += f" {one.upstream_sentence}"
            return f"Not certain in its place: {certain_words(one)}. {nearest}{instead}"


def instead_sentence(own: InsteadEntry) -> str:
    """A number of the rig that may be off instead of an effect, and what to do about it."""
    unit = "" if own.unit == "1" else f" {own.unit}"
    return (
        f"Or {own.parameter} is {own.value:.3g}{unit} instead of {own.stated:.3g}, which explains"
        f" {100.0 * own.share:.0f} % of this effect: measure this number, then leave it out of"
        " --nuisance."
    )


def _physical(sizes: Mapping[str, PhysicalSize]) -> str:
    """The first quantity of an effect's size, which its formula does not matter for."""
    for name, size in sizes.items():
        if size.interval95 is None or size.interval95[0] == size.interval95[1]:
            continue
        unit = common_unit(size.unit)
        ends = [to_si(end, size.unit, unit, where=name) for end in size.interval95]
        shown = PhysicalSize(
            value=to_si(size.value, size.unit, unit, where=name),
            unit=unit,
            interval95=(ends[0], ends[1]),
        )
        return f", {_sized(name, shown)}"
    return ""


def _sized(name: str, one: SizeEntry | PhysicalSize) -> str:
    """A fitted parameter as text, such as ``leak conductance 1.98 [1.92, 2.07] mm^3/(s*kPa)``."""
    label = name.rpartition(".")[2].replace("_", " ")
    ends = one.interval95
    known = ends is not None and all(map(math.isfinite, ends))
    digits = significant_digits(one.value, ends if known else None)
    text = f"{label} {one.value:.{digits}g}"
    if ends is not None and known:
        text += f" [{', '.join(f'{end:.{digits}g}' for end in ends)}]"
    return text if one.unit == "1" else f"{text} {one.unit}"
