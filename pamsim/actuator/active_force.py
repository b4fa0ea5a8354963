"""The active force of the law a muscle has chosen: one branch per law of the catalog.

Written out, not looked up in a table, because the compiled kernel can call a function only by name.
"""

from __future__ import annotations

import math

from pamsim.actuator.layout import Row, slot
from pamsim.actuator.muscle import FORCE_GROUPS
from pamsim.muscles.corrected_mckibben import CorrectedMcKibben, corrected_mckibben_force
from pamsim.muscles.elastic_energy import ElasticEnergy, elastic_energy_force
from pamsim.muscles.exponential import SixParameter, six_parameter_force
from pamsim.muscles.invertible_exponential import (
    InvertibleExponential,
    invertible_exponential_force,
)
from pamsim.muscles.mckibben import IdealMcKibben, ideal_force
from pamsim.muscles.mooney_rivlin import MooneyRivlin, mooney_rivlin_force
from pamsim.muscles.pleated import Pleated, pleated_force
from pamsim.muscles.pleated_shape import PleatedShape, pleated_shape_force
from pamsim.muscles.single_pressure_exponential import (
    SinglePressureExponential,
    single_pressure_force,
)

_LAW = slot("force.law")
_LENGTH = slot("braid.nominal_length")
_DIAMETER = slot("braid.diameter")
_ANGLE = slot("braid.fibre_angle")
_SCALE = slot("force.0")
_F = _SCALE + 1

_IDEAL = FORCE_GROUPS.index(IdealMcKibben)
_SIX = FORCE_GROUPS.index(SixParameter)
_CORRECTED = FORCE_GROUPS.index(CorrectedMcKibben)
_SINGLE = FORCE_GROUPS.index(SinglePressureExponential)
_INVERTIBLE = FORCE_GROUPS.index(InvertibleExponential)
_ELASTIC = FORCE_GROUPS.index(ElasticEnergy)
_PLEATED = FORCE_GROUPS.index(Pleated)
_SHAPE = FORCE_GROUPS.index(PleatedShape)
_MOONEY_RIVLIN = FORCE_GROUPS.index(MooneyRivlin)


def active_force(par: Row, pressure: float, contraction: float) -> float:
    """Signed force of the muscle's active law [N], its scale included.

    Args:
        par: parameter row.
        pressure: gauge pressure that reaches the braid [Pa].
        contraction: kappa [-].

    Returns:
        Force [N]; NaN for a code that no law has.
    """
    return par[_SCALE] * _unscaled(par, pressure, contraction)


def _unscaled(par: Row, p: float, kappa: float) -> float:
    law = par[_LAW]
    if law == _SIX:
        return six_parameter_force(
            p, kappa, par[_F], par[_F + 1], par[_F + 2], par[_F + 3], par[_F + 4], par[_F + 5]
        )
    if law == _IDEAL:
        length = (1.0 - kappa) * par[_LENGTH]
        return ideal_force(p, length, par[_LENGTH], par[_DIAMETER], par[_ANGLE])
    if law == _CORRECTED:
        return corrected_mckibben_force(
            p,
            kappa,
            par[_F],
            par[_F + 1],
            par[_F + 2],
            par[_F + 3],
            par[_F + 4],
            par[_DIAMETER],
            par[_ANGLE],
        )
    if law == _SINGLE:
        return single_pressure_force(p, kappa, par[_F], par[_F + 1], par[_F + 2], par[_F + 3])
    if law == _INVERTIBLE:
        return invertible_exponential_force(
            p,
            kappa,
            par[_F],
            par[_F + 1],
            par[_F + 2],
            par[_F + 3],
            par[_F + 4],
            par[_F + 5],
            par[_F + 6],
        )
    if law == _ELASTIC:
        return elastic_energy_force(p, kappa, par[_F], par[_F + 1], par[_DIAMETER], par[_ANGLE])
    if law == _PLEATED:
        return pleated_force(
            p,
            kappa,
            par[_F],
            par[_F + 1],
            par[_F + 2],
            par[_F + 3],
            par[_F + 4],
            par[_LENGTH],
        )
    if law == _SHAPE:
        return pleated_shape_force(p, kappa, par[_F], par[_LENGTH])
    if law == _MOONEY_RIVLIN:
        return mooney_rivlin_force(
            p,
            kappa,
            par[_F],
            par[_F + 1],
            par[_F + 2],
            par[_F + 3],
            par[_DIAMETER],
            par[_ANGLE],
        )
    return math.nan
