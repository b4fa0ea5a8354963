"""Longest explicit time step that a muscle's chain can take."""

from __future__ import annotations

from pamsim.actuator.antagonist import muscle_stiffness
from pamsim.actuator.layout import pack
from pamsim.actuator.muscle import Muscle


def chain_step_limit(muscle: Muscle, tendon_length: float, pressure: float) -> float:
    """Longest time step in which the chain's extension does not swing up.

    Extension x and tension T of a muscle of stiffness k obey x' = (C T - x) / tau, dT/dx = -k, a
    lag of time constant tau / (1 + C k). An explicit step of twice that makes it grow.

    Args:
        muscle: on its chain.
        tendon_length: where its stiffness is taken [m].
        pressure: gauge, at which it is [Pa].

    Returns:
        2 tau / (1 + C k) [s]; no limit on a rigid chain.
    """
    chain = muscle.chain
    if chain.compliance == 0.0:
        return float("inf")
    stiffness = max(muscle_stiffness(pack(muscle), tendon_length, pressure).total, 0.0)
    return 2.0 * chain.relaxation_time / (1.0 + chain.compliance * stiffness)
