"""The MAS-20 arm before anything was identified: the published force map in a plain balance."""

from __future__ import annotations

from pamsim.engine.rig import Rig, load_rig
from pamsim.physics.force_laws.published import PUBLISHED

NAME = "published"
"""What `pamsim.diagnosis.diagnose.diagnose` calls it."""

LAW = "DMSP-20-200"
"""Successor of the MAS-20 whose constants are published."""


def published_rig() -> Rig:
    """The shipped arm with the published constants and without what was identified from its rows.

    The force law is the published one whole, its pressure-free part in place of the passive spring;
    no braid locks, pressure does not lengthen the muscle, and the load does not turn the arm. The
    sprocket's radius, which the paper does not print, stays at the assumed one.
    """
    law = PUBLISHED[LAW]
    return load_rig("mas20_arm").with_parameters(
        {
            "force.a": law.a,
            "force.b": law.b,
            "force.c": law.c,
            "force.d": law.d,
            "force.e": law.e,
            "force.f": law.f,
            "passive.stiffness": 0.0,
            "passive.softening": -law.c,
            "passive.locking": 0.0,
            "braid.extensibility": 0.0,
            "body.rig.tilt": 0.0,
        }
    )
