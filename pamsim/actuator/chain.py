"""Give of the chain and the end fittings in series with a muscle.

A spring of compliance C with a damper beside it (Kelvin-Voigt): under a tension T its extension
goes to C T with a time constant. As the extension is a state, the tension needs no equation to be
solved for in a time step; at rest the time constant does not matter.

Between sprocket and chain there may be play: the chain follows the sprocket as the play operator of
`pamsim.hysteresis.play` does, at most half the play behind or ahead. It passes on its tension all
the while, as the pull of the other muscle keeps it on the teeth. Such a lag is not passive: a slow
cycle of the sprocket between shut muscles gives back the play times the swing of the tension.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter


@dataclass(frozen=True, kw_only=True)
class Chain(ParameterGroup):
    """Compliance of chain and end fittings, play on the sprocket; 0 is a rigid, tight one."""

    group: ClassVar[str] = "chain"
    compliance: float = parameter(
        unit="m/N", low=0.0, high=1e-3, doc="C, extension per tension", default=0.0
    )
    relaxation_time: float = parameter(
        unit="s",
        low=1e-3,
        high=10.0,
        doc="in which the extension follows the tension; several time steps at least",
        default=5e-3,
    )
    backlash: float = parameter(
        unit="m", low=0.0, high=2e-2, doc="travel of the sprocket that is lost", default=0.0
    )


def extension_rate(
    extension: float, tension: float, compliance: float, relaxation_time: float
) -> float:
    """Rate of the chain's extension [m/s].

    Args:
        extension: [m].
        tension: T [N].
        compliance: C [m/N].
        relaxation_time: [s].
    """
    return (compliance * tension - extension) / relaxation_time
