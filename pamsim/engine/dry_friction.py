"""Solver settings with which the engine's dry friction sticks.

MuJoCo's ``frictionloss`` is a soft constraint: with its default settings a joint held by 0.5 N m of
dry friction creeps by a degree per second under 0.45 N m. With a short time constant and little
softness it creeps by a ten-thousandth of that, and the solver's last pass without softness
(``noslip_iterations``) holds it still.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

_REFERENCE = (1e-3, 1.0)  # the engine raises the time constant to two of its steps
_IMPEDANCE = (0.9999, 0.9999, 1e-3, 0.5, 2.0)
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
    if model.opt.noslip_iterations == 0 and not _has_contacts(model):
        model.opt.noslip_iterations = _PASSES
        model.opt.noslip_tolerance = _IMPROVEMENT


def _harden(reference: NDArray[np.float64], impedance: NDArray[np.float64]) -> None:
    """Replace the settings that are the engine's defaults."""
    default = mujoco.MjSpec().default.joint
    stated = (reference != default.solref_friction).any(axis=1)
    stated |= (impedance != default.solimp_friction).any(axis=1)
    reference[~stated] = _REFERENCE
    impedance[~stated] = _IMPEDANCE


def _has_contacts(model: mujoco.MjModel) -> bool:
    return bool(model.npair or model.geom_contype.any() or model.geom_conaffinity.any())
