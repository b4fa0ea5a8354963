"""Every force law: its card under one signature, and its branch in the compiled kernel.

What lists, fits and compares laws works on `FORCE_LAWS`; the actuator calls `chosen_force` and
`chosen_volume`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.muscles.braid import Braid, max_contraction
from pamsim.muscles.corrected_mckibben import (
    VALID_FROM,
    CorrectedMcKibben,
    corrected_mckibben_force,
    corrected_mckibben_volume,
    corrected_mckibben_work,
)
from pamsim.muscles.effective_area import (
    EffectiveArea,
    effective_area_elastic_work,
    effective_area_force,
    effective_area_volume,
)
from pamsim.muscles.elastic_energy import (
    ElasticEnergy,
    contractive_force,
    elastic_energy_force,
    elastic_energy_volume,
)
from pamsim.muscles.exponential import (
    SixParameter,
    six_parameter_derivatives,
    six_parameter_elastic_work,
    six_parameter_force,
    six_parameter_volume,
)
from pamsim.muscles.force_law import ForceLaw, Range, Scalars
from pamsim.muscles.invertible_exponential import (
    InvertibleExponential,
    invertible_exponential_force,
    invertible_exponential_volume,
)
from pamsim.muscles.mckibben import (
    IdealMcKibben,
    ideal_force,
    ideal_volume,
)
from pamsim.muscles.mooney_rivlin import (
    MooneyRivlin,
    mooney_rivlin_elastic_work,
    mooney_rivlin_force,
    mooney_rivlin_volume,
)
from pamsim.muscles.pleated import (
    FIT_RANGE,
    Pleated,
    pleated_force,
    pleated_volume,
)
from pamsim.muscles.pleated_shape import (
    PleatedShape,
    pleated_max_contraction,
    pleated_shape_force,
    pleated_shape_volume,
)
from pamsim.muscles.single_pressure_exponential import (
    SinglePressureExponential,
    single_pressure_force,
    single_pressure_volume,
    single_pressure_work,
)

Row: TypeAlias = Sequence[float] | NDArray[np.float64]


def _by_length(function: Scalars) -> Scalars:
    """A function of muscle length and nominal length as one of contraction and nominal length."""

    @functools.wraps(function)
    def by_contraction(
        first: float, contraction: float, nominal_length: float, *rest: float
    ) -> float:
        return function(first, (1.0 - contraction) * nominal_length, nominal_length, *rest)

    return by_contraction


def _festo(coefficients: Sequence[float], braid: Braid) -> Range:
    """Contraction of Festo's DMSP muscles: at most 25 % by data sheet (Nguyen 2024, Sarosi)."""
    return 0.0, 0.25


def _to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """Up to the contraction at which the ideal braid stops pulling."""
    return 0.0, max_contraction(braid.fibre_angle)


def _half_stroke(coefficients: Sequence[float], braid: Braid) -> Range:
    """Strokes about that at which the spring is free, up to half of it compressed or stretched."""
    return -0.5, 0.5


def _fitted(coefficients: Sequence[float], braid: Braid) -> Range:
    """The range in which the coefficients of a pleated muscle are fitted."""
    return FIT_RANGE


def _pleated_to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """From where the fibres no longer stretch to where the pull of a pleated muscle ends."""
    return FIT_RANGE[0], pleated_max_contraction(coefficients[1])


_FESTO_PRESSURES: Range = (0.0, 6e5)
_PLEATED_PRESSURES: Range = (1e5, 2.5e5)

