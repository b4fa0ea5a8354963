"""What an effect is: where it acts, the parameters that it frees, what it is mistaken for.

A rig's model contains every effect at its neutral value, where it changes nothing. Hiding an effect
moves its parameters away from there; adding one frees them.
"""

from __future__ import annotations

import dataclasses
from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import Final, Literal, cast

from pamsim.core.errors import InputError, nearest

JOINT = "{joint}"
"""Placeholder for a joint of the rig in the name of a parameter."""

TILTED = "{tilted}"
"""Placeholder for the body whose tilt sets how gravity turns the arm."""

SECOND_MUSCLE = "{second_muscle}"
"""Placeholder for the second of a rig's two muscles, or one of several."""

AT = " at "
"""Stands between the name of an effect and the joint or muscle it is bound to."""


@dataclass(frozen=True)
class EffectParameter:
    """One number of a rig that an effect frees. Cards call it by its kind, `size` to `shape`.

    Attributes:
        name: as `pamsim.engine.rig.Rig.with_parameters` takes it; it may hold a placeholder
            (`JOINT`, `TILTED`, `SECOND_MUSCLE`).
        typical: how far it lies from neutral in a typical case [SI], of either sign.
        low: smallest value a search may try [SI].
        high: largest [SI].
        neutral: value at which the effect is absent [SI]; None where that is the rig's own value,
            of a shape too if the rig itself has some of the effect.
        relative: True if ``typical``, ``low`` and ``high`` are factors of the rig's own value.
        shape: True for a number without influence while the effect is absent, such as a time
            constant; ``typical`` is then the value itself.
        starts: of a shape, further values a search begins from, as ``typical``.
        scaled_by: parameter of the rig by whose value ``typical``, ``low``, ``high`` and ``starts``
            are multiplied, such as a length that they are shares of; empty for none.
        on_slide: what ``typical``, ``low``, ``high`` and ``starts`` are multiplied by at a joint
            that slides, where a torque is a force.
        unit: SI unit that the rig's parameter must have, where other force laws use the same letter
            for another quantity; empty if any will do.
        another_size: True if the effect is there where this parameter alone is off neutral, as
            muscles may differ in stroke and not in strength.
        natural_ends: True if no rig can lie beyond the ends of the range, or data would not show
            it, so that a fit that ends there may be right; elsewhere it is a sign that the effect
            stands for another one.
    """

    name: str
    typical: float
    low: float
    high: float
    _: KW_ONLY
    neutral: float | None = 0.0
    relative: bool = False
    shape: bool = False
    starts: tuple[float, ...] = ()
    scaled_by: str = ""
    on_slide: float = 1.0
    unit: str = ""
    another_size: bool = False
    natural_ends: bool = False

    def at(self, size: float, own: float) -> float:
        """Value at a size of the effect [SI].

        Args:
            size: in units of the typical one; 0 is neutral.
            own: the rig's own value [SI].
        """
        if self.shape:
            return own if self.neutral is None and size == 0.0 else self.typical
        if self.relative:
            return own * (1.0 + size * (self.typical - 1.0))
        return (own if self.neutral is None else self.neutral) + size * self.typical

    def scaled(self, by: float) -> EffectParameter:
        """The same with its range multiplied, as by the value of ``scaled_by`` [SI]."""
        return dataclasses.replace(
            self,
            typical=by * self.typical,
            low=by * self.low,
            high=by * self.high,
            starts=tuple(by * start for start in self.starts),
        )

    def bounds(self, own: float) -> tuple[float, float]:
        """Range a search may use [SI]; for what is neutral at the rig's own value, around it."""
        if self.relative:
            return own * self.low, own * self.high
        base = own if self.neutral is None and not self.shape else 0.0
        return base + self.low, base + self.high


size = EffectParameter
"""Kind: absent at one value on every rig. As of every kind: name, typical, low, high [SI]."""

change = partial(EffectParameter, neutral=None)
"""Kind: added to the rig's own value [SI]."""

factor = partial(EffectParameter, neutral=None, relative=True)
"""Kind: the rig's own value is multiplied by it."""

shape = partial(EffectParameter, shape=True)
"""Kind: without influence while the effect is absent [SI]."""

own_shape = partial(shape, neutral=None)
"""Kind: a shape that stays at the rig's own value where the effect is absent [SI]."""

