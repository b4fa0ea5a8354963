"""Bellows and pistons: actuators that push with the pressure on an effective area.

At a pressure p and a stroke s a bellows of effective area A, whose wall is a spring of stiffness k
that is free at the stroke s0, pushes its ends apart by

    F = p A - k (s - s0) - c s'                                                                 (i)

with the wall's damping c. A piston is one without spring. The work of the force is that of the
pressure on the volume, F ds = p dV, so V = V_d + A s with the dead volume V_d. Constant A is what
data sheets print ("effective area"); that of a real bellows falls somewhat with the stroke.

In the signs of the other force laws, in which a muscle's pull is positive, a push is negative. The
contraction is kappa = 1 - s/s0, so (i) without damping reads F = -p A - k s0 kappa.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.force_laws.force_law import ForceLaw, ForceParameters


class Stroke(ParameterGroup, group="stroke"):
    """What a pushing actuator has in place of a braid."""

    nominal_length: float = quantity(
        "(0, 10] m",
        "s0, stroke at which the wall's spring is free; of a piston without spring its full stroke",
    )
    damping: float = quantity(
        "[0, 1e5] N*s/m", "c, viscous damping of the stroke; limits the time step", 0.0
    )


class EffectiveArea(ForceParameters, law="effective_area"):
    """Area and spring of a bellows or a piston."""

    area: float = quantity("(0, 1] m^2", "A, effective area of the pressure")
    stiffness: float = quantity("[0, 1e6] N/m", "k of the wall; 0 for a piston", 0.0)


def effective_area_force(
    pressure: float, contraction: float, area: float, stiffness: float, nominal_length: float
) -> float:
    """Force of a bellows or a piston at rest [N], equation (i), negative where it pushes.

    The arguments are gauge pressure [Pa], contraction [-], the fields of the group, and s0 [m].
    """
    return -pressure * area - stiffness * nominal_length * contraction


def effective_area_volume(contraction: float, area: float) -> float:
    """Volume gained since the nominal stroke, per nominal stroke [m^2]."""
    return -area * contraction


def effective_area_work(contraction: float, stiffness: float, nominal_length: float) -> float:
    """Work of the spring from the nominal stroke on, per nominal stroke [N]."""
    return -0.5 * stiffness * nominal_length * contraction * contraction


CARD = ForceLaw(
    title="Bellows or piston",
    equation="F = -p A + k (s - s0), kappa = 1 - s/s0",
    source="ISO 5598 (2020), effective area; EquiMus (2025)",
    group=EffectiveArea,
    force_function=effective_area_force,
    volume_function=effective_area_volume,
    work_function=effective_area_work,
    volume_varies=False,
    braid_fields=("nominal_length",),
    pressure_range=(0.0, math.inf),
    limits=(-0.5, 0.5),  # the spring up to half compressed or stretched
    pushes=True,
    notes="Pushes: its force is negative. The group stroke takes the place of braid; passive,"
    " threshold, end_shape and chain have no meaning for it. The effective area of a real"
    " bellows falls somewhat with the stroke.",
)
