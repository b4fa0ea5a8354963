"""The verdict of a diagnosis as one plain sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.method.gap import ChannelGap
from pamsim.diagnosis.method.judge import Trialled
from pamsim.diagnosis.method.procedure import Diagnosis
from pamsim.diagnosis.method.verdict import Named, Verdict
from pamsim.effects.catalog import EFFECTS
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter

_DIGITS = 3


def verdict_sentence(rig: Rig, found: Diagnosis, gaps: Sequence[ChannelGap]) -> str:
    """What was found, how sure that is, and what remains.

    Args:
        rig: without effects.
        found: the diagnosis.
        gaps: per channel, on the held-out trials.
    """
    named = found.named
    match named.verdict:
        case Verdict.NO_GAP:
            text = (
                "No gap: on held-out trials the simulation is as near to the data as their noise"
                f" allows{_levels(gaps, repaired=False)}"
            )
        case Verdict.NAMED | Verdict.NAMED_WITH_REMAINDER if named.best is not None:
            text = _named(rig, found, named.best, gaps)
        case Verdict.AMBIGUOUS if named.best is not None:
            text = _ambiguous(found, named.best)
        case Verdict.UNEXPLAINED:
            text = (
                "Unexplained: something is missing that none of the"
                f" {len(found.screened)} effects tried explains{_resemblance(found)}{_place(found)}"
            )
        case _:
            text = f"Not identifiable: {_why_not(found)}"
    return f"{text}."


def ratio_to_floor(gaps: Sequence[ChannelGap], *, repaired: bool) -> float:
    """Residual over noise floor, as a root mean square over the channels.

    Args:
        gaps: per channel.
        repaired: True for the repaired model, False for the base model.
    """
    levels = [(gap.after if repaired else gap.before, gap.floor) for gap in gaps]
    squares = [(level.value / floor.value) ** 2 for level, floor in levels if level is not None]
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")


def sized(rig: Rig, model: Trialled, name: str) -> str:
    """A fitted parameter as text, such as ``leak conductance 2.00 [1.92, 2.07] mm^3/(s*kPa)``."""
    parameter = rig_parameter(rig, name)
    value = f"{readable(parameter, model.fit.values[name]):.{_DIGITS}g}"
    ends = [f"{readable(parameter, end):.{_DIGITS}g}" for end in model.intervals[name]]
    unit = readable_unit(parameter)
    label = name.rpartition(".")[2].replace("_", " ")
    return f"{label} {value} [{', '.join(ends)}]{'' if unit == '1' else f' {unit}'}"


def _named(rig: Rig, found: Diagnosis, best: Trialled, gaps: Sequence[ChannelGap]) -> str:
    named = found.named
    parts: list[str] = []
    for candidate in best.candidates:
        sizes = ", ".join(sized(rig, best, p.name) for p in candidate.parameters)
        parts.append(f"{candidate.effect.missing} ({candidate.name}, {sizes})")
    what = " and ".join(parts)
    it = "it explains" if len(best.candidates) == 1 else "together they explain"
    left = ""
    if named.verdict is Verdict.NAMED_WITH_REMAINDER:
        kinds = dict.fromkeys(c.family.replace("_", " ") for c in best.candidates)
        what = f"something that acts nearly like {what}"
        left = (
            f", and leave{'s' if len(parts) == 1 else ''} {_remainder(named)}: another effect, of"
            f" this kind ({', '.join(kinds)}) or one that resembles it"
        )
    return (
        f"Missing: {what}; {it} {100.0 * named.explained:.0f} % of the gap{left};"
        f" held-out RMS{_levels(gaps, repaired=True)}"
    )


def _remainder(named: Named) -> str:
    """What the best model leaves, for a reader who wonders whether it is chance."""
    lack = named.lack
    if lack is None or not lack.found:
        return f"{named.remainder:.2g} noise floors"
    return f"{lack.size:.2g} noise floors that all repeats share (p = {lack.p_value:.1g})"


def _levels(gaps: Sequence[ChannelGap], *, repaired: bool) -> str:
    before = ratio_to_floor(gaps, repaired=False)
    if not np.isfinite(before):
        return ""
    if not repaired:
        return f" (RMS {before:#.3g} times the noise floor)"
    after = ratio_to_floor(gaps, repaired=True)
    return f" {before:#.3g} times the noise floor before and {after:#.3g} after the repair"


def _ambiguous(found: Diagnosis, best: Trialled) -> str:
    models = (best, *found.named.tied)
    told = [
        f"{' and '.join(c.effect.missing for c in m.candidates)} ({' + '.join(m.names)})"
        for m in models
    ]
    choice = " or ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)
    text = f"Ambiguous: something is missing, and these data do not tell whether it is {choice}"
    following = found.next_experiment
    if following is None:
        return f"{text}; to tell: {best.candidates[0].effect.separating}"
    return (
        f"{text}; recording {following.protocol} would decide ({MENU[following.protocol].shows}):"
        f" it sets them {following.after:.2g} noise floors apart, these data {following.before:.2g}"
    )


def _resemblance(found: Diagnosis) -> str:
    best = found.named.best
    if best is not None:
        share = 100.0 * found.named.explained
        return f"; {' + '.join(best.names)} resembles it most, with {share:.0f} % of the gap"
    seen = [one for one in found.screened if one.likeness > 0.0]
    if not seen:
        return ""
    nearest = max(seen, key=lambda one: one.likeness)
    return f"; {nearest.candidate.name} resembles it most (cosine {nearest.likeness:.2f})"


def _place(found: Diagnosis) -> str:
    if not found.cells:
        return ""
    worst = found.cells[0]
    return f"; it is largest in {worst.channel.replace('_', ' ')} of {worst.protocol}"


def _why_not(found: Diagnosis) -> str:
    if found.floor.repeats < 2:
        reason = (
            "a protocol has no repeats, so that noise cannot be told from a gap; record every input"
            " three times or more"
        )
    else:
        reason = (
            f"on held-out trials the simulation is off by {found.named.remainder:.2g} noise floors,"
            " and too few of them repeat each other to tell that from chance; record every input"
            " three times or more"
        )
    best = found.named.best
    if best is None:
        return reason
    missing = " and ".join(EFFECTS[n].missing if n in EFFECTS else n for n in best.names)
    return f"{reason}. What looks most like it: {missing} ({' + '.join(best.names)})"
