"""What a judgement finds of an effect, and how deep its name holds.

A name has four levels: place, family, effect, form (`Effect.levels`). The gain of an effect is the
mean square of the held-out rows of its links that the model takes away with it and not without;
what is left is what repeats still share beside the whole model. A level is certain if every rival
that differs in it predicts worse, and if

- there is something: the effect predicts better than none, in links that miss more than noise;
- it is within its range: one that fits at an end of a parameter's range stands for another effect;
- little is left: the gain is nine tenths of itself and what is left (`EXPLAINED`). Beside others in
  its links, whose formulas may be wrong, it is twice what is left, and with them takes away nine
  tenths (`BESIDE_OTHERS`). What other formulas of the families found take away counts as explained;
- it is no error of another formula: in its links, the gain is above a tenth of what an effect takes
  away whose formula is inexact, and all of what a larger one does whose own place is not certain;
- it is larger than what is left for certain, and twice what is left but may be noise, or is too
  little to count (`BESIDE_OTHERS`);
- it is not one of a series: four effects in a link (`SERIES`) are rather one that was not tried,
  unless one takes away twice what all others do;
- no cause comes before it: inexact errors of two sensors may be one delay before both.

The effect's name is certain if next to nothing is left beside its gain (`NAMED`), its form if
nothing is. Of two of a family at one place, one may be what the formula of the other misses: only
one that takes away twice as much has a certain name.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pamsim.comparison.candidate import Candidate
from pamsim.comparison.links import Link
from pamsim.diagnosis.by_link.limits import USUAL, Difference, Limits
from pamsim.diagnosis.by_link.link_fit import LinkModel
from pamsim.effects.catalog import EFFECTS
from pamsim.inference.criteria import TIE

LEVELS = ("place", "family", "name", "form")

EXPLAINED = 0.9
"""Share of what an effect takes away and what is then left for certain, from which its place and
family may be certain. Of training cases in which anything was left the right family took away 0.9
and more in 17 of 29; the nearest of another, where the right one was not tried, in 3 of 28."""

BESIDE_OTHERS = 2.0
"""Multiple of what is left that an effect must take away beside others with which it explains
`EXPLAINED` of its links: a formula's error of a tenth of a larger effect's amplitude leaves as much
as a small effect does. In training cases none of 7 that took away so much had the wrong family; of
3 that took away less, one had. An effect must take away as much beside what is left and too
little to count, too: in two draws of training cases 11 of 33 wrong effects took away less, and 9 of
480 others. Nor is one that takes away less than is left for certain, whatever shares that with it:
it may be a part of what has no name."""

NAMED = 0.99
"""Share of what an effect takes away and is then left, from which its name may be certain although
something is left: a formula's error of a tenth of its amplitude. In training cases all 8 effects
that took away so much had the right name; of 10 that took away from 0.98 on, two had another's."""

