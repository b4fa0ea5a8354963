"""One pneumatic actuator: the parameter groups of every law it is made of."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import ClassVar

from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.braid import Braid
from pamsim.physics.chain import Chain
from pamsim.physics.chamber import Chamber
from pamsim.physics.commands import COMMANDS
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.friction import Friction
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.hysteresis.maxwell_slip import ParallelHysteresis
from pamsim.physics.passive import Creep, PassiveSpring
from pamsim.physics.tension import EndShape, Threshold
from pamsim.physics.valves import ValvePair


@dataclass(frozen=True, kw_only=True)
class Mounting(ParameterGroup):
    """How the actuator sits on its tendon."""

    group: ClassVar[str] = "mounting"
    length_at_zero: float = parameter(
        unit="m",
        low=-10.0,
        high=10.0,
        doc="muscle length where the tendon's length is zero: rest length on a fixed tendon, minus"
        " the rigid fittings on a spatial one; of a bellows or a piston the stroke there",
    )


PLAIN_GROUPS: tuple[type[ParameterGroup], ...] = (
    Mounting,
    Braid,
    Stroke,
    PassiveSpring,
    Threshold,
    EndShape,
    Creep,
    ParallelHysteresis,
    Chamber,
    ValvePair,
    Chain,
    Friction,
)
"""The groups of which there is one kind."""

MUSCLE_ONLY: tuple[type[ParameterGroup], ...] = (Braid, PassiveSpring, Threshold, EndShape, Chain)
"""Groups that have no meaning for a pushing actuator."""

PUSHING_ONLY: tuple[type[ParameterGroup], ...] = (Stroke,)
"""Groups that have none for a muscle."""


def plain_groups(pushing: bool) -> tuple[type[ParameterGroup], ...]:
    """The groups of one kind that have a meaning for a pushing actuator, or for a muscle."""
    idle = MUSCLE_ONLY if pushing else PUSHING_ONLY
    return tuple(group for group in PLAIN_GROUPS if group not in idle)


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """A muscle, or a pushing actuator such as a bellows, with its air and its valves.

    Attributes:
        mounting: place on the tendon.
        braid: geometry of a muscle, which gives the chamber's volume at nominal length; how it
            changes from there follows from the force law. None for a pushing actuator.
        stroke: nominal stroke and damping of a pushing actuator, or None.
        force: group of the active force law, of one of `FORCE_LAWS`.
        passive: passive spring beside it.
        threshold: pressure lost before the braid is reached.
        end_shape: active force lost at high contraction.
        creep: relaxing element beside the muscle.
        hysteresis: group of the operator on the force, or None.
        parallel_hysteresis: Maxwell slip beside it.
        chamber: polytropic air.
        valve: fill and exhaust valves.
        chain: what the muscle pulls through.
        friction: along its tendon.
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
    chain: Chain = field(default_factory=Chain)
    friction: Friction = field(default_factory=Friction)
    hysteresis: Hysteresis | None = None
    parallel_hysteresis: ParallelHysteresis = field(default_factory=ParallelHysteresis)
    command: str = "valve"

    def __post_init__(self) -> None:
        """Check the command, and that the actuator has what its force law acts on.

        Raises:
            InputError: if the command is not one of `COMMANDS`, or braid or stroke is missing or
                without meaning.
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
        idle = MUSCLE_ONLY if self.pushes else PUSHING_ONLY
        own = vars(self).values()
        return tuple(g for g in own if isinstance(g, ParameterGroup) and not isinstance(g, idle))
