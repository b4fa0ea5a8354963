"""Volume and work under a force law that states the force alone, so that they agree with it."""

from __future__ import annotations

from collections.abc import Callable

GAUSS = (
    (0.1488743389816312, 0.2955242247147529),
    (0.4333953941292472, 0.2692667193099963),
    (0.6794095682990244, 0.2190863625159820),
    (0.8650633666889845, 0.1494513491505806),
    (0.9739065285171717, 0.0666713443086881),
)
"""Nodes and weights of Gauss's rule with ten points on (-1, 1), those above 0."""

_APART = 10.0  # half of the step of a difference quotient by pressure [Pa]


def swept_volume(force: Callable[..., float]) -> Callable[..., float]:
    """Volume gained since nominal length, per nominal length [m^2], from a force law.

    The integral of dF/dp by contraction, by ten points of Gauss: exact to rounding for laws that
    are smooth in contraction and linear in pressure.

    Args:
        force: of pressure [Pa], contraction [-], coefficients and geometry [N].
    """

    def volume(pressure: float, contraction: float, *rest: float) -> float:
        gained = 0.0
        for node, weight in GAUSS:
            for at in (0.5 - 0.5 * node, 0.5 + 0.5 * node):
                kappa = at * contraction
                rise = force(pressure + _APART, kappa, *rest)
                rise -= force(pressure - _APART, kappa, *rest)
                gained += weight * rise
        return 0.25 * gained * contraction / _APART

    return volume


def swept_work(force: Callable[..., float]) -> Callable[..., float]:
    """Work at one pressure from nominal length on, per nominal length [N], from a force law.

    By the same rule as `swept_volume`, whose argument it takes.
    """

    def work(pressure: float, contraction: float, *rest: float) -> float:
        done = 0.0
        for node, weight in GAUSS:
            for at in (0.5 - 0.5 * node, 0.5 + 0.5 * node):
                done += weight * force(pressure, at * contraction, *rest)
        return 0.5 * done * contraction

    return work