_LAWS: tuple[ForceLaw, ...] = (
    ForceLaw(
        title="Ideal McKibben muscle",
        equation="F = p pi r0^2 (3 (1 - kappa)^2 / tan^2(alpha0) - 1 / sin^2(alpha0)) = -p dV/dl",
        source="Sarosi, equation (1); Matiskova 2021, equation (3)",
        group=IdealMcKibben,
        force_function=_by_length(ideal_force),
        volume_function=ideal_volume,
        braid_fields=("nominal_length", "diameter", "fibre_angle"),
        pressure_range=(0.0, math.inf),
        limits=_to_largest,
        notes="Virtual work alone: no rubber, no end caps, the same largest contraction at every"
        " pressure. Overestimates the pull of a real muscle.",
    ),
    ForceLaw(
        title="Six-parameter exponential",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f",
        source="Sarosi, equation (4) with its d and f zero; inverse (5)",
        group=SixParameter,
        force_function=six_parameter_force,
        volume_function=six_parameter_volume,
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="A fit to Festo DMSP muscles; constants in pamsim.muscles.published. exp(c kappa)"
        " grows steeply for a stretched muscle, kappa < 0, where nothing was measured.",
    ),
    ForceLaw(
        title="McKibben muscle with two corrections",
        equation="F = mu p pi r0^2 (a (1 - eps kappa)^2 - b), a = 3 / tan^2(alpha0),"
        " b = 1 / sin^2(alpha0), eps = a_eps exp(-p/bar) - b_eps,"
        " mu = a_kappa exp(-k0 kappa) - b_kappa",
        source="Sarosi, equation (2)",
        group=CorrectedMcKibben,
        force_function=corrected_mckibben_force,
        volume_function=corrected_mckibben_volume,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=(VALID_FROM, _FESTO_PRESSURES[1]),
        limits=_festo,
        notes="Vouched for from 2 bar on. The inverse is unique above the threshold pressure if"
        " a_eps kappa >= 0 and NaN otherwise. scale and the pair (a_kappa, b_kappa) multiply the"
        " same force: fit one or the other. The volume changes with pressure at a held"
        " length; below 2 bar it is that at 2 bar, so force and volume do not do the same work.",
    ),
    ForceLaw(
        title="Exponential at one pressure",
        equation="F = a exp(b kappa) + d kappa + e",
        source="Sarosi, equation (3) with its c folded into a",
        group=SinglePressureExponential,
        force_function=single_pressure_force,
        volume_function=single_pressure_volume,
        pressure_range=None,
        limits=_festo,
        notes="One isobar: the force does not change with pressure, so the law fits a force map at"
        " one pressure and must not drive a muscle whose pressure changes.",
    ),
    ForceLaw(
        title="Invertible exponential",
        equation="F = (a p + b) exp(c kappa) + (e p + f) kappa + g p + h",
        source="Sarosi, equation (4) with its d folded into a and b; inverse (5)",
        group=InvertibleExponential,
        force_function=invertible_exponential_force,
        volume_function=invertible_exponential_volume,
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="The six-parameter law and one term more, f kappa. No constants are published.",
    ),
    ForceLaw(
        title="Restoring force of the air",
        equation="F = -p dV/dl + p1 dV/dl(l1)",
        source="Nguyen 2024, equations (3) and (5), signs by virtual work",
        group=ElasticEnergy,
        force_function=elastic_energy_force,
        volume_function=elastic_energy_volume,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=(0.0, math.inf),
        limits=_to_largest,
        notes="Counts from a working point and is zero there: without the load carried at that"
        " point it is not the tension of the muscle, and a limit to tension would cut half of it.",
    ),
    ForceLaw(
        title="Pleated muscle, fitted force function",
        equation="F = p l0^2 (f0 / eps + f1 + f2 eps + f3 eps^2 + f4 eps^3)",
        source="Van Damme 2008, equations (1) and (2)",
        group=Pleated,
        force_function=pleated_force,
        volume_function=pleated_volume,
        braid_fields=("nominal_length",),
        pressure_range=_PLEATED_PRESSURES,
        limits=_fitted,
        notes="NaN at and below zero contraction, too large below 5 %. Coefficients for l0/R = 6 in"
        " pamsim.muscles.pleated. Leave braid.extensibility 0. The braid's diameter is that of the"
        " end discs: its cylinder is the volume at nominal length.",
    ),
    ForceLaw(
        title="Pleated muscle, exact shape for many fibres",
        equation="F = p l0^2 pi (1 - 2 m) / (2 F(a|m)^2), l0/R = F(a|m) / (sqrt(m) cos(a)),"
        " eps = 2 (1 - E(a|m) / F(a|m))",
        source="Van Damme 2008, equation (1), derived from zero hoop stress",
        group=PleatedShape,
        force_function=pleated_shape_force,
        volume_function=pleated_shape_volume,
        braid_fields=("nominal_length",),
        pressure_range=_PLEATED_PRESSURES,
        limits=_pleated_to_largest,
        notes="The limit of many fibres: Van Damme 2008 measures less with 25 fibres than with 40."
        " NaN at and below zero contraction; leave braid.extensibility 0. Its cylinder at nominal"
        " length is the braid's: give it the diameter 2 R of the end discs.",
    ),
    ForceLaw(
        title="McKibben muscle with an elastic tube",
        equation="F = -p dV/dl - c1 I1'(k) / 2 - c2 I2'(k) / 2,"
        " k = (kappa - slack_contraction) / active_share",
        source="Klute and Hannaford 2000, with free length and end effect",
        group=MooneyRivlin,
        force_function=mooney_rivlin_force,
        volume_function=mooney_rivlin_volume,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="I1, I2: Mooney-Rivlin invariants of a tube that follows the braid. c1 + c2 is the"
        " stiffness at small strain; either may be negative, as constants of the whole wall. The"
        " scale takes up the difference between inner and working diameter.",
    ),
    ForceLaw(
        title="Bellows or piston",
        equation="F = -p A + k (s - s0), kappa = 1 - s/s0",
        source="ISO 5598 (2020), effective area; EquiMus (2025)",
        group=EffectiveArea,
        force_function=effective_area_force,
        volume_function=effective_area_volume,
        braid_fields=("nominal_length",),
        pressure_range=(0.0, math.inf),
        limits=_half_stroke,
        pushes=True,
        notes="Pushes: its force is negative. The group stroke takes the place of braid; passive,"
        " threshold, end_shape and chain have no meaning for it. The effective area of a real"
        " bellows falls somewhat with the stroke.",
    ),
)

