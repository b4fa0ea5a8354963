"""What is written of an effect that was found: how deep its name holds, its size, its rivals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from pamsim.comparison.links import in_links
from pamsim.core.digits import significant_digits
from pamsim.core.encoding import json_property
from pamsim.core.units import common_unit, to_si
from pamsim.diagnosis.physical_size import PhysicalSize
from pamsim.effects.catalog import FAMILIES


@dataclass(frozen=True, kw_only=True)
class SizeEntry:
    """A parameter of an effect; the ends of its intervals are infinite where it is not known."""

    value: float
    interval95: tuple[float, float]
    unit: str  # of both, that of the rig's file
    value_si: float  # the same in SI units
    interval95_si: tuple[float, float]
    unit_si: str


@dataclass(frozen=True, kw_only=True)
class RivalEntry:
    """Another effect in the place of one."""

    effect: str  # with its form
    family: str  # its own
    missing: str  # what a model without it is missing, as the end of a sentence
    worse: float  # by how much it predicts worse, in the variance of the noise
    p_value: float  # of one that predicts as well
    ties: bool  # whether it may be the cause


@dataclass(frozen=True, kw_only=True)
class InsteadEntry:
    """A number of the rig that may be off instead of an effect, in ``unit``."""

    parameter: str  # of the rig
    unit: str  # of both values
    stated: float  # value of the rig
    value: float  # without the effect
    share: float  # of what the effect would take away that this number does

    @json_property
    def sentence(self) -> str:
        """How far it would be off, and what to do about it."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"Or {self.parameter} is {self.value:.3g}{unit} instead of {self.stated:.3g}, which"
            f" explains {100.0 * self.share:.0f} % of this effect: measure this number, then leave"
            " it out of --nuisance."
        )


@dataclass(frozen=True, kw_only=True)
class EffectEntry:
    """An effect that was found.

    Attributes:
        effect: with its form and place.
        name: of the effect, without either.
        form: the formula, where there are several; else empty.
        place: joint or muscle, or part of the chain, as the end of a sentence.
        family: its cause.
        level: deepest level of its name that is certain; empty if not even the place is.
        certain: each level -> whether it is.
        exact: whether repeats show that nothing but noise is left in its links.
        left: share of the gap in its links that is left there.
        links: in which it is seen.
        share: of what the rig leaves in them.
        p_value: of an effect that is not there.
        missing: what a model without it is missing, as the end of a sentence.
        sizes: parameter -> value; the one that measures the effect first.
        physical: its size in terms that do not depend on the form, as quantity -> size.
        rivals: the nearest first.
        instead: number of the rig that may be off instead, of an effect that is not certain.
        upstream: effect before the sensors that may be the cause of this and of another sensor's
            error; empty for none.
        measured_by: parameters that measure it, without the shape of its formula; the first of
            ``sizes`` if none is given.
    """

    effect: str
    name: str
    form: str
    place: str
    family: str
    level: str
    certain: Mapping[str, bool]
    exact: bool
    left: float
    links: tuple[str, ...]
    share: float
    p_value: float
    missing: str
    sizes: Mapping[str, SizeEntry]
    physical: Mapping[str, PhysicalSize] = field(default_factory=dict[str, PhysicalSize])
    rivals: tuple[RivalEntry, ...]
    instead: InsteadEntry | None = None
    upstream: str = ""
    measured_by: tuple[str, ...] = ()

    @json_property
    def certain_words(self) -> str:
        """What is certain of it, in a few words: as deep as its name holds."""
        match self.level:
            case "form":
                return self.missing
            case "name":
                return self.name.replace("_", " ")
            case "family":
                return FAMILIES.get(self.family, self.family.replace("_", " "))
            case "place":
                return f"something at {self.place}"
            case _:
                return f"something {in_links(self.links)}"

    @json_property
    def sentence(self) -> str:
        """What is certain of it, its size, and the nearest formula."""
        parameters = {name: sized(name, size) for name, size in self.sizes.items()}
        certain = f"Certain: {self.certain_words}"
        if self.level == "form":
            return f"{certain} ({self.effect}), {', '.join(parameters.values())}."
        # Where no repeats show it, a formula may be exact that is not known to be.
        close = self.exact or self.left <= 0.0
        exact = "" if close else f", not exact: {100.0 * self.left:.2g} % left"
        # Of dry friction that grows at rest, all may be in what grows.
        own = [parameters[name] for name in self.measured_by or [*parameters][:1]]
        nearest = f"Nearest formula: {self.effect}, {', '.join(own)}{exact}."
        if self.level:
            physical = "" if self.level == "place" else _physical(self.physical)
            return f"{certain}{physical}. {nearest}"
        sentences = [f"Not certain in its place: {self.certain_words}. {nearest}"]
        if self.instead is not None:
            sentences.append(self.instead.sentence)
        if self.upstream:
            sentences.append(
                f"One cause before the sensors, such as {self.upstream}, may explain it and the"
                " other sensor's error."
            )
        return " ".join(sentences)


@dataclass(frozen=True, kw_only=True)
class SuspectEntry:
    """An effect that fits what was fitted, where none is certain."""

    effect: str  # with its form and place
    missing: str  # what a model without it is missing, as the end of a sentence
    # Parameter -> value, if it is the cause; the one that measures the effect first
    sizes: Mapping[str, SizeEntry]

    @property
    def sentence(self) -> str:
        """Its size, as a condition."""
        name, size = next(iter(self.sizes.items()))
        return f"If it is {self.missing}: {sized(name, size)} ({self.effect})."


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
        return f", {sized(name, shown)}"
    return ""


def sized(name: str, one: SizeEntry | PhysicalSize) -> str:
    """A fitted parameter as text, such as ``leak conductance 1.98 [1.92, 2.07] mm^3/(s*kPa)``."""
    label = name.rpartition(".")[2].replace("_", " ")
    ends = one.interval95
    known = ends is not None and all(map(math.isfinite, ends))
    digits = significant_digits(one.value, ends if known else None)
    text = f"{label} {one.value:.{digits}g}"
    if ends is not None and known:
        text += f" [{', '.join(f'{end:.{digits}g}' for end in ends)}]"
    return text if one.unit == "1" else f"{text} {one.unit}"
