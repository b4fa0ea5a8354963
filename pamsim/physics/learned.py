"""A force along the tendon without a formula: two curves that were learned from data.

One runs over the length of the tendon, one over its speed, as `pamsim.physics.spline` describes,
from one end of what the data visited to the other: beyond nothing was seen. The curve over length
has a potential, whatever its shape; that over speed takes work wherever it has the sign of the
speed. A third is a dry friction F that differs from length to length, smooth in the speed v,

    f = F(l) tanh(v / v_s)
"""

from __future__ import annotations

import math

from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.physics.spline import bump, curve_of_8, place

LENGTH, SPEED, RUB = 24, 8, 8
"""Control forces of each curve: bends in a 23rd of the range, a tooth or a detent of some degrees,
and in a seventh."""


class Learned(ParameterGroup, group="learned"):
    """Ends and control forces of the curves; a curve whose ends are equal is none."""

    low: float = quantity("[-10, 10] m", "tendon length at which the curve over it begins", 0.0)
    high: float = quantity("[-10, 10] m", "tendon length at which it ends", 0.0)
    force_1: float = quantity("[-1e4, 1e4] N", "control force against lengthening, first", 0.0)
    force_2: float = quantity("[-1e4, 1e4] N", "second", 0.0)
    force_3: float = quantity("[-1e4, 1e4] N", "third", 0.0)
    force_4: float = quantity("[-1e4, 1e4] N", "fourth", 0.0)
    force_5: float = quantity("[-1e4, 1e4] N", "fifth", 0.0)
    force_6: float = quantity("[-1e4, 1e4] N", "sixth", 0.0)
    force_7: float = quantity("[-1e4, 1e4] N", "seventh", 0.0)
    force_8: float = quantity("[-1e4, 1e4] N", "eighth", 0.0)
    force_9: float = quantity("[-1e4, 1e4] N", "ninth", 0.0)
    force_10: float = quantity("[-1e4, 1e4] N", "tenth", 0.0)
    force_11: float = quantity("[-1e4, 1e4] N", "11th", 0.0)
    force_12: float = quantity("[-1e4, 1e4] N", "12th", 0.0)
    force_13: float = quantity("[-1e4, 1e4] N", "13th", 0.0)
    force_14: float = quantity("[-1e4, 1e4] N", "14th", 0.0)
    force_15: float = quantity("[-1e4, 1e4] N", "15th", 0.0)
    force_16: float = quantity("[-1e4, 1e4] N", "16th", 0.0)
    force_17: float = quantity("[-1e4, 1e4] N", "17th", 0.0)
    force_18: float = quantity("[-1e4, 1e4] N", "18th", 0.0)
    force_19: float = quantity("[-1e4, 1e4] N", "19th", 0.0)
    force_20: float = quantity("[-1e4, 1e4] N", "20th", 0.0)
    force_21: float = quantity("[-1e4, 1e4] N", "21st", 0.0)
    force_22: float = quantity("[-1e4, 1e4] N", "22nd", 0.0)
    force_23: float = quantity("[-1e4, 1e4] N", "23rd", 0.0)
    force_24: float = quantity("[-1e4, 1e4] N", "24th", 0.0)
    slowest: float = quantity("[-100, 100] m/s", "tendon speed at which the other begins", 0.0)
    fastest: float = quantity("[-100, 100] m/s", "tendon speed at which it ends", 0.0)
    drag_1: float = quantity("[-1e4, 1e4] N", "its control force against lengthening, first", 0.0)
    drag_2: float = quantity("[-1e4, 1e4] N", "second", 0.0)
    drag_3: float = quantity("[-1e4, 1e4] N", "third", 0.0)
    drag_4: float = quantity("[-1e4, 1e4] N", "fourth", 0.0)
    drag_5: float = quantity("[-1e4, 1e4] N", "fifth", 0.0)
    drag_6: float = quantity("[-1e4, 1e4] N", "sixth", 0.0)
    drag_7: float = quantity("[-1e4, 1e4] N", "seventh", 0.0)
    drag_8: float = quantity("[-1e4, 1e4] N", "eighth", 0.0)
    brakes: float = quantity(
        "[0, 1]", "1: where the curve over speed or dry friction would drive they are 0", 0.0
    )
    rub_low: float = quantity("[-10, 10] m", "tendon length at which dry friction begins", 0.0)
    rub_high: float = quantity("[-10, 10] m", "tendon length at which it ends", 0.0)
    rub_speed: float = quantity(
        "[1e-6, 100] m/s", "v_s, tendon speed within which it is built up", 1e-3
    )
    rub_1: float = quantity("[-1e4, 1e4] N", "control value of F, first", 0.0)
    rub_2: float = quantity("[-1e4, 1e4] N", "second", 0.0)
    rub_3: float = quantity("[-1e4, 1e4] N", "third", 0.0)
    rub_4: float = quantity("[-1e4, 1e4] N", "fourth", 0.0)
    rub_5: float = quantity("[-1e4, 1e4] N", "fifth", 0.0)
    rub_6: float = quantity("[-1e4, 1e4] N", "sixth", 0.0)
    rub_7: float = quantity("[-1e4, 1e4] N", "seventh", 0.0)
    rub_8: float = quantity("[-1e4, 1e4] N", "eighth", 0.0)


