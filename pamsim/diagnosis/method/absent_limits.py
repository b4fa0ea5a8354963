"""How large an effect that is not claimed could be without a table showing it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pamsim.diagnosis.method.verdict import Verdict
from pamsim.inference.free_parameter import FreeParameter

NOT_SHOWN = "the data do not show it at any size that was tried"
OUT_OF_RANGE = "the limit would lie outside the parameter's range"

TIED = "a model with it predicts as well as the best"
UNEXPLAINED_PART = "what the model leaves unexplained may hide it"


@dataclass(frozen=True, kw_only=True)
class AbsentLimit:
    """The largest size of an effect that the data allow beside the model.

    Attributes:
        effect: which.
        parameter: that measures its size.
        size: the limit in units of the typical size; infinite if the data cannot show it, NaN if it
            is not known.
        limit: the same as a distance of the parameter from neutral [SI].
        cannot_tell: why the limit does not hold; None where it does.
    """

    effect: str
    parameter: str
    size: float
    limit: float
    cannot_tell: str | None


def supported(
    limits: Sequence[AbsentLimit],
    verdict: Verdict,
    families: Mapping[str, str],
    models: Sequence[Sequence[str]],
) -> tuple[AbsentLimit, ...]:
    """Limits as far as the verdict supports the model that they were taken beside.

    A model that leaves something may have taken up an effect in another's name, and of effects of
    one family each takes up the others. Only a clean name, or no gap, leaves every limit, but of
    effects in a model that predicts as well.

    Args:
        limits: beside the best model and those tied with it.
        verdict: of the diagnosis.
        families: effect -> its family.
        models: names of the effects of the best model and of those that predict as well.
    """
    standing = {name: families.get(name) for names in models for name in names}

    def why(limit: AbsentLimit) -> str | None:
        if limit.cannot_tell is not None:
            return limit.cannot_tell
        if verdict not in (Verdict.NO_GAP, Verdict.NAMED, Verdict.AMBIGUOUS):
            return UNEXPLAINED_PART
        if limit.effect in standing:
            return TIED
        if verdict is not Verdict.AMBIGUOUS:
            return None
        same = [n for n, family in standing.items() if family == families.get(limit.effect)]
        return f"{same[0]} is of the same family and may stand in for it" if same else None

    return tuple(replace(limit, cannot_tell=why(limit)) for limit in limits)


def farthest(parameter: FreeParameter, neutral: float) -> float:
    """Largest distance from neutral that a parameter's range allows [SI]."""
    return max(abs(parameter.low - neutral), abs(parameter.high - neutral))
