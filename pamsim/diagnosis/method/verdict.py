"""The verdict of a diagnosis: one rule for recordings, tables at rest and loops."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from pamsim.diagnosis.method.verdict_thresholds import ADEQUATE, MOST


class Verdict(StrEnum):
    """What a diagnosis concludes."""

    NO_GAP = "no_gap"
    """The base model predicts held-out data as well as their noise allows."""
    NAMED = "named"
    """One effect, or one set of effects, is missing."""
    NAMED_WITH_REMAINDER = "named_with_remainder"
    """An effect explains nearly all, but its remainder is significant, so that the cause resembles
    it, or too few repeats share inputs to test for one."""
    AMBIGUOUS = "ambiguous"
    """Something is missing; the data cannot decide which of several effects it is."""
    UNEXPLAINED = "unexplained"
    """Something is missing that no known effect explains."""
    NOT_IDENTIFIABLE = "not_identifiable"
    """The data cannot carry a verdict: there is a gap, and too few repeats or rows to judge it."""

    @property
    def claims(self) -> bool:
        """Whether effects are claimed, so that one repair follows."""
        return self in (Verdict.NAMED, Verdict.NAMED_WITH_REMAINDER)

    @property
    def repairs(self) -> bool:
        """Whether the best model closes the gap, be it the only one that does or not."""
        return self.claims or self is Verdict.AMBIGUOUS


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a verdict rests on.

    Attributes:
        claimed: whether an effect improves held-out predictions significantly, by a known size.
        gap: whether the base model misses something for certain, whatever effects achieve.
        suspected: whether the base model misses much, although too little data can prove it.
        conclusive: whether there are enough repeats or rows for any verdict but `NO_GAP`.
        explained: share of what the base model misses that the best model removes, in [0, 1].
        effects: number of effects in the best model, each with a formula of its own.
        remainder: whether what the best model leaves is significant.
        large_remainder: whether the remainder is so large, or so certain, that a name needs it
            said.
        untested: whether too few repeats share inputs to show a remainder of any size.
        strained: whether the best model needs a parameter at the end of its range, or a nuisance
            parameter far from what the rig states.
        rare: whether the best model needs an effect that is tried only where the usual ones leave a
            remainder.
        tied: whether another effect predicts held-out data as well as the best.
    """

    claimed: bool
    gap: bool
    suspected: bool = False
    conclusive: bool = True
    explained: float = 0.0
    effects: int = 1
    remainder: bool = False
    large_remainder: bool = False
    untested: bool = False
    strained: bool = False
    rare: bool = False
    tied: bool = False


def decide(evidence: Evidence) -> Verdict:
    """Reach the verdict: the one rule for every kind of data.

    A model that goes to its limits and still leaves something stands for what is missing, whatever
    share of the gap it takes: a large gap is nearly closed by much that is not its cause. So does
    a rare effect by itself: tried because something was left, it must leave nothing. Both must
    explain nearly all even where the data cannot show that they leave something. The formula of
    each effect may be off, so that two may leave twice what one may, but not with a rare one among
    them; three take the edge off anything, and may leave no more. What explains less than half is
    not what is missing, however little the data show of the rest.
    """
    if not evidence.claimed and not evidence.gap:
        return Verdict.NOT_IDENTIFIABLE if evidence.suspected else Verdict.NO_GAP
    if not evidence.conclusive:
        return Verdict.NOT_IDENTIFIABLE
    left = evidence.remainder or evidence.large_remainder
    formulas = 1 if evidence.rare else min(evidence.effects, 2)
    nearly_all = 1.0 - formulas * (1.0 - ADEQUATE)
    enough = nearly_all if left or evidence.rare or evidence.strained else MOST
    short = evidence.explained < enough
    stands_in = left and (evidence.strained or (evidence.rare and evidence.effects == 1))
    if not evidence.claimed or short or stands_in:
        return Verdict.UNEXPLAINED
    if evidence.tied:
        return Verdict.AMBIGUOUS
    reserved = evidence.large_remainder or evidence.untested
    return Verdict.NAMED_WITH_REMAINDER if reserved else Verdict.NAMED
