"""The reference at the present sample, with which feedback compares the measured motion.

An observation holds the reference of the next sample, at which a command aims. Feedback that
compared the present angle with it would see an error of one sample on every moving reference.
"""

from __future__ import annotations

from pamsim.controllers.controller import JointObservation


def present_reference(joint: JointObservation, period: float) -> tuple[float, float]:
    """Reference [rad or m] and its rate at the present sample.

    Args:
        joint: its reference is one period ahead; acceleration is assumed constant over it.
        period: between two samples [s].
    """
    acceleration = joint.reference_acceleration
    rate = joint.reference_rate - period * acceleration
    return joint.reference - period * (joint.reference_rate - 0.5 * period * acceleration), rate