def learns(learned: Learned) -> bool:
    """Whether there is a curve."""
    if learned.rub_high > learned.rub_low:
        return True
    return learned.high > learned.low or learned.fastest > learned.slowest


def learned_force(learned: Learned, length: float, speed: float) -> float:
    """Force against the tendon's lengthening [N] at its length [m] and its speed [m/s]."""
    force = 0.0
    if learned.high > learned.low:
        u = place(length, learned.low, learned.high, LENGTH)
        force += (2.0 * learned.force_1 - learned.force_2) * bump(u + 1.0)
        force += (2.0 * learned.force_24 - learned.force_23) * bump(u - 24.0)
        force += learned.force_1 * bump(u) + learned.force_2 * bump(u - 1.0)
        force += learned.force_3 * bump(u - 2.0) + learned.force_4 * bump(u - 3.0)
        force += learned.force_5 * bump(u - 4.0) + learned.force_6 * bump(u - 5.0)
        force += learned.force_7 * bump(u - 6.0) + learned.force_8 * bump(u - 7.0)
        force += learned.force_9 * bump(u - 8.0) + learned.force_10 * bump(u - 9.0)
        force += learned.force_11 * bump(u - 10.0) + learned.force_12 * bump(u - 11.0)
        force += learned.force_13 * bump(u - 12.0) + learned.force_14 * bump(u - 13.0)
        force += learned.force_15 * bump(u - 14.0) + learned.force_16 * bump(u - 15.0)
        force += learned.force_17 * bump(u - 16.0) + learned.force_18 * bump(u - 17.0)
        force += learned.force_19 * bump(u - 18.0) + learned.force_20 * bump(u - 19.0)
        force += learned.force_21 * bump(u - 20.0) + learned.force_22 * bump(u - 21.0)
        force += learned.force_23 * bump(u - 22.0) + learned.force_24 * bump(u - 23.0)
    if learned.fastest > learned.slowest:
        drag = curve_of_8(
            speed,
            learned.slowest,
            learned.fastest,
            learned.drag_1,
            learned.drag_2,
            learned.drag_3,
            learned.drag_4,
            learned.drag_5,
            learned.drag_6,
            learned.drag_7,
            learned.drag_8,
        )
        if learned.brakes == 0.0 or drag * speed > 0.0:
            force += drag
    if learned.rub_high > learned.rub_low:
        dry = curve_of_8(
            length,
            learned.rub_low,
            learned.rub_high,
            learned.rub_1,
            learned.rub_2,
            learned.rub_3,
            learned.rub_4,
            learned.rub_5,
            learned.rub_6,
            learned.rub_7,
            learned.rub_8,
        )
        if learned.brakes == 0.0 or dry > 0.0:
            force += dry * math.tanh(speed / learned.rub_speed)
    return force
