"""The chain, formulated otherwise."""

from __future__ import annotations

import math

from pamsim.actuator.layout import slot
from pamsim.core.errors import InputError
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.workflows.effect_candidates import at_size
from pamsim.workflows.foreign_truths.plant import Occasion, Plant
from pamsim.workflows.foreign_truths.truth import Law, Truth

_COMPLIANCE = slot("chain.compliance")
_PARTNER = slot("partner")

_MIDDLE_TENSION = 700.0
"""Tension at which the hardening chain is as long as the library's [N]."""

_TOOTH = 1e6
"""Stiffness of the teeth that stop the chain [N/m]."""

_BRAKE = 500.0
"""Difference of pulls per speed of the chain between them [N s/m]."""


def hardening_compliance(tension: float, compliance: float) -> float:
    """Extension per tension of a chain that hardens, C 2 / (1 + T / T_m) [m/N].

    Args:
        tension: [N].
        compliance: C at the middle tension [m/N].
    """
    return 2.0 * compliance / (1.0 + max(tension, 0.0) / _MIDDLE_TENSION)


def _compliance(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("chain_compliance"), size)


def _hardening(size: float, occasion: Occasion) -> Law:
    typical = size * effect("chain_compliance").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.user[i, _COMPLIANCE] = hardening_compliance(plant.tension(i), typical)

    return law


class StiffContact:
    """Play between teeth that are springs, with a brake of its own between them.

    Args:
        play: travel without contact [m].
    """

    def __init__(self, play: float) -> None:
        self._half = 0.5 * play
        self._shift = 0.0

    def shifted(self, pull: float, timestep: float) -> float:
        """Shift of the chain [m] after a time step [s] under a difference of pulls [N]."""
        after = self._shift - timestep * pull / _BRAKE
        beyond = abs(after) - self._half
        if beyond > 0.0:  # implicit: stable however stiff the teeth are
            beyond /= 1.0 + timestep * _TOOTH / _BRAKE
            after = math.copysign(self._half + beyond, after)
        self._shift = after
        return after

    def __call__(self, plant: Plant) -> None:
        """Shift the chain of both muscles."""
        shift = self.shifted(plant.tension(0) - plant.tension(1), plant.timestep)
        plant.set_shift(0, shift)
        plant.set_shift(1, -shift)


def _play(size: float, occasion: Occasion) -> Law:
    if not all(row[_PARTNER] for row in occasion.rig.model.actuator_user):
        raise InputError("chain_backlash needs two muscles on one chain; this rig has others")
    return StiffContact(size * effect("chain_backlash").parameters[0].typical)


TRUTHS = (
    Truth(
        name="chain_backlash",
        formulation="play between elastic teeth, with less friction on them",
        law=_play,
    ),
    Truth(
        name="chain_compliance",
        formulation="a chain that hardens under tension",
        parameters=_compliance,
        law=_hardening,
    ),
)
"""Truths of the transmission."""
