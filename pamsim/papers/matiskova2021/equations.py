"""Matiskova 2021, the equations of its section 3: misprints, shown by what they would mean."""

from __future__ import annotations

import numpy as np

from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.antagonistic_pair import (
    MILLIMETRE,
    ideal_muscle,
    published_muscle,
    rest_travel,
    rig_muscle,
    sprocket_radius,
    stroke,
)
from pamsim.papers.claim import AGREES, Recomputed, agreeing, recomputes
from pamsim.papers.numerics import rms, root
from pamsim.papers.torque_law import printed_rows_law
from pamsim.physics.record import parameters
from pamsim.physics.static_muscle import static_force
from pamsim.recordings.printed import Printed, distinct_steps, mas20_steps


@recomputes("matiskova2021-17")
def _rest_length() -> Recomputed:
    muscle = ideal_muscle()
    longest, way = muscle.braided.nominal_length, stroke(muscle)
    middle = longest - way / 2.0
    return Recomputed(
        longest * way / 2.0,
        **agreeing(middle),
        longest=longest / MILLIMETRE,
        fibre_angle=muscle.braided.fibre_angle * DEG_PER_RAD,
        middle=middle,
    )


def mounted(length: float) -> tuple[float, float]:
    """RMS miss [rad] of the distinct rows by published muscles mounted at a length [m].

    Travel does not depend on the radius of the sprocket, so the best radius, which is the second
    number [m], is one least squares.
    """
    muscle, steps = published_muscle(length), distinct_steps()
    travel = np.array([rest_travel(muscle, step.pressure) for step in steps])
    angle = np.array([step.angle for step in steps])
    per_travel = float(travel @ angle / (travel @ travel))
    return rms(per_travel * travel - angle), 1.0 / per_travel


@recomputes("matiskova2021-44")
def _half_stroke() -> Recomputed:
    longest = ideal_muscle().braided.nominal_length
    middle = longest - stroke(ideal_muscle()) / 2.0
    miss, radius = mounted(middle)
    nominal, _ = mounted(longest)
    lengths = np.linspace(middle, longest, 12).tolist()
    least, _, best = min((*mounted(length), length) for length in lengths)
    return Recomputed(
        miss * DEG_PER_RAD,
        high=printed_rows_law().left_out_rms_deg,
        middle=middle / MILLIMETRE,
        radius=radius / MILLIMETRE,
        longest=longest / MILLIMETRE,
        nominal=nominal * DEG_PER_RAD,
        least=least * DEG_PER_RAD,
        best=best / MILLIMETRE,
        slack=(longest - middle) / sprocket_radius() * DEG_PER_RAD,
        rows_deg=printed_rows_law().left_out_rms_deg,
    )


@recomputes("matiskova2021-18")
def _longer_and_stronger() -> Recomputed:
    law = parameters(rig_muscle())
    short, long, pressure = -10.0 * MILLIMETRE, 0.0, 300.0 * PA_PER_KPA
    force = static_force(law, short, pressure)
    equal = root(lambda p: static_force(law, long, p) - force, 0.0, pressure, 1e-3)
    return Recomputed(equal / PA_PER_KPA, low=pressure / PA_PER_KPA)


@recomputes("matiskova2021-19")
def _contractions() -> Recomputed:
    muscle = ideal_muscle()
    longest, way = muscle.braided.nominal_length, stroke(muscle)
    rest = longest - way / 2.0
    sums = [
        (longest - (rest - turn)) + (longest - (rest + turn))
        for turn in (-0.4 * way, 0.0, 0.1 * way, 0.5 * way)
    ]
    off = max(abs(total / way - 1.0) for total in sums)
    return Recomputed(off, high=AGREES, stroke=way / MILLIMETRE)


@recomputes("matiskova2021-20")
def _sign_rule() -> Recomputed:
    """Of the fully vented rows with a negative angle, those in which muscle 2 is the vented one."""
    vented = [step for step in mas20_steps() if min(step.pressure) == 0.0 and step.angle < 0.0]
    second = sum(step.pressure[1] == 0.0 for step in vented)
    return Recomputed(float(second), printed=Printed(float(len(vented)), 0.0))


@recomputes("matiskova2021-21")
def _radius() -> Recomputed:
    largest = max(abs(step.angle) for step in mas20_steps())
    way = stroke(ideal_muscle())
    return Recomputed(
        way / 2.0 / largest / MILLIMETRE,
        angle=largest * DEG_PER_RAD,
        stroke=way / MILLIMETRE,
    )
