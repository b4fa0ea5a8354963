"""One pneumatic artificial muscle: the parameter groups of every law it is made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pamsim.actuator.chain import Chain
from pamsim.actuator.friction import Friction
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.hysteresis.catalog import OPERATORS
from pamsim.hysteresis.group import Hysteresis
from pamsim.muscles.braid import Braid
from pamsim.muscles.catalog import FORCE_LAWS
from pamsim.muscles.creep import Creep
from pamsim.muscles.end_shape import EndShape
from pamsim.muscles.passive import PassiveSpring
from pamsim.muscles.tension import Threshold
from pamsim.pneumatics.chamber import Chamber
from pamsim.pneumatics.valves import ValvePair

FORCE_GROUPS: tuple[type[ParameterGroup], ...] = tuple(law.group for law in FORCE_LAWS.values())
"""Groups of the force laws; the position in the tuple is the code kept in the model."""

HYSTERESIS_GROUPS: tuple[type[Hysteresis] | None, ...] = (
    None,
    *(operator.group for operator in OPERATORS.values()),
)
"""Groups of the hysteresis operators by their code; code 0 is no operator."""

COMMANDS: tuple[str, ...] = ("valve", "pulse", "pressure", "measured")
"""What the control of the actuator means: a signed opening, a signed duty, the set point of a
regulator, or the gauge pressure that the chamber has after the time step, whatever valves and air
would do."""


@dataclass(frozen=True, kw_only=True)
class Mounting(ParameterGroup):
    """How the muscle sits on its tendon."""

    group: ClassVar[str] = "mounting"
    length_at_zero: float = parameter(
        unit="m",
        low=-10.0,
        high=10.0,
        doc="muscle length where the tendon's length is zero: rest length on a fixed tendon, minus"
        " the rigid fittings on a spatial one",
    )


PLAIN_GROUPS: tuple[type[ParameterGroup], ...] = (
    Mounting,
    Braid,
    PassiveSpring,
    Threshold,
    EndShape,
    Creep,
    Chamber,
    ValvePair,
    Chain,
    Friction,
)
"""The groups every muscle has exactly one kind of."""


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """A muscle with its air and its valves.

    Attributes:
        mounting: place on the tendon.
        braid: geometry, which gives the chamber's volume at nominal length; how it changes from
            there follows from the force law.
        force: group of the active force law, one of `FORCE_GROUPS`.
        passive: passive spring beside it.
        threshold: pressure lost before the braid is reached.
        end_shape: active force lost at high contraction.
        creep: relaxing element beside the muscle.
        hysteresis: group of the operator on the force, or None.
        chamber: polytropic air.
        valve: fill and exhaust valves.
        chain: what the muscle pulls through.
        friction: along its tendon.
        command: what the control means, one of `COMMANDS`.
    """

    mounting: Mounting
    braid: Braid
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
    command: str = "valve"

    def __post_init__(self) -> None:
        """Check the command.

        Raises:
            InputError: if it is not one of `COMMANDS`.
        """
        if self.command not in COMMANDS:
            raise InputError(f"no command {self.command!r}; {nearest(str(self.command), COMMANDS)}")