FORCE_LAWS: Mapping[str, ForceLaw] = MappingProxyType({law.name: law for law in _LAWS})
"""Every force law by its name."""

_CODES = {law.group: code for code, law in enumerate(_LAWS)}
_IDEAL = _CODES[IdealMcKibben]
_SIX = _CODES[SixParameter]
_CORRECTED = _CODES[CorrectedMcKibben]
_SINGLE = _CODES[SinglePressureExponential]
_INVERTIBLE = _CODES[InvertibleExponential]
_ELASTIC = _CODES[ElasticEnergy]
_PLEATED = _CODES[Pleated]
_SHAPE = _CODES[PleatedShape]
_MOONEY_RIVLIN = _CODES[MooneyRivlin]
_EFFECTIVE_AREA = _CODES[EffectiveArea]

_APART, _ABOVE = 1e-6, 10.0  # steps of difference quotients: contraction [-], pressure [Pa]


def chosen_force(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """Force of the law with a code, without its scale [N]; NaN for a code that no law has.

    Written out, not looked up in a table: the compiled kernel can call a function only by name.

    Args:
        law: code of the law, its place in `FORCE_LAWS`.
        par: parameter row of a muscle.
        f: index in the row of the first coefficient after the scale.
        braid: index in the row of the first field of `Braid`.
        pressure: gauge pressure that reaches the braid [Pa].
        contraction: kappa [-].
    """
    p, kappa = pressure, contraction
    length, diameter, angle = par[braid], par[braid + 1], par[braid + 2]
    if law == _SIX:
        return six_parameter_force(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], par[f + 5]
        )
    if law == _IDEAL:
        return ideal_force(p, (1.0 - kappa) * length, length, diameter, angle)
    if law == _CORRECTED:
        return corrected_mckibben_force(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], diameter, angle
        )
    if law == _SINGLE:
        return single_pressure_force(p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3])
    if law == _INVERTIBLE:
        return invertible_exponential_force(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], par[f + 5], par[f + 6]
        )
    if law == _ELASTIC:
        return elastic_energy_force(p, kappa, par[f], par[f + 1], diameter, angle)
    if law == _PLEATED:
        return pleated_force(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], length
        )
    if law == _SHAPE:
        return pleated_shape_force(p, kappa, par[f], length)
    if law == _MOONEY_RIVLIN:
        return mooney_rivlin_force(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], diameter, angle
        )
    if law == _EFFECTIVE_AREA:
        return effective_area_force(p, kappa, par[f], par[f + 1], length)
    return math.nan


