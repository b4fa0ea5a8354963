"""Matiskova 2021, the equations of its section 3: misprints, shown by what they would mean."""

from __future__ import annotations

from pamsim.actuator.kernel import static_force
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.antagonistic_pair import (
    MILLIMETRE,
    ideal_muscle,
    rig_muscle,
    row,
    stroke,
)
from pamsim.papers.claim import Claim, Verdict, holds
from pamsim.papers.root import root
from pamsim.store.printed import mas20_steps


def claims() -> list[Claim]:
    """Claims A-17 to A-21."""
    return [_rest_length(), _longer_and_stronger(), _contractions(), _sign_rule(), _radius()]


def _rest_length() -> Claim:
    muscle = ideal_muscle()
    longest, way = muscle.braid.nominal_length, stroke(muscle)
    return Claim(
        id="A-17",
        what="(1): rest length at the reference point",
        printed="l0 = l_max dl_max/2",
        recomputed="l0 = l_max - dl_max/2",
        unit="",
        verdict=Verdict.INCONSISTENT,
        reason="printed is a product and so an area; with a minus it is the middle of the stroke,"
        f" as the text says: for an ideal {longest / MILLIMETRE:.0f} mm muscle with fibres"
        f" at {muscle.braid.fibre_angle * DEG_PER_RAD:.1f} deg"
        f" {(longest - way / 2.0) / MILLIMETRE:.0f} mm, as printed {longest * way / 2.0:.4f} m^2",
    )


def _longer_and_stronger() -> Claim:
    law = row(rig_muscle())
    short, long, pressure = -10.0 * MILLIMETRE, 0.0, 300.0 * PA_PER_KPA
    force = static_force(law, short, pressure)
    equal = root(lambda p: static_force(law, long, p) - force, 0.0, pressure, 1e-3)
    return Claim(
        id="A-18",
        what="(7): equal forces at l1 << l2 and p1 << p2; pressure of the longer muscle",
        printed="p2 much larger than p1 = 300 kPa",
        recomputed=equal / PA_PER_KPA,
        unit="kPa",
        verdict=holds(equal > pressure, Verdict.INCONSISTENT),
        reason="force grows with length and with pressure in every law, so of two alike muscles of"
        " equal force the longer has the lower pressure; shown with the rig's law, muscle 1"
        " shorter by 10 mm. The signs were probably 'not equal'",
    )


def _contractions() -> Claim:
    muscle = ideal_muscle()
    longest, way = muscle.braid.nominal_length, stroke(muscle)
    rest = longest - way / 2.0
    sums = [
        (longest - (rest - turn)) + (longest - (rest + turn))
        for turn in (-0.4 * way, 0.0, 0.1 * way, 0.5 * way)
    ]
    off = max(abs(total - way) for total in sums)
    return Claim(
        id="A-19",
        what="contractions of both muscles add up to the maximum in every position; deviation",
        printed="k_AM1 + k_AM2 = k_max",
        recomputed=off / MILLIMETRE,
        unit="mm",
        verdict=holds(off <= 1e-12, Verdict.INCONSISTENT),
        reason="follows from (1) with its minus, (2) and (14): both change by the same length,"
        " oppositely; checked in four positions of a muscle with the"
        f" ideal law's stroke of {way / MILLIMETRE:.0f} mm, since k_max is not printed",
        tolerance=1e-12 / MILLIMETRE,
    )


def _sign_rule() -> Claim:
    steps = mas20_steps()
    one_full = [step for step in steps if min(step.pressure) == 0.0]
    first_vented = all(step.pressure[0] == 0.0 for step in one_full if step.angle < 0.0)
    return Claim(
        id="A-20",
        what="negative displacement: p = p_AM2 while p_AM2 is constant (sign rules under (9))",
        printed="p = p_AM2",
        recomputed="p = p_AM1" if first_vented else "p = p_AM2",
        unit="",
        verdict=holds(not first_vented, Verdict.INCONSISTENT),
        reason="in every fully vented row with a negative angle it is muscle 1 that is empty, as"
        " the same rule for beta says two lines above; the rule for l_d names the wrong muscle",
    )


def _radius() -> Claim:
    largest = max(abs(step.angle) for step in mas20_steps())
    way = stroke(ideal_muscle())
    bound = way / 2.0 / largest
    return Claim(
        id="A-21",
        what="(2): beta = dl / r, so the pulley radius r turns angles into lengths",
        printed="r is not printed",
        recomputed=None,
        unit="mm",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason=f"neither r nor a length is printed beside an angle; the largest angle,"
        f" {largest * DEG_PER_RAD:.2f} deg, needs dl <= dl_max/2, so r <= {bound / MILLIMETRE:.0f}"
        f" mm for a stroke of {way / MILLIMETRE:.0f} mm. Torques, forces and N m/rad of the"
        " printed rows therefore stay unknown",
    )
