"""McKibben muscles: the virtual work of the braid, that about a working point, and a correction.

The ideal law is virtual work and nothing else, F = -p dV/dl (Sarosi, equation (1)).

The restoring force of the air (Nguyen 2024, equations (3) and (5)) counts from a working point. A
muscle filled to P1 and held at length l1 pulls with F_con = -(P1 - Patm) dV/dl at l1. Pulled to
another length l, at which the pressure is P, its air pulls back with the rest,
F_air = -(P - Patm) dV/dl + (P1 - Patm) dV/dl at l1. The print has lost the signs; these are the
ones that virtual work requires.

The corrected law (Sarosi, equation (2)) is F = mu p pi r0^2 (a (1 - eps kappa)^2 - b) with
a = 3 / tan^2(alpha0), b = 1 / sin^2(alpha0), eps = a_eps exp(-p/bar) - b_eps and
mu = a_kappa exp(-k0 kappa) - b_kappa; it is ideal for a_eps = a_kappa = 0, b_eps = b_kappa = -1.
eps makes the largest contraction depend on pressure, mu lowers the force near nominal length. The
paper puts p in bar into exp(-p): here p is in Pa and divided by one bar inside eps. Where
a_eps kappa >= 0 the pull grows with pressure from the threshold on, at which 1 - eps kappa reaches
sqrt(b/a). Far below it, where eps kappa > 1 + sqrt(b/a), the square turns a negative 1 - eps kappa
into a pull that no muscle has: with constants fitted to force maps (a_eps near 15) below about
1 bar at 20 % contraction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pamsim.core.parameters import quantity
from pamsim.core.units import PA_PER_BAR
from pamsim.physics.braid import Braid, max_contraction, volume_gained, volume_slope
from pamsim.physics.force_laws.force_law import FESTO_PRESSURES, ForceLaw, ForceParameters, Range


def _to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """Up to the contraction at which the ideal braid stops pulling."""
    return 0.0, max_contraction(braid.fibre_angle)


class IdealMcKibben(ForceParameters, law="ideal_mckibben"):
    """The ideal law has the braid for its parameters; only its overall scale is free."""


def ideal_force(
    pressure: float, length: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """Force F = -p dV/dl [N] of an ideal braided muscle (Sarosi, (1); Matiskova 2021, (3)).

    Positive when the muscle pulls, not limited to tension. The arguments are gauge pressure p [Pa],
    length l [m], and l0 [m], D0 [m] and alpha0 [rad] of `Braid`.
    """
    return -pressure * volume_slope(length, nominal_length, diameter, fibre_angle)


def ideal_tension(
    pressure: float, contraction: float, nominal_length: float, diameter: float, fibre_angle: float
) -> float:
    """`ideal_force` [N] at a contraction kappa = 1 - l/l0 [-] instead of a length."""
    length = (1.0 - contraction) * nominal_length
    return ideal_force(pressure, length, nominal_length, diameter, fibre_angle)


IDEAL = ForceLaw(
    title="Ideal McKibben muscle",
    equation="F = p pi r0^2 (3 (1 - kappa)^2 / tan^2(alpha0) - 1 / sin^2(alpha0)) = -p dV/dl",
    source="Sarosi, equation (1); Matiskova 2021, equation (3)",
    group=IdealMcKibben,
    force_function=ideal_tension,
    volume_function=volume_gained,
    volume_varies=False,
    braid_fields=("nominal_length", "diameter", "fibre_angle"),
    pressure_range=(0.0, math.inf),
    limits=_to_largest,
    notes="Virtual work alone: no rubber, no end caps, the same largest contraction at every"
    " pressure. Overestimates the pull of a real muscle.",
)


class ElasticEnergy(ForceParameters, law="elastic_energy"):
    """The working point from which the restoring force counts."""

    working_pressure: float = quantity(
        "[0, 2e6] Pa", "gauge pressure P1 - Patm at the working point"
    )
    working_contraction: float = quantity(
        "[-0.3, 0.5]", "contraction 1 - l1/l0 at the working point"
    )


def elastic_energy_force(
    pressure: float,
    contraction: float,
    working_pressure: float,
    working_contraction: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Restoring force F_air [N]: the pull beyond that at the working point (Nguyen 2024, (5)).

    The arguments are gauge pressure P - Patm [Pa], contraction kappa [-], the fields of
    `ElasticEnergy` after its scale, and D0 [m] and alpha0 [rad] of `Braid`.
    """
    # dV/dl depends on l/l0 alone, so lengths are taken in units of l0.
    held = ideal_tension(working_pressure, working_contraction, 1.0, diameter, fibre_angle)
    return ideal_tension(pressure, contraction, 1.0, diameter, fibre_angle) - held


