"""What acts on joints from outside: a torque or force, or whatever an imposed motion takes.

A torque or force is an applied generalised force of the engine, the mean over each time step of the
line between the given values. No actuator stands for it.

For an imposed motion the joint is given an inertia against which nothing else counts, and before
each time step the acceleration that takes it to where it must be at the end of the step. The engine
itself then solves for everything else, constraints and the inertial pull on joints that move freely
included, and what the motion takes follows from what is left of the acceleration. The next step
makes up for what the forces change, so errors do not add up. Two other ways were tried: positions
and speeds written over after each step do not accelerate the other joints, and an equality
constraint follows its target late: `tests/physics/test_imposed_motion.py` measures all three.
"""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.signals import IMPOSED, Drive

# Inertia of a joint whose motion is imposed [kg m^2 or kg]. A force of 1 kN displaces it by 3e-13 m
# in a step of 0.5 ms; rounding leaves 2e-5 N in the force that an acceleration of 100 m/s^2 takes.
_HELD = 1e9
_ROOM = 1e-9  # beyond a joint's range, for positions written in other units [rad or m]

_STOPS_GIVE = 0.1
"""Share of a joint's range by which an imposed motion may pass its stops. MuJoCo's are soft: under
the pull of a muscle those of a template give way by 3 %, which is then part of the motion."""


class External(NamedTuple):
    """Joints that are driven from outside."""

    positions: NDArray[np.int64]  # (j,) where each lies in ``qpos``
    dofs: NDArray[np.int64]  # (j,) where each lies in ``qvel``
    inertia: FloatArray  # (j,) of imposed motions, 0 under a torque or force [kg m^2 or kg]


NOTHING = External(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))


def external(model: mujoco.MjModel, drives: Drive) -> External:
    """The joints that a drive acts on; in the model those whose motion is imposed become heavy.

    They lose their stops, which would turn them back, however heavy.
    """
    joints = [model.joint(name) for name in drives.joints]
    on = External(
        positions=np.array([joint.qposadr[0] for joint in joints], dtype=np.int64),
        dofs=np.array([joint.dofadr[0] for joint in joints], dtype=np.int64),
        inertia=np.array([_HELD * (kind in IMPOSED) for kind in drives.joints.values()]),
    )
    # Not by mj_setConst: tolerances and softness of the solver stay those of the rig. The engine
    # takes the inertia of a body that is simple from dof_M0.
    for joint, inertia in zip(joints, on.inertia, strict=True):
        if inertia > 0.0:
            model.jnt_limited[joint.id] = 0
    model.dof_armature[on.dofs] += on.inertia
    model.dof_M0[on.dofs] += on.inertia
    return on


def as_driven(model: mujoco.MjModel, on: External) -> mujoco.MjModel:
    """The model with weights, seen from tendons, that include those of joints held or moved."""
    if not on.inertia.any():
        return model
    heavy = copy.copy(model)
    mujoco.mj_setConst(heavy, mujoco.MjData(heavy))
    return heavy


def passable(model: mujoco.MjModel, name: str) -> tuple[float, float]:
    """Where a motion may be imposed on a joint: its range, and as far beyond as stops give way."""
    joint = model.joint(name)
    if not joint.limited[0]:
        return -np.inf, np.inf
    low, high = joint.range
    beyond = _STOPS_GIVE * float(high - low) + _ROOM
    return float(low) - beyond, float(high) + beyond


def check_range(model: mujoco.MjModel, drives: Drive, values: FloatArray) -> None:
    """Refuse imposed motions, among commands (n, m + j), further beyond stops than these give way.

    Raises:
        InputError: naming the joint.
    """
    for name, column in zip(drives.joints, values[:, len(drives.muscles) :].T, strict=True):
        low, high = passable(model, name)
        if name in drives.imposed and not low <= column.min() <= column.max() <= high:
            low, high = model.joint(name).range
            raise InputError(
                f"the imposed motion of {name!r}, {column.min():.4g} to {column.max():.4g}, leaves"
                f" its range of {low:.4g} to {high:.4g} (rad or m)"
            )


def act(data: Any, on: External, values: FloatArray, timestep: float) -> None:
    """Set what acts on the joints during the next time step [s]; compiled as it stands.

    The values (j,) are torques [N m], forces [N] or positions at the end of the step [rad or m].
    The data, of a model that `external` has prepared, may be its arrays by their names.
    """
    for i in range(on.dofs.size):
        applied, dof = values[i], on.dofs[i]
        if on.inertia[i] > 0.0:
            speed = (values[i] - data.qpos[on.positions[i]]) / timestep
            applied = on.inertia[i] * ((speed - data.qvel[dof]) / timestep)
        data.qfrc_applied[dof] = applied


def effort(data: Any, on: External, joint: int) -> float:
    """Torque or force that acted on one of the joints at the instant the last step began."""
    dof = on.dofs[joint]
    return data.qfrc_applied[dof] - on.inertia[joint] * data.qacc[dof]


def place(data: mujoco.MjData, on: External, values: FloatArray) -> None:
    """Put joints where their imposed motion begins, at rest; apply torques and forces; all (j,)."""
    for i, dof in enumerate(on.dofs):
        if on.inertia[i] == 0.0:
            data.qfrc_applied[dof] = values[i]
            continue
        # What holds it there follows the forces on it, or it would creep.
        data.qfrc_applied[dof] = effort(data, on, i)
        data.qpos[on.positions[i]] = values[i]
        data.qvel[dof] = 0.0


def set_off(data: mujoco.MjData, on: External, experiment: Experiment, timestep: float) -> None:
    """Give joints whose motion is imposed its first speed, or it would begin with a blow."""
    ends = experiment.command_at(timestep * np.arange(3.0))[:, len(experiment.drives.muscles) :]
    now, one, two = ends[:, on.inertia > 0.0]
    data.qvel[on.dofs[on.inertia > 0.0]] = (3.0 * one - two - 2.0 * now) / timestep
