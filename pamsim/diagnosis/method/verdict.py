"""From fitted models to a verdict: one name, a family, a set, unexplained, or no gap."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.evidence import compare
from pamsim.diagnosis.method.judge import Trialled
from pamsim.diagnosis.method.lack_of_fit import LackOfFit

TIE_ERRORS = 2.0
"""Standard errors within which another model predicts as well."""

TIE_FLOOR = 0.002
"""Difference of losses, in floors, that never separates two models."""

SAME_SIGNATURE = 0.95
"""Cosine from which losses do not tell two effects apart; what one of them leaves may."""

ADEQUATE = 0.95
"""Share of the gap that a name must explain: what explains less only resembles what is missing."""

REMAINDER_FLOOR, SMALL_REMAINDER = 0.02, 0.1
"""Remainders, in floors: one that is left alone, and one beyond which a name comes with it."""

RIVAL_LACKS, BEST_FITS = 0.01, 0.1
"""p-values of lack of fit: a rival below the first is out if another model is above the second."""

UNPROVEN = 0.5
"""Excess, in floors, from which too few repeats to prove a gap are no proof that there is none."""


class Verdict(StrEnum):
    """What a diagnosis ends with."""

    NO_GAP = "no_gap"
    """The base model predicts the held-out trials as well as their noise allows."""
    NAMED = "named"
    """One effect, or one set of effects, is missing."""
    NAMED_WITH_REMAINDER = "named_with_remainder"
    """An effect explains nearly all, but what it leaves is no chance: the truth acts like it."""
    AMBIGUOUS = "ambiguous"
    """Something is missing; the data do not tell which of several effects it is."""
    UNEXPLAINED = "unexplained"
    """Something is missing that no known effect explains."""
    NOT_IDENTIFIABLE = "not_identifiable"
    """The recording cannot carry a verdict: there is a gap, and too few repeats to tell."""


@dataclass(frozen=True, kw_only=True)
class Named:
    """The verdict and what it rests on.

    Attributes:
        verdict: see `Verdict`.
        best: model with the claimed effects; None if nothing is claimed or resembled.
        tied: other models that predict as well, the base model not among them.
        explained: share of the base model's excess over the floor that the best model removes.
        remainder: excess that it leaves, in floors.
        lack: what repeats share that the best model does not predict; None without one.
    """

    verdict: Verdict
    best: Trialled | None
    tied: tuple[Trialled, ...]
    explained: float
    remainder: float
    lack: LackOfFit | None


def floor_loss(layout: TrialLayout, floor: NoiseFloor, trials: Sequence[str]) -> dict[str, float]:
    """Loss of a perfect model on each trial: its protocol's own noise."""
    found: dict[str, float] = {}
    for trial in trials:
        parts = [
            floor.variance.get((p.block.channel, p.block.protocol), floor.sd[p.block.channel] ** 2)
            / floor.sd[p.block.channel] ** 2
            for p in layout.places
            if p.block.trial == trial
        ]
        found[trial] = float(np.mean(parts))
    return found


def tied_with(
    best: Trialled,
    others: Sequence[Trialled],
    layout: TrialLayout,
    alike: Callable[[str, str], float],
) -> tuple[Trialled, ...]:
    """Models that predict as well as the best, or whose effect cannot be told from its own.

    Args:
        best: the model of least held-out loss.
        others: models with as many effects.
        layout: of the trials.
        alike: cosine between the signatures of two effects.
    """
    found: list[Trialled] = []
    for other in others:
        if other.names == best.names:
            continue
        behind = compare(other.loss, best.loss, layout.protocol_of)
        near = behind.gain < max(TIE_ERRORS * behind.error, TIE_FLOOR)
        different = set(other.names) ^ set(best.names)
        same = len(different) == 2 and alike(*sorted(different)) > SAME_SIGNATURE
        explains = other.gain.gain > 0.5 * best.gain.gain
        if explains and (near or (same and behind.gain < 0.1 * best.gain.gain)):
            found.append(other)
    return tuple(found)


def name(
    layout: TrialLayout,
    floor: NoiseFloor,
    base_loss: Mapping[str, float],
    models: Sequence[Trialled],
    tried: int,
    alike: Callable[[str, str], float],
    lack_of_fit: Callable[[Trialled], LackOfFit],
    *,
    gap_seen: bool,
) -> Named:
    """Name what is missing.

    Args:
        layout: of the trials.
        floor: of the noise.
        base_loss: held-out trial -> loss of the base model.
        models: with effects, fitted; sets of effects only where they have earned their place.
        tried: single effects that were judged by the held-out trials.
        alike: cosine between the signatures of two effects.
        lack_of_fit: what a model leaves that repeats share.
        gap_seen: whether something else than these models shows a gap, such as a where-map.
    """
    perfect = floor_loss(layout, floor, layout.trials(held_out=True))
    excess = compare(base_loss, perfect, layout.protocol_of)
    able = [m for m in models if m.accepted(tried)]
    if not able:
        gap = gap_seen or (excess.p_value < 1e-3 and excess.gain > 5.0 * REMAINDER_FLOOR)
        unproven = Verdict.NOT_IDENTIFIABLE if excess.gain > UNPROVEN else Verdict.NO_GAP
        return Named(
            verdict=Verdict.UNEXPLAINED if gap else unproven,
            best=None,
            tied=(),
            explained=0.0,
            remainder=excess.gain,
            lack=None,
        )
    most = max(len(m.candidates) for m in able)
    best = min((m for m in able if len(m.candidates) == most), key=lambda m: m.mean_loss)
    rivals = [m for m in models if len(m.candidates) == most]
    best, tied, lack = _fitting(best, tied_with(best, rivals, layout, alike), lack_of_fit)
    left = compare(best.loss, perfect, layout.protocol_of)
    large = left.gain > max(3.0 * left.error, REMAINDER_FLOOR)
    explained = best.gain.gain / (best.gain.gain + max(left.gain, 0.0)) if large else 1.0
    if explained < ADEQUATE:
        verdict = Verdict.UNEXPLAINED
    elif tied:
        verdict = Verdict.AMBIGUOUS
    elif lack.found or (large and left.gain > SMALL_REMAINDER):
        verdict = Verdict.NAMED_WITH_REMAINDER
    else:
        verdict = Verdict.NAMED
    return Named(
        verdict=verdict,
        best=best,
        tied=tied,
        explained=explained,
        remainder=left.gain,
        lack=lack,
    )


def _fitting(
    best: Trialled, tied: Sequence[Trialled], lack_of_fit: Callable[[Trialled], LackOfFit]
) -> tuple[Trialled, tuple[Trialled, ...], LackOfFit]:
    """The best model and its rivals, without those that lack what another one of them does not.

    Held-out losses know a remainder no better than the noise floor is known; lack of fit does.
    """
    lacks = {model.names: lack_of_fit(model) for model in (best, *tied)}
    if all(lack.p_value <= BEST_FITS for lack in lacks.values()):
        return best, tuple(tied), lacks[best.names]
    kept = [m for m in (best, *tied) if lacks[m.names].p_value >= RIVAL_LACKS]
    return kept[0], tuple(kept[1:]), lacks[kept[0].names]
