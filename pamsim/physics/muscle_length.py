"""Length of a muscle: that of its tendon behind teeth, play and stretch of the chain.

``m`` are the parameters of one actuator, ``s`` its states, see `pamsim.physics.record`.
"""

from __future__ import annotations

from pamsim.physics.chain import rippled_ratio, rippled_travel
from pamsim.physics.record import Parameters, States


def chain_length(m: Parameters, tendon_length: float) -> float:
    """Tendon length behind the sprocket's teeth [m]."""
    if m.chain.ripple == 0.0:
        return tendon_length
    return rippled_travel(tendon_length, m.chain.ripple, m.chain.ripple_pitch, m.chain.ripple_phase)


def chain_ratio(m: Parameters, tendon_length: float) -> float:
    """Speed behind the sprocket's teeth over that of the tendon [-]; force on it over the pull."""
    if m.chain.ripple == 0.0:
        return 1.0
    return rippled_ratio(tendon_length, m.chain.ripple, m.chain.ripple_pitch, m.chain.ripple_phase)


def length_at_muscle(m: Parameters, s: States, tendon_length: float) -> float:
    """Tendon length at the muscle [m]: behind the teeth, plus the shift, minus the extension."""
    length = chain_length(m, tendon_length)
    if m.chain.backlash > 0.0:
        length = length + s.shift
    if m.chain.compliance == 0.0:
        return length
    return length - s.extension
