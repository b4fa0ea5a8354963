"""The chain, formulated otherwise."""

from __future__ import annotations

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import at_size
from pamsim.core.errors import InputError
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.twins.independent_models.independent_model import Law, Truth
from pamsim.twins.independent_models.plant import Occasion, Plant

_COMPLIANCE = slot("chain.compliance")
_BACKLASH = slot("chain.backlash")
_PARTNER = slot("partner")

_MIDDLE_TENSION = 700.0
"""Tension at which the hardening chain is as long as the library's [N]."""

_TOOTH = 4e5
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


def elastic_gap(pull: float, play: float) -> float:
    """Travel of a chain between teeth that give way to what it presses on them [m].

    Args:
        pull: difference of the pulls at its ends [N].
        play: travel between teeth that nothing presses on [m].
    """
    return play + 2.0 * abs(pull) / _TOOTH


def _backlash(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("chain_backlash"), size) | {"chain.seating_damping": _BRAKE}


def _teeth(size: float, occasion: Occasion) -> Law:
    if not all(row[_PARTNER] for row in occasion.rig.model.actuator_user):
        raise InputError("chain_backlash needs two muscles on one chain; this rig has others")
    play = size * effect("chain_backlash").parameters[0].typical

    def law(plant: Plant) -> None:
        gap = elastic_gap(plant.tension(0) - plant.tension(1), play)
        for i in plant.muscles:
            plant.user[i, _BACKLASH] = gap

    return law


TRUTHS = (
    Truth(
        name="chain_backlash",
        formulation="play between elastic teeth, with less friction on them",
        parameters=_backlash,
        law=_teeth,
    ),
    Truth(
        name="chain_compliance",
        formulation="a chain that hardens under tension",
        parameters=_compliance,
        law=_hardening,
    ),
)
"""Truths of the transmission."""
