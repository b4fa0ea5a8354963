"""The force law that a muscle's row names, for the compiled kernel.

Written out, not looked up in a table: the compiled kernel can call a function only by name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.catalog import USER_DEFINED
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.corrected_mckibben import (
    CorrectedMcKibben,
    corrected_mckibben_force,
    corrected_mckibben_volume,
    corrected_mckibben_work,
)
from pamsim.physics.force_laws.effective_area import (
    EffectiveArea,
    effective_area_elastic_work,
    effective_area_force,
    effective_area_volume,
)
from pamsim.physics.force_laws.elastic_energy import (
    ElasticEnergy,
    contractive_force,
    elastic_energy_force,
    elastic_energy_volume,
)
from pamsim.physics.force_laws.exponential import (
    SixParameter,
    six_parameter_derivatives,
    six_parameter_elastic_work,
    six_parameter_force,
    six_parameter_volume,
)
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.force_laws.invertible_exponential import (
    InvertibleExponential,
    invertible_exponential_force,
    invertible_exponential_volume,
)
from pamsim.physics.force_laws.mckibben import (
    IdealMcKibben,
    ideal_force,
    ideal_volume,
)
from pamsim.physics.force_laws.mooney_rivlin import (
    MooneyRivlin,
    mooney_rivlin_elastic_work,
    mooney_rivlin_force,
    mooney_rivlin_volume,
)
from pamsim.physics.force_laws.pleated import (
    Pleated,
    pleated_force,
    pleated_volume,
)
from pamsim.physics.force_laws.pleated_shape import (
    PleatedShape,
    pleated_shape_force,
    pleated_shape_volume,
)
from pamsim.physics.force_laws.single_pressure_exponential import (
    SinglePressureExponential,
    single_pressure_force,
    single_pressure_volume,
    single_pressure_work,
)
from pamsim.physics.force_laws.swept_volume import GAUSS

Row: TypeAlias = Sequence[float] | NDArray[np.float64]

_IDEAL = FORCE_LAWS.code(IdealMcKibben)
_SIX = FORCE_LAWS.code(SixParameter)
_CORRECTED = FORCE_LAWS.code(CorrectedMcKibben)
_SINGLE = FORCE_LAWS.code(SinglePressureExponential)
_INVERTIBLE = FORCE_LAWS.code(InvertibleExponential)
_ELASTIC = FORCE_LAWS.code(ElasticEnergy)
_PLEATED = FORCE_LAWS.code(Pleated)
_SHAPE = FORCE_LAWS.code(PleatedShape)
_MOONEY_RIVLIN = FORCE_LAWS.code(MooneyRivlin)
_EFFECTIVE_AREA = FORCE_LAWS.code(EffectiveArea)

_APART, _ABOVE = 1e-6, 10.0  # steps of difference quotients: contraction [-], pressure [Pa]


def chosen_force(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """Force of the law with a code, without its scale [N]; NaN for a code that no law has.

    Args:
        law: code of the law, see `pamsim.core.catalog.Catalog.code`.
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
    if law >= USER_DEFINED:
        return user_force(law, par, f, braid, p, kappa)
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
    if law >= USER_DEFINED:
        return user_volume(law, par, f, braid, p, kappa)
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
    if law >= USER_DEFINED:
        return user_work(law, par, f, braid, p, kappa)
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
    return law == _CORRECTED or law >= USER_DEFINED


def pushes(law: float) -> bool:
    """Whether a law's force may push; that of a muscle is limited to tension."""
    return law == _EFFECTIVE_AREA or (law >= USER_DEFINED and law % 2.0 == 1.0)


def user_force(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """`chosen_force` of a law from outside the package [N]; NaN if it is not loaded.

    The compiled kernel finds the same function by `pamsim.engine.user_laws`.
    """
    card = FORCE_LAWS.with_code(law)
    if card is None:
        return math.nan
    return card.force_function(pressure, contraction, *_arguments(card, par, f, braid))


def user_volume(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """`chosen_volume` of a law from outside the package [m^2]; NaN if it is not loaded."""
    card = FORCE_LAWS.with_code(law)
    if card is None:
        return math.nan
    return card.volume_function(pressure, contraction, *_arguments(card, par, f, braid))


def _arguments(card: ForceLaw, par: Row, f: int, braid: int) -> list[float]:
    """What a law's functions take after pressure and contraction, from a muscle's row."""
    coefficients, geometry = card.argument_places
    return [par[f + i] for i in coefficients] + [par[braid + i] for i in geometry]


def user_work(
    law: float, par: Row, f: int, braid: int, pressure: float, contraction: float
) -> float:
    """`chosen_work` of a law from outside the package [N], by ten points of Gauss."""
    work = 0.0
    for node, weight in GAUSS:
        for at in (0.5 - 0.5 * node, 0.5 + 0.5 * node):
            work += weight * user_force(law, par, f, braid, pressure, at * contraction)
    return 0.5 * work * contraction
