"""Independent models of the chain: elastic teeth, hardening compliance."""

from __future__ import annotations

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import at_size
from pamsim.core.errors import InputError
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_COMPLIANCE = slot("chain.compliance")
_BACKLASH = slot("chain.backlash")
_PARTNER = slot("partner")

_MIDDLE_TENSION = 700.0
"""Tension at which the hardening chain's extension equals the library's [N]."""

_TOOTH = 4e5
"""Stiffness of the teeth that stop the chain [N/m]."""

_BRAKE = 500.0
"""Difference of pulls per speed of the chain [N s/m]."""


def hardening_compliance(tension: float, compliance: float) -> float:
    """Extension per tension of a chain that hardens, C 2 / (1 + T / T_m) [m/N].

    Args:
        tension: [N].
        compliance: C at the middle tension [m/N].
    """
    return 2.0 * compliance / (1.0 + max(tension, 0.0) / _MIDDLE_TENSION)


def _compliance(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("chain_compliance"), size)


def _hardening(size: float, context: RunContext) -> Law:
    typical = size * effect("chain_compliance").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.user[i, _COMPLIANCE] = hardening_compliance(plant.tension(i), typical)

    return law


def elastic_gap(pull: float, backlash: float) -> float:
    """Travel of a chain between elastic teeth, which deflect under its load [m].

    Args:
        pull: difference of the pulls at its ends [N].
        backlash: travel between unloaded teeth [m].
    """
    return backlash + 2.0 * abs(pull) / _TOOTH


def _backlash(rig: Rig, size: float) -> dict[str, float]:
    return at_size(rig, effect("chain_backlash"), size) | {"chain.seating_damping": _BRAKE}


def _teeth(size: float, context: RunContext) -> Law:
    if not all(row[_PARTNER] for row in context.rig.model.actuator_user):
        raise InputError(
            "chain_backlash needs two muscles on one chain, which this rig does not have"
        )
    backlash = size * effect("chain_backlash").parameters[0].typical

    def law(plant: Plant) -> None:
        gap = elastic_gap(plant.tension(0) - plant.tension(1), backlash)
        for i in plant.muscles:
            plant.user[i, _BACKLASH] = gap

    return law


MODELS = (
    IndependentModel(
        name="chain_backlash",
        formulation="backlash between elastic teeth, with less friction on them",
        parameters=_backlash,
        law=_teeth,
    ),
    IndependentModel(
        name="chain_compliance",
        formulation="a chain that hardens under tension",
        parameters=_compliance,
        law=_hardening,
    ),
)
"""Independent models of the transmission effects."""
