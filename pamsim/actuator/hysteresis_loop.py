"""The hysteresis operator a muscle has chosen: one branch per operator of the catalog.

Written out, not looked up in a table, because the compiled kernel can call a function only by name.
"""

from __future__ import annotations

import math

from pamsim.actuator.layout import MutableRow, Row, slot
from pamsim.actuator.muscle import HYSTERESIS_GROUPS
from pamsim.hysteresis.arctangent import Arctangent, arctangent_output, arctangent_rates
from pamsim.hysteresis.bouc_wen import BoucWen, bouc_wen_output, bouc_wen_rates
from pamsim.hysteresis.fractional_maxwell import (
    FractionalMaxwell,
    fractional_maxwell_output,
    fractional_maxwell_rates,
)
from pamsim.hysteresis.group import COMMON_FIELDS
from pamsim.hysteresis.maxwell_slip import MaxwellSlip, maxwell_slip_output, maxwell_slip_rates
from pamsim.hysteresis.pleated_factor import (
    PleatedFactor,
    pleated_factor_output,
    pleated_factor_rates,
)
from pamsim.hysteresis.prandtl_ishlinskii import (
    PrandtlIshlinskii,
    prandtl_ishlinskii_output,
    prandtl_ishlinskii_rates,
)
from pamsim.hysteresis.preisach import Preisach, preisach_output, preisach_rates

_LAW = slot("hysteresis.law")
_WIDTH = slot("hysteresis.0")
_OWN = _WIDTH + COMMON_FIELDS

_BOUC_WEN = HYSTERESIS_GROUPS.index(BoucWen)
_MAXWELL_SLIP = HYSTERESIS_GROUPS.index(MaxwellSlip)
_PRANDTL = HYSTERESIS_GROUPS.index(PrandtlIshlinskii)
_PREISACH = HYSTERESIS_GROUPS.index(Preisach)
_PLEATED = HYSTERESIS_GROUPS.index(PleatedFactor)
_ARCTANGENT = HYSTERESIS_GROUPS.index(Arctangent)
_FRACTIONAL = HYSTERESIS_GROUPS.index(FractionalMaxwell)


def loop_force(
    par: Row, act: Row, contraction: float, pressure: float, static_force: float
) -> float:
    """Force the operator takes from the muscle's static force [N]; 0 without an operator.

    Args:
        par: parameter row.
        act: the muscle's states.
        contraction: kappa [-].
        pressure: gauge pressure, not below 0 [Pa].
        static_force: signed force without hysteresis [N].
    """
    if par[_LAW] == 0.0:
        return 0.0
    width = par[_WIDTH] + par[_WIDTH + 1] * pressure + par[_WIDTH + 2] * static_force
    return width * loop_output(par, act, contraction)


def loop_output(par: Row, act: Row, contraction: float) -> float:
    """Output w of the operator, about in [-1, 1]; NaN for a code that no operator has.

    Args:
        par: parameter row.
        act: the muscle's states.
        contraction: kappa [-].
    """
    law = par[_LAW]
    if law == _BOUC_WEN:
        return bouc_wen_output(par, _OWN, act, contraction)
    if law == _MAXWELL_SLIP:
        return maxwell_slip_output(par, _OWN, act, contraction)
    if law == _PRANDTL:
        return prandtl_ishlinskii_output(par, _OWN, act, contraction)
    if law == _PREISACH:
        return preisach_output(par, _OWN, act, contraction)
    if law == _PLEATED:
        return pleated_factor_output(par, _OWN, act, contraction)
    if law == _ARCTANGENT:
        return arctangent_output(par, _OWN, act, contraction)
    if law == _FRACTIONAL:
        return fractional_maxwell_output(par, _OWN, act, contraction)
    return math.nan


def loop_rates(
    par: Row,
    act: Row,
    rates: MutableRow,
    contraction: float,
    contraction_rate: float,
    timestep: float,
) -> None:
    """Write the rates of the operator's memory [1/s]; nothing without an operator.

    Args:
        par: parameter row.
        act: the muscle's states.
        rates: written, as many as the operator has states.
        contraction: kappa [-].
        contraction_rate: [1/s].
        timestep: of the explicit Euler step that follows [s].
    """
    law = par[_LAW]
    x, v = contraction, contraction_rate
    if law == _BOUC_WEN:
        bouc_wen_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _MAXWELL_SLIP:
        maxwell_slip_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _PRANDTL:
        prandtl_ishlinskii_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _PREISACH:
        preisach_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _PLEATED:
        pleated_factor_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _ARCTANGENT:
        arctangent_rates(par, _OWN, act, rates, x, v, timestep)
    elif law == _FRACTIONAL:
        fractional_maxwell_rates(par, _OWN, act, rates, x, v, timestep)
