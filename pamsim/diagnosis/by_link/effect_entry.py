"""What is written of an effect that was found: how deep its name holds, its size, its rivals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pamsim.core.encoding import json_property
from pamsim.diagnosis.by_link.sentence import certain_words, effect_sentence, instead_sentence
from pamsim.diagnosis.physical_size import PhysicalSize


@dataclass(frozen=True, kw_only=True)
class SizeEntry:
    """A parameter of an effect.

    Attributes:
        value, interval95: in ``unit``, that of the rig's file; infinite ends where it is not known.
        unit: of both.
        value_si, interval95_si: the same in ``unit_si``.
        unit_si: SI unit.
    """

    value: float
    interval95: tuple[float, float]
    unit: str
    value_si: float
    interval95_si: tuple[float, float]
    unit_si: str


@dataclass(frozen=True, kw_only=True)
class RivalEntry:
    """Another effect in the place of one.

    Attributes:
        effect: with its form.
        family: its own.
        missing: what a model without it is missing, as the end of a sentence.
        worse: by how much it predicts worse, in the variance of the noise.
        p_value: of one that predicts as well.
        ties: whether it may be the cause.
    """

    effect: str
    family: str
    missing: str
    worse: float
    p_value: float
    ties: bool


@dataclass(frozen=True, kw_only=True)
class InsteadEntry:
    """A number of the rig that may be off instead of an effect, in ``unit``.

    Attributes:
        parameter: of the rig.
        unit: of both values.
        stated: value of the rig.
        value: without the effect.
        share: of what the effect would take away that this number does.
    """

    parameter: str
    unit: str
    stated: float
    value: float
    share: float

    @json_property
    def sentence(self) -> str:
        """How far it would be off, and what to do about it."""
        return instead_sentence(self)


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

    @json_property
    def certain_words(self) -> str:
        """What is certain of it, in a few words."""
        return certain_words(self)

    @property
    def upstream_sentence(self) -> str:
        """What may be the cause of it and of another sensor's error."""
        return (
            f"One cause before the sensors, such as {self.upstream}, may explain it and the other"
            " sensor's error."
        )

    @json_property
    def sentence(self) -> str:
        """What is certain of it, its size, and the nearest formula."""
        return effect_sentence(self)


@dataclass(frozen=True, kw_only=True)
class SuspectEntry:
    """An effect that fits what was fitted, where none is certain.

    Attributes:
        effect: with its form and place.
        missing: what a model without it is missing, as the end of a sentence.
        sizes: parameter -> value, if it is the cause; the one that measures the effect first.
    """

    effect: str
    missing: str
    sizes: Mapping[str, SizeEntry]
