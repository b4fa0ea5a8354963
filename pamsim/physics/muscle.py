"""One pneumatic actuator: the parameter groups of every law it is made of, and how it is built."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.core.parameters import ParameterGroup, Sourced, quantity, specs
from pamsim.physics.braid import Braid
from pamsim.physics.chain import Chain
from pamsim.physics.chamber import Chamber
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.friction import Friction
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Hysteresis, Operator
from pamsim.physics.hysteresis.maxwell_slip import ParallelHysteresis
from pamsim.physics.learned import Learned
from pamsim.physics.learned_tension import LearnedTension
from pamsim.physics.passive import Creep, FirstStroke, PassiveSpring, Softening
from pamsim.physics.tension import EndShape, Threshold
from pamsim.physics.valves import COMMANDS, ValvePair

Sections = Mapping[str, Mapping[str, Sourced | str]]
"""Group -> field -> number, as a rig file states them."""


class Mounting(ParameterGroup, group="mounting"):
    """How the actuator sits on its tendon."""

    length_at_zero: float = quantity(
        "[-10, 10] m",
        "muscle length where the tendon's length is zero: rest length on a fixed tendon, minus the"
        " rigid fittings on a spatial one; of a bellows or a piston the stroke there",
    )


PLAIN_GROUPS: tuple[type[ParameterGroup], ...] = (
    Mounting,
    Braid,
    Stroke,
    PassiveSpring,
    Threshold,
    EndShape,
    Creep,
    FirstStroke,
    Softening,
    ParallelHysteresis,
    Chamber,
    ValvePair,
    Chain,
    Friction,
    Learned,
    LearnedTension,
)
"""The groups of which there is one kind."""

MUSCLE_ONLY: tuple[type[ParameterGroup], ...] = (
    Braid,
    PassiveSpring,
    Threshold,
    EndShape,
    Chain,
    LearnedTension,
)
"""Groups that have no meaning for a pushing actuator."""

PUSHING_ONLY: tuple[type[ParameterGroup], ...] = (Stroke,)
"""Groups that have none for a muscle."""


def _idle(pushing: bool) -> tuple[type[ParameterGroup], ...]:
    return MUSCLE_ONLY if pushing else PUSHING_ONLY


def plain_groups(pushing: bool) -> tuple[type[ParameterGroup], ...]:
    """The groups of one kind that have a meaning for a pushing actuator, or for a muscle."""
    return tuple(group for group in PLAIN_GROUPS if group not in _idle(pushing))


def idle_groups(sections: Sections) -> frozenset[str]:
    """Names of the groups that have no meaning for an actuator with these sections."""
    law = sections.get("force", {}).get("law")
    pushing = isinstance(law, str) and law in FORCE_LAWS and FORCE_LAWS[law].pushes
    return frozenset(group.group for group in _idle(pushing))


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """A muscle, or a pushing actuator such as a bellows, with its air and its valves.

    Attributes:
        mounting: place on the tendon.
        braid: geometry of a muscle; None for a pushing actuator.
        stroke: nominal stroke and damping of a pushing actuator, or None.
        force: group of the active force law, of one of `FORCE_LAWS`.
        chamber: polytropic air.
        valve: fill and exhaust valves.
        passive: passive spring beside the active force.
        threshold: pressure lost before the braid is reached.
        end_shape: active force lost at high contraction.
        creep: relaxing element beside the muscle.
        first_stroke: force lost to strokes that go further than all before.
        softening: force lost in the course of a run.
        chain: what the muscle pulls through.
        friction: along its tendon.
        learned: force along its tendon that has no formula.
        learned_tension: tension over its contraction that has none.
        hysteresis: group of the operator on the force, or None.
        parallel_hysteresis: Maxwell slip beside it.
        command: what the control means, one of `COMMANDS`.
    """

    mounting: Mounting
    braid: Braid | None = None
    stroke: Stroke | None = None
    force: ParameterGroup
    chamber: Chamber
    valve: ValvePair
    passive: PassiveSpring = field(default_factory=PassiveSpring)
    threshold: Threshold = field(default_factory=Threshold)
    end_shape: EndShape = field(default_factory=EndShape)
    creep: Creep = field(default_factory=Creep)
    first_stroke: FirstStroke = field(default_factory=FirstStroke)
    softening: Softening = field(default_factory=Softening)
    chain: Chain = field(default_factory=Chain)
    friction: Friction = field(default_factory=Friction)
    learned: Learned = field(default_factory=Learned)
    learned_tension: LearnedTension = field(default_factory=LearnedTension)
    hysteresis: Hysteresis | None = None
    parallel_hysteresis: ParallelHysteresis = field(default_factory=ParallelHysteresis)
    command: str = "valve"

    def __post_init__(self) -> None:
        """Check the command, and that the actuator has what its force law acts on.

        Raises:
            InputError: if the command is unknown, or braid or stroke missing or without meaning.
        """
        if (self.braid is None) is not self.pushes or (self.stroke is None) is self.pushes:
            needs, without = ("stroke", "braid") if self.pushes else ("braid", "stroke")
            raise InputError(f"the force law {self.force.law!r} needs a {needs} and no {without}")
        if self.command not in COMMANDS:
            raise InputError(f"no command {self.command!r}; {nearest(str(self.command), COMMANDS)}")

    @property
    def pushes(self) -> bool:
        """Whether it may push."""
        return FORCE_LAWS.card(type(self.force)).pushes

    @property
    def braided(self) -> Braid:
        """The braid of a muscle.

        Raises:
            EngineError: if it is a pushing actuator.
        """
        if self.braid is None:
            raise EngineError(f"an actuator with the force law {self.force.law!r} has no braid")
        return self.braid

    @functools.cached_property
    def groups(self) -> tuple[ParameterGroup, ...]:
        """Its parameter groups, without those that have no meaning for it."""
        own, idle = vars(self).values(), _idle(self.pushes)
        return tuple(g for g in own if isinstance(g, ParameterGroup) and not isinstance(g, idle))


def build_muscle(
    sections: Sections,
    *,
    where: str,
    command: str = "pressure_set",
    own: Sequence[ForceLaw | Operator] = (),
) -> Muscle:
    """Make a muscle from its sections.

    Args:
        sections: group -> field -> number. ``force`` and ``hysteresis`` also carry ``law``; a
            muscle that states no hysteresis gets Bouc-Wen's without width.
        where: what to call the place in errors.
        command: what the muscle's control means, one of `COMMANDS`.
        own: laws of the rig, which count before those of the catalogs.

    Raises:
        InputError: for an unknown group, law or field, a missing field, or a wrong unit.
        ParameterError: for a value out of range.
    """
    kinds: dict[str, type[ParameterGroup]] = {group.group: group for group in PLAIN_GROUPS}
    laws: dict[str, dict[str, Any]] = {"force": {**FORCE_LAWS}, "hysteresis": {**OPERATORS}}
    for law in own:
        laws[law.group.group][law.name] = law
    groups: dict[str, ParameterGroup] = {}
    for name, stated in sections.items():
        section = dict(stated)
        if name in laws:
            chosen, known = section.pop("law", None), laws[name]
            if not isinstance(chosen, str) or chosen not in known:
                raise InputError(
                    f"{where}: {name}.law = {chosen!r} is not known; {nearest(str(chosen), known)}"
                )
            kinds[name] = known[chosen].group
        elif name not in kinds:
            raise InputError(f"{where}: unknown group {name!r}; {nearest(name, {*kinds, *laws})}")
        groups[name] = _build(kinds[name], section, where)
    pushing = "force" in groups and FORCE_LAWS.card(type(groups["force"])).pushes
    kind, body = ("pushing actuator", "stroke") if pushing else ("muscle", "braid")
    for name in ("mounting", body, "force", "chamber", "valve"):
        if name not in groups:
            raise InputError(f"{where}: a {kind} needs the group {name!r}")
    for idle in _idle(pushing):
        if idle.group in groups:
            raise InputError(
                f"{where}: the group {idle.group!r} has no meaning for a {kind}; remove it"
            )
    # Without width it changes no bit; with it, diagnoses can try hysteresis on any rig.
    groups.setdefault("hysteresis", BoucWen(**BoucWen.usual))
    return Muscle(command=command, **groups)  # pyright: ignore[reportArgumentType]


def _build(group: type[ParameterGroup], section: Mapping[str, Any], where: str) -> ParameterGroup:
    fields = dict(specs(group))
    values: dict[str, float] = {}
    for name, entry in section.items():
        if name not in fields:
            raise InputError(
                f"{where}: unknown parameter {group.group}.{name}; {nearest(name, fields)}"
            )
        if not isinstance(entry, Sourced):
            raise InputError(
                f"{where}: {group.group}.{name} = {entry!r} is a word; write"
                ' { value = ..., unit = "...", source = "..." }'
            )
        values[name] = entry.si(fields[name].unit)
    missing = [name for name in fields if name not in values and not hasattr(group, name)]
    if missing:
        raise InputError(
            f"{where}: {group.group} needs {', '.join(missing)} ({fields[missing[0]].doc})"
        )
    return group(**values)
