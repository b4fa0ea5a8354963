"""How stiff the joints of a rig are at rest, and how fast they swing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.equilibrium import moment_arms, rest_positions, tendon_lengths
from pamsim.engine.rig import Rig
from pamsim.physics.antagonist import joint_stiffness, muscle_stiffness
from pamsim.physics.record import Parameters, view


def stiffness_of_joints(
    arms: FloatArray,
    muscles: Sequence[Parameters],
    length: Sequence[float],
    pressure: Sequence[float],
) -> list[float]:
    """Stiffness (j,) [N m/rad or N/m] of each joint with its valves and the other joints shut.

    Sum of r^2 k over the muscles (Matiskova 2021, equation (5)), by moment arms (m, j), see
    `pamsim.engine.equilibrium`, lengths of tendons (m,) [m] and gauge pressures (m,) [Pa].
    """
    shut = [
        muscle_stiffness(muscle, at, max(held, 0.0))
        for muscle, at, held in zip(muscles, length, pressure, strict=True)
    ]
    return [joint_stiffness(shut, own).total for own in arms.T.tolist()]


def swing_periods(rig: Rig, pressure: FloatArray) -> FloatArray:
    """Periods [s] in which joints swing about rest with shut valves, without damping and load.

    Args:
        rig: as it is.
        pressure: (m,) gauge pressures at rest [Pa].

    Returns:
        One for each recorded joint that the muscles hold; none where the rig finds no rest.
    """
    try:
        rest = rest_positions(rig, pressure, rig.model.qpos0.copy())
    except InputError:  # a free or ball joint
        return np.empty(0)
    if np.isnan(rest).any():
        return np.empty(0)
    muscles = [*map(view, rig.model.actuator_user)]
    arms, length = moment_arms(rig, rest), tendon_lengths(rig, rest).tolist()
    stiffness = np.array(stiffness_of_joints(arms, muscles, length, pressure.tolist()))
    # Without free and ball joints, positions and velocities have the same addresses.
    squares = stiffness * rig.model.dof_invweight0[rig.position_addresses]
    return 2.0 * np.pi / np.sqrt(squares[squares > 0.0])
