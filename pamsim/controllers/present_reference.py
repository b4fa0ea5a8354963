"""The reference at the present sample, with which feedback compares the measured motion.

An observation holds the reference of the next sample, at which a command aims. Feedback that
compared the present angle with it would see an error of one sample on every moving reference.
"""

from __future__ import annotations

from pamsim.controllers.controller import Observation


def present_reference(observation: Observation, period: float) -> tuple[float, float]:
    """Reference angle [rad] and rate [rad/s] at the present sample.

    Args:
        observation: its reference is one period ahead; acceleration is assumed constant over it.
        period: between two samples [s].
    """
    acceleration = observation.reference_acceleration
    rate = observation.reference_rate - period * acceleration
    return observation.reference - period * (
        observation.reference_rate - 0.5 * period * acceleration
    ), rate
