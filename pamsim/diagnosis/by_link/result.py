"""Result of a diagnosis link by link: JSON-safe, and as lines for a screen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.core.encoding import json_property
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.judge import ALPHA, Judged
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.effects.effect import LINKS
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig

SCHEMA = "pamsim-link-diagnosis/1"


@dataclass(frozen=True, kw_only=True)
class LinkEntry:
    """One link, in the trials, or parts of trials, that no fit has seen.

    Attributes:
        link: its name.
        before: mean square of what the rig leaves, in the variance of the noise.
        after: the same with the effects that were found.
        left: part of it that repeats share.
        p_value: of a link in which nothing is left; 1 where no repeats show it.
        more_left: whether what is left is certain and material.
    """

    link: str
    before: float
    after: float
    left: float
    p_value: float
    more_left: bool


@dataclass(frozen=True, kw_only=True)
class SizeEntry:
    """A parameter of an effect.

    Attributes:
        value, interval95: in ``unit``.
        unit: of the numbers.
    """

    value: float
    interval95: tuple[float, float]
    unit: str


@dataclass(frozen=True, kw_only=True)
class RivalEntry:
    """Another effect in the place of one.

    Attributes:
        effect: with its form.
        family: its own.
        worse: by how much it predicts worse, in the variance of the noise.
        p_value: of one that predicts as well.
    """

    effect: str
    family: str
    worse: float
    p_value: float


@dataclass(frozen=True, kw_only=True)
class EffectEntry:
    """An effect that was found.

    Attributes:
        effect: with its form.
        place: link of the chain, or joint or muscle.
        family: its cause.
        level: deepest level of its name that is certain; empty if not even the place is.
        certain: each level -> whether it is.
        exact: whether repeats show that nothing but noise is left in its links.
        links: in which it is seen.
        share: of what the rig leaves in them.
        p_value: of an effect that is not there.
        missing: what a model without it is missing, as the end of a sentence.
        sizes: parameter -> value.
        rivals: the nearest first.
    """

    effect: str
    place: str
    family: str
    level: str
    certain: Mapping[str, bool]
    exact: bool
    links: tuple[str, ...]
    share: float
    p_value: float
    missing: str
    sizes: Mapping[str, SizeEntry]
    rivals: tuple[RivalEntry, ...]

    def line(self) -> str:
        """The effect as a line for a screen."""
        where = f"{100.0 * self.share:.0f} % of the gap in {' and '.join(self.links)}"
        values = "; ".join(
            f"{name} = {one.value:.4g} [{one.interval95[0]:.4g}, {one.interval95[1]:.4g}]"
            f" {one.unit}".rstrip()
            for name, one in self.sizes.items()
        )
        nearest = f"nearest formula {self.effect}"
        heads = {
            "form": f"certain: {self.missing} ({self.effect})",
            "name": f"certain: {self.missing} ({nearest})",
            "family": f"certain: {self.family.replace('_', ' ')} ({nearest})",
            "place": f"certain: something at {self.place} ({nearest})",
            "": f"something is there, its place is not certain ({nearest})",
        }
        return f"{heads[self.level]}, {where}; {values}"


@dataclass(frozen=True, kw_only=True)
class LinkReport:
    """What a diagnosis link by link has found.

    Attributes:
        rig: its name.
        links: from the command on.
        effects: that are there, the largest first.
        notes: what it rests on, if that is not repeats and whole trials.
        alpha: level of all tests.
    """

    rig: str
    links: tuple[LinkEntry, ...]
    effects: tuple[EffectEntry, ...]
    notes: tuple[str, ...] = ()
    alpha: float = ALPHA

    @json_property
    def schema(self) -> str:
        """Schema of the JSON."""
        return SCHEMA

    @json_property
    def verdict(self) -> Verdict:
        """The result in one word."""
        left = any(one.more_left for one in self.links)
        levels = {one.level for one in self.effects}
        if not levels:
            return Verdict.UNEXPLAINED if left else Verdict.NO_GAP
        if "" in levels:
            return Verdict.UNEXPLAINED
        if left and "place" not in levels:
            return Verdict.NAMED_WITH_REMAINDER
        return Verdict.NAMED if levels <= {"name", "form"} else Verdict.AMBIGUOUS

    def lines(self) -> list[str]:
        """The result as lines for a screen."""
        lines = [f"{'link':28s}{'before':>10s}{'after':>10s}   [variance of the noise]"]
        for one in self.links:
            left = "   more than noise is left" if one.more_left else ""
            lines.append(f"{one.link:28s}{one.before:10.4g}{one.after:10.4g}{left}")
        lines += [one.line() for one in self.effects]
        if not self.effects:
            lines.append("no effect predicts what no fit has seen better")
        return lines + [f"note: {text}" for text in self.notes]


def report(rig: Rig, found: LinkDiagnosis) -> LinkReport:
    """The result of `pamsim.diagnosis.by_link.diagnose_links.diagnose_links`.

    Args:
        rig: that was diagnosed.
        found: what was found.
    """
    return LinkReport(
        rig=rig.name,
        links=tuple(
            LinkEntry(
                link=link.name,
                before=found.before[link],
                after=found.after[link],
                left=found.remainders[link].excess,
                p_value=found.remainders[link].p_value,
                more_left=found.remainders[link].counts(ALPHA),
            )
            for link in found.links
        ),
        effects=tuple(_effect(rig, found, one) for one in found.effects),
        notes=found.notes,
    )


def _effect(rig: Rig, found: LinkDiagnosis, one: Judged) -> EffectEntry:
    effect = one.effect.effect
    sizes: dict[str, SizeEntry] = {}
    for parameter in one.effect.parameters:
        own, known = rig_parameter(rig, parameter.name), found.sizes[parameter.name]
        interval = readable_interval(own, known.interval95)
        assert interval is not None
        sizes[own.name] = SizeEntry(
            value=readable(own, known.value), interval95=interval, unit=readable_unit(own)
        )
    return EffectEntry(
        effect=effect.label,
        place=effect.place or LINKS[effect.link],
        family=effect.family,
        level=one.level(),
        certain=one.certain(),
        exact=one.exact,
        links=tuple(link.name for link in found.links if link in one.links),
        share=one.share,
        p_value=one.p_value,
        missing=effect.missing,
        sizes=sizes,
        rivals=tuple(
            RivalEntry(
                effect=rival.effect.label,
                family=rival.effect.family,
                worse=rival.excess,
                p_value=rival.p_value,
            )
            for rival in one.rivals
        ),
    )
