"""The chain, formulated otherwise."""

from __future__ import annotations

from pamsim.actuator.layout import slot
from pamsim.effects.catalog import effect
from pamsim.engine.rig import Rig
from pamsim.workflows.effect_candidates import at_size
from pamsim.workflows.foreign_truths.plant import Occasion, Plant
from pamsim.workflows.foreign_truths.truth import Law, Truth

_COMPLIANCE = slot("chain.compliance")

_MIDDLE_TENSION = 700.0
"""Tension at which the hardening chain is as long as the library's [N]."""


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


TRUTHS = (
    Truth(
        name="chain_compliance",
        formulation="a chain that hardens under tension",
        parameters=_compliance,
        law=_hardening,
    ),
)
"""Truths of the transmission."""