def chosen_volume(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """Volume gained since nominal length under the law with a code, per nominal length [m^2].

    Without the scale; NaN for a code that no law has. The arguments are those of `chosen_force`.
    """
    p, kappa = pressure, contraction
    length, diameter, angle = par[braid], par[braid + 1], par[braid + 2]
    if law == _SIX:
        return six_parameter_volume(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], par[f + 5]
        )
    if law == _IDEAL:
        return ideal_volume(p, kappa, length, diameter, angle)
    if law == _CORRECTED:
        return corrected_mckibben_volume(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], diameter, angle
        )
    if law == _SINGLE:
        return single_pressure_volume(p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3])
    if law == _INVERTIBLE:
        return invertible_exponential_volume(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], par[f + 5], par[f + 6]
        )
    if law == _ELASTIC:
        return elastic_energy_volume(p, kappa, par[f], par[f + 1], diameter, angle)
    if law == _PLEATED:
        return pleated_volume(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], length
        )
    if law == _SHAPE:
        return pleated_shape_volume(p, kappa, par[f], length)
    if law == _MOONEY_RIVLIN:
        return mooney_rivlin_volume(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], diameter, angle
        )
    if law == _EFFECTIVE_AREA:
        return effective_area_volume(p, kappa, par[f], par[f + 1], length)
    return math.nan


def chosen_work(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float, gained: float
) -> float:
    """Work at one pressure from nominal length on under the law with a code [N].

    Per nominal length and without the scale: the integral of the force by contraction. Where the
    force is linear in pressure it is the pressure times the volume gained, and the work of the part
    without pressure. NaN for a code that no law has.

    The arguments are those of `chosen_force`, and ``gained``, the `chosen_volume` of the same place
    [m^2], so that it need not be computed again.
    """
    p, kappa = pressure, contraction
    diameter, angle = par[braid + 1], par[braid + 2]
    if law == _CORRECTED:
        return corrected_mckibben_work(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], diameter, angle
        )
    work = p * gained
    if law == _SIX:
        return work + six_parameter_elastic_work(kappa, par[f + 1], par[f + 2], par[f + 5])
    if law == _SINGLE:
        return work + single_pressure_work(kappa, par[f], par[f + 1], par[f + 2], par[f + 3])
    if law == _INVERTIBLE:
        elastic = six_parameter_elastic_work(kappa, par[f + 1], par[f + 2], par[f + 6])
        return work + elastic + 0.5 * par[f + 4] * kappa * kappa
    if law == _ELASTIC:
        return work - contractive_force(par[f], par[f + 1], diameter, angle) * kappa
    if law == _MOONEY_RIVLIN:
        return work + mooney_rivlin_elastic_work(
            kappa, par[f], par[f + 1], par[f + 2], par[f + 3], angle
        )
    if law == _EFFECTIVE_AREA:
        return work + effective_area_elastic_work(kappa, par[f + 1], par[braid])
    return work


def chosen_derivatives(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> tuple[float, float, float, float, float]:
    """Force, its derivatives, and its integrals, together, for a search by Newton's method.

    The arguments are those of `chosen_force`. Where a law has no quicker way the derivatives are
    difference quotients, which is enough for a search.

    Returns:
        `chosen_force` [N], its derivatives by contraction [N] and by pressure [m^2], and
        `chosen_volume` [m^2] and `chosen_work` [N].
    """
    p, kappa = pressure, contraction
    if law == _SIX:
        return six_parameter_derivatives(
            p, kappa, par[f], par[f + 1], par[f + 2], par[f + 3], par[f + 4], par[f + 5]
        )
    force = chosen_force(law, par, f, braid, p, kappa)
    further = chosen_force(law, par, f, braid, p, kappa + _APART)
    rising = (further - force) / _APART
    higher = chosen_force(law, par, f, braid, p + _ABOVE, kappa)
    per_pressure = (higher - force) / _ABOVE
    gained = chosen_volume(law, par, f, braid, p, kappa)
    return force, rising, per_pressure, gained, chosen_work(law, par, f, braid, p, kappa, gained)


def volume_depends_on_pressure(law: float) -> bool:
    """Whether a law's volume changes with pressure at a held length: its force is not linear."""
    return law == _CORRECTED


def pushes(law: float) -> bool:
    """Whether a law's force may push; that of a muscle is limited to tension."""
    return law == _EFFECTIVE_AREA
