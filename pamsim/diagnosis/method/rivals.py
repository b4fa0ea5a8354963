"""Models of recordings that predict as well as the best one, and which of them the data reject."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.evidence import compare_trials
from pamsim.diagnosis.method.lack_of_fit import LackOfFit
from pamsim.diagnosis.method.refit import Refit
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.diagnosis.method.verdict_thresholds import (
    RIVAL_FITS,
    RIVAL_REJECTED,
    SAME_SIGNATURE,
    SAME_SIGNATURE_LOSS,
    TIE_ERRORS,
    TIE_LOSS,
    TIE_SHARE,
)

Similarity = Callable[[str, str], float]
"""Labels of two effects to the similarity of their signatures."""


def tied_with(
    best: TrialModel,
    others: Sequence[TrialModel],
    layout: TrialLayout,
    similarity: Similarity,
    *,
    wrong_by: float = 0.0,
) -> tuple[TrialModel, ...]:
    """Models that predict as well as the best, or whose effect has the same signature.

    A best model whose formula is wrong cannot reject another that is wrong by as much again.

    Args:
        best: the model of least held-out loss.
        others: models with as many effects.
        layout: of the trials.
        similarity: of the signatures of two effects.
        wrong_by: loss that the best model leaves for certain; 0 if it fits.
    """
    tied: list[TrialModel] = []
    for other in others:
        if set(other.names) == set(best.names) or not other.all_present():
            continue
        behind = compare_trials(other.loss, best.loss, layout.protocol_of)
        near = behind.gain < max(TIE_ERRORS * behind.error, TIE_LOSS, wrong_by)
        label = {c.name: c.label for c in (*best.candidates, *other.candidates)}
        different = [label[name] for name in set(other.names) ^ set(best.names)]
        same = len(different) == 2 and similarity(*sorted(different)) > SAME_SIGNATURE
        close = behind.gain < SAME_SIGNATURE_LOSS * best.improvement.gain
        explains = other.improvement.gain > TIE_SHARE * best.improvement.gain
        if explains and (near or (same and close)):
            tied.append(other)
    return tuple(tied)


def reject_rivals(
    best: TrialModel,
    tied: Sequence[TrialModel],
    lack_of_fit: Callable[[Refit], LackOfFit],
) -> tuple[TrialModel, tuple[TrialModel, ...], LackOfFit]:
    """The best model and its rivals, without those that show lack of fit where another does not.

    Held-out losses know a remainder no better than the noise floor is known; lack of fit does.

    Returns:
        The best model left, the models tied with it, and the best one's lack of fit.
    """
    tests = {model.names: lack_of_fit(model.fit) for model in (best, *tied)}
    if all(lack.p_value <= RIVAL_FITS for lack in tests.values()):
        return best, tuple(tied), tests[best.names]
    kept = [m for m in (best, *tied) if tests[m.names].p_value >= RIVAL_REJECTED]
    return kept[0], tuple(kept[1:]), tests[kept[0].names]


def shared_names(models: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Effects that are in every one of some models."""
    if not models:
        return ()
    return tuple(name for name in models[0] if all(name in names for names in models))
