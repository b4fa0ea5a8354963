"""What limits the time step of a muscle: its chain and the dry friction along its tendon."""

from __future__ import annotations

from pamsim.physics.antagonist import muscle_stiffness
from pamsim.physics.friction import rubs
from pamsim.physics.muscle import Muscle
from pamsim.physics.record import parameters
from pamsim.physics.static_muscle import limited, static_force


def chain_step_limit(muscle: Muscle, tendon_length: float, pressure: float) -> float:
    """Longest time step in which the chain's extension and its shift do not oscillate.

    Extension x and tension T of a muscle of stiffness k obey x' = (C T - x) / tau, dT/dx = -k, a
    lag of time constant tau / (1 + C k). Within its backlash the chain shifts between two such
    muscles by s' = -2 k s / b. Either grows if an explicit step exceeds twice the time constant.

    Args:
        muscle: on its chain.
        tendon_length: where its stiffness is taken [m].
        pressure: gauge, at which it is [Pa].

    Returns:
        The smaller of 2 tau / (1 + C k) and b / k [s]; no limit on a rigid chain without backlash.
    """
    chain, limit = muscle.chain, float("inf")
    if chain.compliance == 0.0 and chain.backlash == 0.0:
        return limit
    stiffness = max(muscle_stiffness(parameters(muscle), tendon_length, pressure).total, 0.0)
    if chain.compliance > 0.0:
        limit = 2.0 * chain.relaxation_time / (1.0 + chain.compliance * stiffness)
    if chain.backlash > 0.0 and stiffness > 0.0:
        limit = min(limit, chain.seating_damping / stiffness)
    return limit


def bristle_stiffness(muscle: Muscle, tendon_length: float, pressure: float) -> float:
    """Stiffness of the bristles of dry friction before they slip, k [N/m]; 0 without friction.

    Args:
        muscle: with its friction.
        tendon_length: where the muscle pulls [m].
        pressure: gauge, at which it pulls [Pa].
    """
    friction = muscle.friction
    if not rubs(friction):
        return 0.0
    row = parameters(muscle)
    pull = abs(limited(row, static_force(row, tendon_length, pressure)))
    level = friction.coulomb_force + friction.breakaway_force + friction.tension_share * pull
    return level / friction.presliding
