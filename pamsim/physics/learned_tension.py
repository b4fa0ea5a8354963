"""A tension without a formula: what was learned from data that a muscle's force law misses.

Two curves over the contraction q that force law and tube act at, as `pamsim.physics.spline`
describes: one is an area A that the gauge pressure p in the braid acts on, one is a force G without
pressure,

    F = p A(q) + G(q)

The volume of the air follows from their integrals as it does from those of the force law.
"""

from __future__ import annotations

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.spline import curve_of_8, integral_of_8

CONTROLS = 8
"""Control values of each curve: bends in a seventh of the stroke."""

_STEP = 1e-6  # of a difference quotient by contraction: as `pamsim.physics.chosen_law`'s


class LearnedTension(ParameterGroup, group="learned_tension"):
    """Ends and control values of both curves; without a range between the ends there is none."""

    low: float = quantity("[-1, 1]", "contraction at which the curves begin", 0.0)
    high: float = quantity("[-1, 1]", "contraction at which they end", 0.0)
    area_1: float = quantity(
        "[-1e-2, 1e-2] m^2", "control value of the force per pressure, first", 0.0
    )
    area_2: float = quantity("[-1e-2, 1e-2] m^2", "second", 0.0)
    area_3: float = quantity("[-1e-2, 1e-2] m^2", "third", 0.0)
    area_4: float = quantity("[-1e-2, 1e-2] m^2", "fourth", 0.0)
    area_5: float = quantity("[-1e-2, 1e-2] m^2", "fifth", 0.0)
    area_6: float = quantity("[-1e-2, 1e-2] m^2", "sixth", 0.0)
    area_7: float = quantity("[-1e-2, 1e-2] m^2", "seventh", 0.0)
    area_8: float = quantity("[-1e-2, 1e-2] m^2", "eighth", 0.0)
    pull_1: float = quantity(
        "[-1e4, 1e4] N", "control value of the force without pressure, first", 0.0
    )
    pull_2: float = quantity("[-1e4, 1e4] N", "second", 0.0)
    pull_3: float = quantity("[-1e4, 1e4] N", "third", 0.0)
    pull_4: float = quantity("[-1e4, 1e4] N", "fourth", 0.0)
    pull_5: float = quantity("[-1e4, 1e4] N", "fifth", 0.0)
    pull_6: float = quantity("[-1e4, 1e4] N", "sixth", 0.0)
    pull_7: float = quantity("[-1e4, 1e4] N", "seventh", 0.0)
    pull_8: float = quantity("[-1e4, 1e4] N", "eighth", 0.0)


def learns_tension(learned: LearnedTension) -> bool:
    """Whether there are curves."""
    return learned.high > learned.low


def learned_area(learned: LearnedTension, contraction: float) -> float:
    """Tension per gauge pressure [m^2] at a contraction [-]."""
    return curve_of_8(
        contraction,
        learned.low,
        learned.high,
        learned.area_1,
        learned.area_2,
        learned.area_3,
        learned.area_4,
        learned.area_5,
        learned.area_6,
        learned.area_7,
        learned.area_8,
    )


def learned_pull(learned: LearnedTension, contraction: float) -> float:
    """Tension without pressure [N] at a contraction [-]."""
    return curve_of_8(
        contraction,
        learned.low,
        learned.high,
        learned.pull_1,
        learned.pull_2,
        learned.pull_3,
        learned.pull_4,
        learned.pull_5,
        learned.pull_6,
        learned.pull_7,
        learned.pull_8,
    )


def learned_gain(learned: LearnedTension, contraction: float) -> float:
    """Integral of the area from contraction 0 on [m^2]."""
    return _swept_area(learned, contraction) - _swept_area(learned, 0.0)


def learned_work(learned: LearnedTension, contraction: float) -> float:
    """Integral of the tension without pressure [N], up to a constant."""
    return integral_of_8(
        contraction,
        learned.low,
        learned.high,
        learned.pull_1,
        learned.pull_2,
        learned.pull_3,
        learned.pull_4,
        learned.pull_5,
        learned.pull_6,
        learned.pull_7,
        learned.pull_8,
    )


def learned_derivatives(learned: LearnedTension, contraction: float) -> tuple[float, float]:
    """Derivatives by contraction of area [m^2] and tension without pressure [N], for a search."""
    ahead = contraction + _STEP
    area = learned_area(learned, ahead) - learned_area(learned, contraction)
    return area / _STEP, (learned_pull(learned, ahead) - learned_pull(learned, contraction)) / _STEP


def _swept_area(learned: LearnedTension, contraction: float) -> float:
    return integral_of_8(
        contraction,
        learned.low,
        learned.high,
        learned.area_1,
        learned.area_2,
        learned.area_3,
        learned.area_4,
        learned.area_5,
        learned.area_6,
        learned.area_7,
        learned.area_8,
    )
