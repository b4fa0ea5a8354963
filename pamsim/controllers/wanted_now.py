"""The wanted motion at the present sample, which is what the measured one is compared with.

A sight holds the reference of the next sample, at which a command aims; feedback that compared the
present angle with it would take a moving arm to be late.
"""

from __future__ import annotations

from pamsim.controllers.controller import Sight


def wanted_now(seen: Sight, period: float) -> tuple[float, float]:
    """Wanted angle [rad] and rate [rad/s] at the present sample.

    Args:
        seen: its reference is one period ahead; the acceleration is taken as constant over it.
        period: between two samples [s].
    """
    acceleration = seen.reference_acceleration
    rate = seen.reference_rate - period * acceleration
    return seen.reference - period * (seen.reference_rate - 0.5 * period * acceleration), rate
