"""The result of a diagnosis link by link: what is written, and as lines for a screen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from scipy.stats import chi2

from pamsim.comparison.compared_signal import Comparison
from pamsim.comparison.links import in_links
from pamsim.core.computation import versions
from pamsim.core.encoding import NOT_IN_JSON, fields_to_dict, json_property, write_json
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.effect_entry import EffectEntry, SuspectEntry
from pamsim.diagnosis.by_link.learned_entry import LearnedEntry
from pamsim.diagnosis.by_link.limits import ALPHA, MATERIAL
from pamsim.diagnosis.by_link.whole_chain import ChannelGap
from pamsim.diagnosis.fitted_rig import RIG_FOLDER, Repair, write_repaired_rig

SCHEMA = "pamsim-diagnosis/3"
FILE = "diagnosis.json"
_LEFT = {
    True: "   more than noise is left",
    False: "",
    None: "   more than the estimated noise is left",
}


class Verdict(StrEnum):
    """What a diagnosis concludes."""

    NO_GAP = "no_gap"
    """Nothing is missing that the data can show."""
    NAMED = "named"
    """Every effect that is missing is certain to its name."""
    NAMED_WITH_REMAINDER = "named_with_remainder"
    """The same or its family, and something is left."""
    AMBIGUOUS = "ambiguous"
    """Something is missing, not all of which is certain to its name."""
    UNEXPLAINED = "unexplained"
    """Something is missing the place of which is not certain, or that no effect tried explains."""
    UNDECIDED = "undecided"
    """More is left than the estimated noise; what is held out does not show whether it is noise."""


@dataclass(frozen=True, kw_only=True)
class LinkEntry:
    """One link, in the trials, or parts of trials, that no fit has seen, in variances of the noise.

    Attributes:
        link: its name.
        signals: kinds of signal before and behind it.
        before: mean square of what the rig leaves, its nuisance parameters refitted.
        after: the same with the effects of which at least the place is certain.
        left: part of it that repeats share; noise is none of it, and chance may make it negative.
        p_value: of a link in which nothing is left; 1 where no repeats show it.
        more_left: whether what is left is certain and material; None if it is material and no
            repeats show whether it is noise.
    """

    link: str
    signals: tuple[str, str]
    before: float
    after: float
    left: float
    p_value: float
    more_left: bool | None

    @json_property
    def floor(self) -> float:
        """Mean square of the noise."""
        return 1.0


@dataclass(frozen=True, kw_only=True)
class NuisanceEntry:
    """A parameter that was refitted with every effect, in ``unit``."""

    parameter: str  # of the rig
    unit: str  # of the values
    stated: float  # value of the rig
    by_link: Mapping[str, float]  # link -> value there
    whole: float  # value of the repaired rig, see `pamsim.diagnosis.by_link.entries`


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """What to measure next."""

    advice: str  # in words
    protocol: str | None = None  # experiment on the menu; None where only advice can be given
    shows: str = ""  # what it shows
    between: tuple[str, ...] = ()  # the two effects that it separates
    # Mean square distance of the two in the data at hand [variance of the noise]
    before: float | None = None
    after: float | None = None  # the same in a trial of that experiment
    menu: Mapping[str, float] = field(default_factory=dict[str, float])  # experiment -> the latter


@dataclass(frozen=True, kw_only=True)
class RowEntry:
    """A row of a table, its errors by fits to the others."""

    row: str  # its name
    pressure_kpa: tuple[float, ...]  # of every muscle
    load_kg: float  # on the arm
    angle_deg: float  # as measured
    before_deg: float  # simulated minus measured, nuisance parameters refitted
    after_deg: float | None  # the same with the effects that were found; None without any


@dataclass(frozen=True, kw_only=True)
class Branches:
    """The branches of a loop at the pressures that were read on both, (m,) each."""

    pressure_kpa: FloatArray  # of the levels
    rising_mm: FloatArray  # length while the pressure rises
    falling_mm: FloatArray  # length while it falls
    error_mm: FloatArray | None  # standard error of the difference; None if it is not known
    # Rising less falling length by the effects that were found; None without any
    opened_mm: FloatArray | None


@dataclass(frozen=True, kw_only=True)
class Run:
    """What was diagnosed, how, and how long it took."""

    data: tuple[str, ...]  # where the measurements are from
    held_out: tuple[str, ...]  # names of the trials that no fit has seen
    effects_tried: int  # number of effects
    skipped: Mapping[str, str]  # effect -> why it was not tried
    seed: int  # random seed
    seconds: float  # wall time


@dataclass(frozen=True, kw_only=True)
class LinkReport:
    """Where simulation and data disagree link by link, and the effects that are missing.

    Attributes:
        rig: its name.
        links: from the command on.
        effects: that are there, the largest first.
        suspected: effects that may be there where none is certain.
        learned: curves of what has no name, where something is left behind the muscles.
        gap: channel -> what the whole chain misses, from the command on.
        nuisance: parameters that were refitted.
        next_experiment: None if the question is settled.
        warnings: what a reader should know, one sentence each.
        alpha: level of all tests.
        material: fall of a link's mean square below which no effect is reported [noise variance].
        run: what was diagnosed, and how; None where it is not stated.
        repaired_rig: folder of the repaired rig once it is saved.
        rows: of a table at rest.
        branches: of a loop; None of other data.
        comparisons: measured and simulated signals for the page.
        repair: what the repaired rig is written from; None without effects.
    """

    rig: str
    links: tuple[LinkEntry, ...]
    effects: tuple[EffectEntry, ...]
    suspected: tuple[SuspectEntry, ...] = ()
    learned: tuple[LearnedEntry, ...] = ()
    gap: Mapping[str, ChannelGap] = field(default_factory=dict[str, ChannelGap])
    nuisance: tuple[NuisanceEntry, ...] = ()
    next_experiment: NextExperiment | None = None
    warnings: tuple[str, ...] = ()
    alpha: float = ALPHA
    material: float = MATERIAL
    run: Run | None = None
    repaired_rig: Path | None = None
    rows: tuple[RowEntry, ...] = ()
    branches: Branches | None = None
    comparisons: tuple[Comparison, ...] = field(default=(), repr=False, metadata=NOT_IN_JSON)
    repair: Repair | None = field(default=None, repr=False, metadata=NOT_IN_JSON)

    @property
    def at_rest(self) -> bool:
        """Whether the data are a table at rest or a loop."""
        return bool(self.rows) or self.branches is not None

    @json_property
    def verdict(self) -> Verdict:
        """The result in one word."""
        left = bool(self.remainder)
        levels = {one.level for one in self.effects}
        if not levels:
            if left:
                return Verdict.UNEXPLAINED
            return Verdict.UNDECIDED if self.undecided or self.scatter else Verdict.NO_GAP
        if levels == {""}:
            return Verdict.UNEXPLAINED
        if left and not levels & {"place", ""}:
            return Verdict.NAMED_WITH_REMAINDER
        return Verdict.NAMED if levels <= {"name", "form"} else Verdict.AMBIGUOUS

    @json_property
    def sentence(self) -> str:
        """The result in words."""
        return _sentence(self)

    @json_property
    def alternatives(self) -> dict[str, tuple[str, ...]]:
        """Effect -> its rivals that may be the cause instead."""
        tied = {e.effect: tuple(r.effect for r in e.rivals if r.ties) for e in self.effects}
        return {effect: rivals for effect, rivals in tied.items() if rivals}

    @json_property
    def remainder(self) -> dict[str, float]:
        """Link -> what is certainly left in it [variance of the noise]."""
        return {one.link: one.left for one in self.links if one.more_left}

    @property
    def undecided(self) -> dict[str, float]:
        """Link -> what is left and may be noise all the same [variance of the noise]."""
        return {one.link: one.left for one in self.links if one.more_left is None}

    @property
    def scatter(self) -> dict[str, ChannelGap]:
        """Readings at rest that are missed by more than the noise that is known of them.

        Without repeats, what no effect predicts may be scatter, or be missing. None of recordings,
        and none where points were read twice on average: what is left of both is compared.
        """
        points = {(one.pressure_kpa, one.load_kg) for one in self.rows}
        count = len(self.rows) if self.branches is None else self.branches.pressure_kpa.size
        if not count or 2 * len(points) <= len(self.rows) > 0:
            return {}
        most = math.sqrt(float(chi2.isf(self.alpha, count)) / count)
        return {
            channel: gap
            for channel, gap in self.gap.items()
            if gap.before is not None and (gap.floor is None or gap.before > most * gap.floor)
        }

    def summary(self) -> str:
        """The result in words."""
        return self.sentence

    def to_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, schema ``pamsim-diagnosis/3``."""
        return {"schema": SCHEMA, **fields_to_dict(self), "versions": versions("scipy")}

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``diagnosis.json`` and, where effects were found, the repaired rig.

        Args:
            folder: created if need be.

        Returns:
            The paths written.

        Raises:
            InputError: if the folder cannot be written.
        """
        folder = Path(folder)
        rig = None
        if self.repair is not None:
            rig = write_repaired_rig(self.repair, folder / RIG_FOLDER, self.sentence)
        write_json(folder / FILE, replace(self, repaired_rig=rig).to_dict())
        return [folder / FILE, *([] if rig is None else [rig])]

    def lines(self) -> list[str]:
        """The result as lines for a screen, without its sentence."""
        skipped = {} if self.run is None else self.run.skipped
        lines = [f"not tried: {name}: {why}" for name, why in skipped.items()]
        lines.append(f"{'link':28s}{'before':>10s}{'after':>10s}   [variance of the noise]")
        for one in self.links:
            left = _LEFT[one.more_left]
            lines.append(f"{one.link:28s}{one.before:10.4g}{one.after:10.4g}{left}")
        if self.gap:
            what = "readings left out, RMS" if self.at_rest else "whole chain, RMS"
            lines.append(f"{what:28s}{'before':>10s}{'after':>10s}{'noise':>10s}")
        for channel, gap in self.gap.items():
            numbers = (gap.before, gap.after, gap.floor)
            cells = "".join(f"{'-' if v is None else f'{v:.4g}':>10s}" for v in numbers)
            lines.append(f"{f'{channel} [{gap.unit}]':28s}{cells}")
        for one in self.effects:
            share = f"{100.0 * one.share:.0f} % of the gap {in_links(one.links)}"
            lines.append(f"{one.effect}: {share}")
            for name, size in one.sizes.items():
                low, high = size.interval95
                unit = "" if size.unit == "1" else f" {size.unit}"
                lines.append(f"  {name:38s}{size.value:10.4g}  [{low:.4g}, {high:.4g}]{unit}")
            tied = [rival.effect for rival in one.rivals if rival.ties]
            if tied:
                lines.append(f"  may be instead: {', '.join(tied)}")
        if self.next_experiment is not None:
            following = self.next_experiment
            named = "" if following.protocol is None else f"{following.protocol}; "
            lines.append(f"next experiment: {named}{following.advice}")
        return lines


def _sentence(result: LinkReport) -> str:
    """What is missing and how certain that is, effect by effect, and what is left."""
    sentences = [one.sentence for one in result.effects]
    left = [f"{n} ({_digits(size)} of the noise variance)" for n, size in result.remainder.items()]
    if result.undecided:
        where = ", ".join(f"{name} ({_digits(size)})" for name, size in result.undecided.items())
        sentences.append(
            f"{'' if sentences else 'No effect tried is certain. '}The misfit exceeds the noise"
            f" estimate; excess over its variance: {where}. What is held out does not show whether"
            " it is slow noise or a missing effect; the warnings state what would."
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
        sentences.append(f"{more} is missing {in_links(left)}.")
    elif left:
        sentences.append(
            f"Unexplained: something is missing {in_links(left)} that no effect tried explains."
        )
    suspicions = [one.sentence for one in result.suspected]
    return " ".join([*sentences, *suspicions, *_learned(result)])


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


def _digits(size: float) -> str:
    """Two digits, and no power of ten for a large number."""
    return f"{size:.2g}" if abs(size) < 99.5 else f"{size:.0f}"


def _learned(result: LinkReport) -> list[str]:
    """What was learned of what has no name, in a sentence."""
    if not result.learned:
        return []
    first = result.learned[0]
    curves = " and ".join(
        f"{one.kind} of {one.where}" + (f", like {one.words}" * bool(one.words))
        for one in result.learned
    )
    return [
        f"Without a name: {in_links(first.links)} {_digits(first.before - 1.0)} of the noise"
        f" variance is left, {_digits(max(first.after - 1.0, 0.0))} with {curves}."
        + f" As well predict, in place of that: {'; '.join(first.tied)}."
        * bool(first.tied)
    ]