SERIES = 4
"""Effects that a link needs together, from which they may be the series of one that was not tried.
In each of the 7 training cases that needed so many something else was hidden, and no more than two
of them were right. Those that took away `BESIDE_OTHERS` times what all others in their links did
had the right family."""


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Another effect in the place of one."""

    effect: Candidate  # which
    model: LinkModel  # fitted with it
    worse: Difference  # by how much it predicts worse

    def ties(self) -> bool:
        """Whether it may be the cause instead."""
        return not self.worse.certain

    def preferred_to(self, model: LinkModel) -> bool:
        """Whether it takes the effect's place in a model.

        A better fit alone may be to something else in the same links, and lose the effect.
        """
        return self.model.criterion <= model.criterion - TIE and self.worse.gain <= 0.0


@dataclass(frozen=True, kw_only=True)
class Instead:
    """A number of the rig that may be off instead of an effect."""

    parameter: str  # nuisance parameter, in one link
    stated: float  # value of the rig [SI]
    value: float  # that it is fitted to without the effect [SI]
    share: float  # of what the effect takes away, that the number takes away alone


@dataclass(frozen=True, kw_only=True)
class Judged:
    """An effect of a model."""

    effect: Candidate  # which
    links: frozenset[Link]  # in which it is seen
    # Fall of the mean square of these links' whitened rows in the held-out trials, beside the model
    # without it [noise variance]
    gain: float
    # Mean square of what the rig without any effect leaves there, noise taken off: of repeats what
    # they share [noise variance]
    before: float
    p_value: float  # of an effect that is not there
    rivals: tuple[Rival, ...]  # that were fitted in its place, the best first
    exact: bool  # whether repeats show that nothing but noise is left in its links
    named: bool  # whether they show that next to nothing is left there beside the gain (`NAMED`)
    # Mean square that is left there for certain, and that no other formula of the families that
    # were found takes away: of each link as far as the effect is seen in it, on the scale of the
    # gain [noise variance]
    left: float = 0.0
    # Mean square that is left there by the best estimate, on the same scale, in links in which that
    # is too little to count or may be noise [noise variance]
    uncounted: float = 0.0
    # Mean square that the formula of another effect in its links may be off by, where that leaves
    # more than noise [noise variance]
    error: float = 0.0
    # What all others take away in links where so many may be a series [noise variance]
    others: float = 0.0
    # Mean square that is left there for certain, on the scale of the gain, whatever formula of the
    # families that were found may take it away [noise variance]
    missed: float = 0.0
    at_end: bool = False  # whether a parameter lies at an end of its range, see `Candidate.at_end`
    # Whether it outweighs no other of its family at its place (`BESIDE_OTHERS`)
    second: bool = False
    # An effect before the sensors for which it and the error of another sensor are both mistaken,
    # where one of their formulas is inexact
    upstream: str = ""
    # Number of the rig that takes up most of an effect of which nothing is certain
    instead: Instead | None = None
    # Fall of the mean square of each link [noise variance]
    by_link: Mapping[Link, float] = field(default_factory=dict[Link, float])
    limits: Limits = USUAL  # from which something is certain

    @property
    def share(self) -> float:
        """Share of what the rig leaves in these links that this effect alone takes away."""
        return min(max(self.gain / self.before, 0.0), 1.0) if self.before > 0.0 else 0.0

    def certain(self) -> dict[str, bool]:
        """Which levels of the name hold."""
        own = _levels(self.effect)
        tied = [_levels(rival.effect) for rival in self.rivals if rival.ties()]
        there = self.p_value <= self.limits.alpha and min(self.gain, self.before) > 0.0
        there = there and not self.at_end and not self.upstream
        shown = {
            "name": self.named and not self.second,
            "form": self.exact and not self.second,
        }
        return {
            level: there
            and all(other[: i + 1] == own[: i + 1] for other in tied)
            and self._explains()
            and shown.get(level, True)
            for i, level in enumerate(LEVELS)
        }

    def _explains(self) -> bool:
        """Whether so little is left, and it is so large, that no error of a formula can be it."""
        beside = BESIDE_OTHERS * max(self.others, self.uncounted)
        if self.gain < max(self.error, self.missed, beside):
            return False
        if self.gain >= EXPLAINED * (self.gain + self.left):
            return True
        together = self.before - self.left >= EXPLAINED * self.before
        return self.gain >= BESIDE_OTHERS * self.left and together

    def level(self) -> str:
        """The deepest level that holds; empty if not even the place does."""
        certain = self.certain()
        return next((level for level in reversed(LEVELS) if certain[level]), "")


def beside_unknown(judged: Sequence[Judged]) -> tuple[Judged, ...]:
    """Effects in the order of their gain, none certain beside a larger one that is not.

    Where something is left beside a cause whose place is not known, nothing says that the error of
    its formula is smaller than itself. Of a family each may be what the formula of another misses,
    unless it outweighs them (`BESIDE_OTHERS`). Inexact errors of two sensors may be one cause
    before both.
    """
    found: list[Judged] = []
    for one in sorted(judged, key=lambda one: -one.gain):
        unknown = [
            taken_in(one.links, larger.by_link)
            for larger in found
            if larger.links & one.links and not larger.exact and not larger.level()
        ]
        own = _levels(one.effect)[:2]  # place and family
        kin = [o.gain for o in judged if o is not one and _levels(o.effect)[:2] == own]
        second = one.gain < BESIDE_OTHERS * max(kin, default=0.0)
        upstream = next(filter(None, (_before_both(one, other) for other in judged)), "")
        error = max([one.error, *unknown])
        found.append(replace(one, error=error, second=second, upstream=upstream))
    return tuple(found)


def taken_in(links: Collection[Link], by_link: Mapping[Link, float]) -> float:
    """Mean fall of the mean square of some links that an effect causes [noise variance]."""
    return sum(max(by_link.get(link, 0.0), 0.0) for link in links) / len(links)


def _before_both(one: Judged, other: Judged) -> str:
    """What errors of two sensors are both mistaken for, unless both formulas are exact."""
    own, its = one.effect.effect, other.effect.effect
    sensors = own.link == its.link == "sensor" and own.family != its.family
    if not sensors or (one.exact and other.exact):
        return ""
    shared = EFFECTS.keys() & set(own.look_alikes) & set(its.look_alikes)
    return min((name for name in shared if EFFECTS[name].link != "sensor"), default="")


def _levels(effect: Candidate) -> tuple[str, ...]:
    link, place, family, name, form = effect.effect.levels
    return f"{link} {place}", family, name, form
