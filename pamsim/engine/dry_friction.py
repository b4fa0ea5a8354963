"""Solver settings with which the engine's dry friction sticks.

MuJoCo's ``frictionloss`` is a soft constraint: with its default settings a joint held by 0.5 N m of
dry friction creeps by a degree per second under 0.45 N m. With a short time constant and little
softness it creeps by a ten-thousandth of that, and the solver's last pass without softness
(``noslip_iterations``) holds it still.

Friction that does not stick is the same constraint, soft on purpose: below the joint's friction
speed it is proportional to speed, implicitly over the time step, so that no speed is too small. The
friction speed is the last of the joint's user numbers, 0 for friction that sticks.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.engine.contacts import may_collide

_REFERENCE = (1e-3, 1.0)  # the engine raises the time constant to two of its steps
_IMPEDANCE = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
_SMOOTH = 0.0  # first number of the reference of friction that does not stick: it has no spring
_PASSES = 50  # at most: where friction of one joint loads the next, each pass brings both nearer
_IMPROVEMENT = 1e-12  # of a pass, below which it is the last


def make_friction_stick(model: mujoco.MjModel) -> None:
    """Let dry friction of joints and tendons hold under load, without creep.

    Settings that the MJCF states itself are kept. In a model with contacts the pass without
    softness is left to its MJCF, because it would change the friction of the contacts too.

    Args:
        model: changed in place; without dry friction its dynamics are the same.
    """
    for reference, impedance in (
        (model.dof_solref, model.dof_solimp),
        (model.tendon_solref_fri, model.tendon_solimp_fri),
    ):
        _harden(reference, impedance)
    _hold_still(model)


def _hold_still(model: mujoco.MjModel) -> None:
    """Add the pass without softness, unless it is there or the MJCF's to state."""
    if model.opt.noslip_iterations == 0 and not may_collide(model):
        model.opt.noslip_iterations = _PASSES
        model.opt.noslip_tolerance = _IMPROVEMENT


def reserve_friction_speed(spec: mujoco.MjSpec) -> None:
    """Give every joint of a model to be compiled a further user number, 0."""
    own = max((len(joint.userdata) for joint in spec.joints), default=0)
    spec.nuser_jnt = max(spec.nuser_jnt, own) + 1


def apply_friction_speed(model: mujoco.MjModel) -> None:
    """Set the softness of the dry friction of joints to their friction speeds.

    It depends on the time step, the friction and the inertia: call it after any of them changes.

    Args:
        model: of a rig; changed in place.
    """
    step, smooth = float(model.opt.timestep), False
    for joint, speed in enumerate(model.jnt_user[:, -1].tolist() if model.nuser_jnt else ()):
        dof = int(model.jnt_dofadr[joint])
        friction = float(model.dof_frictionloss[dof])
        if speed > 0.0 and friction > 0.0:
            # The engine's force is -(a + B v) / R. With 1/R = c h and B = 1/h that is -c (v + h a),
            # the slope c times the speed after the step.
            share = friction / speed * step * float(model.dof_invweight0[dof])
            impedance = min(max(share / (1.0 + share), mujoco.mjMINIMP), mujoco.mjMAXIMP)
            model.dof_solref[dof] = (_SMOOTH, -impedance / step)
            model.dof_solimp[dof] = (impedance, impedance, *_IMPEDANCE[2:])
            smooth = True
        elif model.dof_solref[dof, 0] == _SMOOTH:
            model.dof_solref[dof], model.dof_solimp[dof] = _REFERENCE, _IMPEDANCE
            _hold_still(model)
    if smooth:
        model.opt.noslip_iterations = 0  # the pass takes all softness away


def _harden(reference: NDArray[np.float64], impedance: NDArray[np.float64]) -> None:
    """Replace the settings that are the engine's defaults."""
    default = mujoco.MjSpec().default.joint
    stated = (reference != default.solref_friction).any(axis=1)
    stated |= (impedance != default.solimp_friction).any(axis=1)
    reference[~stated] = _REFERENCE
    impedance[~stated] = _IMPEDANCE