def elastic_energy_work(
    contraction: float,
    working_pressure: float,
    working_contraction: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Work of the constant part from nominal length on, per nominal length [N]."""
    held = ideal_tension(working_pressure, working_contraction, 1.0, diameter, fibre_angle)
    return -held * contraction


RESTORING = ForceLaw(
    title="Restoring force of the air",
    equation="F = -p dV/dl + p1 dV/dl(l1)",
    source="Nguyen 2024, equations (3) and (5), signs by virtual work",
    group=ElasticEnergy,
    force_function=elastic_energy_force,
    volume_function=volume_gained,
    work_function=elastic_energy_work,
    volume_varies=False,
    braid_fields=("diameter", "fibre_angle"),
    pressure_range=(0.0, math.inf),
    limits=_to_largest,
    notes="Counts from a working point and is zero there: without the load carried at that"
    " point it is not the tension of the muscle, and a limit to tension would cut half of it.",
)
_VALID_FROM = 2e5  # gauge pressure from which the source of the corrected law claims validity [Pa]


class CorrectedMcKibben(ForceParameters, law="corrected_mckibben"):
    """The four fitted constants and the decay that the paper fixes at 40."""

    a_eps: float = quantity("[-100, 100]", "part of eps that dies with pressure")
    b_eps: float = quantity("[-10, 10]", "minus eps at high pressure; -1 is ideal")
    a_kappa: float = quantity("[-100, 100]", "part of mu that dies with contraction")
    b_kappa: float = quantity("[-10, 10]", "minus mu at large contraction; -1 is ideal")
    k0: float = quantity("[0, 200]", "decay of mu with contraction", 40.0)


def corrected_mckibben_force(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Force [N] of the corrected McKibben law (Sarosi, equation (2)), not limited to tension.

    The arguments are gauge pressure p [Pa], contraction kappa [-], the fields of
    `CorrectedMcKibben` after its scale, and D0 = 2 r0 [m] and alpha0 [rad] of `Braid`.
    """
    mu = a_kappa * math.exp(-k0 * contraction) - b_kappa
    stretch = 1.0 - (a_eps * math.exp(-pressure / PA_PER_BAR) - b_eps) * contraction
    return mu * ideal_force(pressure, stretch, 1.0, diameter, fibre_angle)


def corrected_mckibben_volume(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Volume gained since nominal length, per nominal length [m^2]: pi r0^2 d(p J)/dp.

    J is the integral from 0 to kappa of mu (a (1 - eps kappa)^2 - b). Below 2 bar the volume is
    that at 2 bar: the printed formula would make it negative there.
    """
    if pressure < _VALID_FROM:
        pressure = _VALID_FROM
    fading = a_eps * math.exp(-pressure / PA_PER_BAR)
    inside, by_eps = _swept(contraction, fading - b_eps, a_kappa, b_kappa, k0, fibre_angle)
    inside -= pressure / PA_PER_BAR * fading * by_eps
    return 0.25 * math.pi * diameter * diameter * inside


def corrected_mckibben_work(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Work p pi r0^2 J at one pressure from nominal length on, per nominal length [N]."""
    eps = a_eps * math.exp(-pressure / PA_PER_BAR) - b_eps
    inside, _ = _swept(contraction, eps, a_kappa, b_kappa, k0, fibre_angle)
    return 0.25 * math.pi * diameter * diameter * pressure * inside


def _swept(
    contraction: float, eps: float, a_kappa: float, b_kappa: float, k0: float, fibre_angle: float
) -> tuple[float, float]:
    """J and dJ/deps, by the integrals of mu, mu kappa and mu kappa^2."""
    x, exponent = contraction, k0 * contraction
    zeroth, first, second = 0.0, 0.0, 0.0  # of exp(-k0 kappa) in the place of mu
    if abs(exponent) < 1.0:
        term = 1.0
        for j in range(18):
            zeroth += term * x / (1 + j)
            first += term * x * x / (2 + j)
            second += term * x * x * x / (3 + j)
            term *= -exponent / (j + 1)
    else:
        left = math.exp(-exponent)
        zeroth = (1.0 - left) / k0
        first = (zeroth - x * left) / k0
        second = (2.0 * first - x * x * left) / k0
    zeroth = a_kappa * zeroth - b_kappa * x
    first = a_kappa * first - b_kappa * x * x / 2.0
    second = a_kappa * second - b_kappa * x * x * x / 3.0
    b = 1.0 / math.sin(fibre_angle) ** 2
    a = 3.0 * (b - 1.0)
    inside = (a - b) * zeroth + a * eps * (eps * second - 2.0 * first)
    return inside, 2.0 * a * (eps * second - first)


CORRECTED = ForceLaw(
    title="McKibben muscle with two corrections",
    equation="F = mu p pi r0^2 (a (1 - eps kappa)^2 - b), a = 3 / tan^2(alpha0),"
    " b = 1 / sin^2(alpha0), eps = a_eps exp(-p/bar) - b_eps,"
    " mu = a_kappa exp(-k0 kappa) - b_kappa",
    source="Sarosi, equation (2)",
    group=CorrectedMcKibben,
    force_function=corrected_mckibben_force,
    volume_function=corrected_mckibben_volume,
    work_function=corrected_mckibben_work,
    braid_fields=("diameter", "fibre_angle"),
    pressure_range=(_VALID_FROM, FESTO_PRESSURES[1]),
    notes="Vouched for from 2 bar on. The inverse is unique above the threshold pressure if"
    " a_eps kappa >= 0 and NaN otherwise. scale and the pair (a_kappa, b_kappa) multiply the"
    " same force: fit one or the other. The volume changes with pressure at a held"
    " length; below 2 bar it is that at 2 bar, so force and volume do not do the same work.",
)
