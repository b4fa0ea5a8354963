"""Length of a muscle: that of its tendon behind teeth, play and stretch of the chain.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.physics.layout`.
"""

from __future__ import annotations

from pamsim.physics.chain import rippled_ratio, rippled_travel
from pamsim.physics.layout import EXTENSION, SHIFT, Row, slot

_COMPLIANCE = slot("chain.compliance")
_BACKLASH = slot("chain.backlash")
_RIPPLE = slot("chain.ripple")
_RIPPLE_PITCH = slot("chain.ripple_pitch")
_RIPPLE_PHASE = slot("chain.ripple_phase")


def chain_length(par: Row, tendon_length: float) -> float:
    """Tendon length behind the sprocket's teeth [m]."""
    if par[_RIPPLE] == 0.0:
        return tendon_length
    return rippled_travel(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def chain_ratio(par: Row, tendon_length: float) -> float:
    """Speed behind the sprocket's teeth over that of the tendon [-]; force on it over the pull."""
    if par[_RIPPLE] == 0.0:
        return 1.0
    return rippled_ratio(tendon_length, par[_RIPPLE], par[_RIPPLE_PITCH], par[_RIPPLE_PHASE])


def length_at_muscle(par: Row, act: Row, tendon_length: float) -> float:
    """Tendon length at the muscle [m]: behind the teeth, plus the shift, minus the extension."""
    length = chain_length(par, tendon_length)
    if par[_BACKLASH] > 0.0:
        length = length + act[len(act) - SHIFT]
    if par[_COMPLIANCE] == 0.0:
        return length
    return length - act[len(act) - EXTENSION]