Link = Literal["command", "supply", "air", "muscle", "transmission", "joint", "sensor"]
"""A link of the chain from the command to the readings."""

LINKS: dict[Link, str] = {
    "command": "the path from the command to the valves",
    "supply": "the supply",
    "air": "the valves and the air",
    "muscle": "the muscles",
    "transmission": "the transmission between muscles and joint",
    "joint": "the joint and its load",
    "sensor": "the sensors",
}
"""Link -> where something is missing, as the end of a sentence."""

LINK_OF_GROUP: dict[str, Link] = {
    "valve": "air",
    "chamber": "air",
    "chain": "transmission",
    "tendon": "transmission",
    "friction": "joint",
    "learned": "joint",
    "joint": "joint",
    "body": "joint",
    "sensor": "sensor",
}
"""Group of a rig's parameters -> link that they act in; those of other groups act in the muscle."""

_OF_PARAMETER: Final = cast("Link", "")


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A physical effect.

    Attributes:
        name: as in diagnoses and on the command line.
        link: where in the chain it acts, one of `LINKS`; the effects of a family share it. If left
            out, where the group of its first parameter acts: the air for ``valve``.
        family: physical cause that a diagnosis names; of the effects of one family, which are its
            kinds, data of a rig that no formula describes exactly may prefer another.
        missing: what a model without it is missing, as the end of a sentence.
        equation: what it does in the model, in plain text; empty if not stated.
        parameters: what it frees, the one that measures its size first.
        look_alikes: names of effects it is mistaken for.
        separating: the experiment that distinguishes it from them.
        probes: sizes, in units of the typical one, at which its signature is taken: one small one,
            or, of an effect with a threshold, several, so that it acts at one of them.
        form: which formula this is, where the same physics has several; such forms share the name,
            and `pamsim.effects.catalog.FORMS` lists them.
        place: on a rig the only joint or muscle it acts on; empty where it acts on all, or where
            the rig has one.
        in_trials: whether recordings over time are searched for it.
        rare: whether recordings are searched for it only where the other effects leave a
            remainder, or where it is asked for by name.
        path_dependent: whether its force depends on the path, not on the present state alone.
        upstream_of_pressure: whether it acts through the pressures alone.
        crossed: whether searches begin from every combination of its shapes' starts, as where a
            wave begins matters only with its right length; else from one shape after the other.

    Raises:
        InputError: if there is no such link, with the nearest, or it frees no parameter.
    """

    name: str
    link: Link = _OF_PARAMETER  # __post_init__ puts the link there
    family: str
    missing: str
    parameters: tuple[EffectParameter, ...]
    look_alikes: tuple[str, ...]
    separating: str
    equation: str = ""
    probes: tuple[float, ...] = (0.3,)
    form: str = ""
    place: str = ""
    in_trials: bool = True
    rare: bool = False
    path_dependent: bool = False
    upstream_of_pressure: bool = False
    crossed: bool = False

    def __post_init__(self) -> None:
        """Check the link, or state that of the first parameter."""
        if not self.parameters:
            raise InputError(f"{self.name}: an effect must free at least one parameter")
        if self.link == _OF_PARAMETER:
            group = self.parameters[0].name.rpartition(":")[2].partition(".")[0]
            object.__setattr__(self, "link", LINK_OF_GROUP.get(group, "muscle"))
        elif self.link not in LINKS:
            raise InputError(f"{self.name}: no link {self.link!r}; {nearest(self.link, LINKS)}")

    @property
    def levels(self) -> tuple[str, str, str, str, str]:
        """Link, joint or muscle, family, name and form: each narrower than the one before."""
        return self.link, self.place, self.family, self.name, self.form

    @property
    def claim(self) -> str:
        """What a diagnosis names: the effect, with its place such as ``air_leak at biceps``."""
        return f"{self.name}{AT}{self.place}" if self.place else self.name

    @property
    def label(self) -> str:
        """Name, form and place, such as ``coulomb_friction:rigid at elbow``."""
        form = f":{self.form}" if self.form else ""
        return f"{self.name}{form}{AT}{self.place}" if self.place else f"{self.name}{form}"

    @property
    def invisible_at_rest(self) -> str:
        """Why tables of angles at rest cannot show it; empty if they can."""
        if self.path_dependent:
            return "depends on the path, which angles at rest do not determine"
        if self.upstream_of_pressure:
            return "acts on the pressure, which the table gives as measured"
        return ""
