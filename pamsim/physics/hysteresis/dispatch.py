"""The hysteresis operator that a muscle's row names, for the compiled kernel.

Written out, not looked up in a table: the compiled kernel can call a function only by name.
"""

from __future__ import annotations

import math

from pamsim.core.catalog import USER_DEFINED
from pamsim.physics.hysteresis.arctangent import (
    Arctangent,
    arctangent_energy,
    arctangent_output,
    arctangent_rates,
)
from pamsim.physics.hysteresis.bouc_wen import (
    BoucWen,
    bouc_wen_energy,
    bouc_wen_output,
    bouc_wen_rates,
)
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.fractional_maxwell import (
    FractionalMaxwell,
    fractional_maxwell_energy,
    fractional_maxwell_output,
    fractional_maxwell_rates,
)
from pamsim.physics.hysteresis.group import MutableRow, Row
from pamsim.physics.hysteresis.maxwell_slip import (
    MaxwellSlip,
    maxwell_slip_energy,
    maxwell_slip_output,
    maxwell_slip_rates,
)
from pamsim.physics.hysteresis.pleated_factor import (
    PleatedFactor,
    pleated_factor_energy,
    pleated_factor_output,
    pleated_factor_rates,
)
from pamsim.physics.hysteresis.prandtl_ishlinskii import (
    PrandtlIshlinskii,
    prandtl_ishlinskii_energy,
    prandtl_ishlinskii_output,
    prandtl_ishlinskii_rates,
)
from pamsim.physics.hysteresis.preisach import (
    Preisach,
    preisach_energy,
    preisach_output,
    preisach_rates,
)

_BOUC_WEN = OPERATORS.code(BoucWen)
_MAXWELL_SLIP = OPERATORS.code(MaxwellSlip)
_PRANDTL = OPERATORS.code(PrandtlIshlinskii)
_PREISACH = OPERATORS.code(Preisach)
_PLEATED = OPERATORS.code(PleatedFactor)
_ARCTANGENT = OPERATORS.code(Arctangent)
_FRACTIONAL = OPERATORS.code(FractionalMaxwell)


def chosen_output(law: float, par: Row, first: int, act: Row, x: float) -> float:
    """Output w of the operator with a code, about in [-1, 1]; NaN for a code that no operator has.

    Args:
        law: code of the operator, see `pamsim.core.catalog.Catalog.code`; 0 for none.
        par: parameter row of a muscle.
        first: index in the row of the operator's own parameters.
        act: the muscle's states.
        x: contraction kappa [-].
    """
    if law == _BOUC_WEN:
        return bouc_wen_output(par, first, act, x)
    if law == _MAXWELL_SLIP:
        return maxwell_slip_output(par, first, act, x)
    if law == _PRANDTL:
        return prandtl_ishlinskii_output(par, first, act, x)
    if law == _PREISACH:
        return preisach_output(par, first, act, x)
    if law == _PLEATED:
        return pleated_factor_output(par, first, act, x)
    if law == _ARCTANGENT:
        return arctangent_output(par, first, act, x)
    if law == _FRACTIONAL:
        return fractional_maxwell_output(par, first, act, x)
    if law >= USER_DEFINED:
        return user_output(law, par, first, act, x)
    return math.nan


def chosen_energy(law: float, par: Row, first: int, act: Row, x: float) -> float:
    """Energy that the operator with a code holds [contraction]; NaN for a code that no one has.

    The arguments are those of `chosen_output`.
    """
    if law == _BOUC_WEN:
        return bouc_wen_energy(par, first, act, x)
    if law == _MAXWELL_SLIP:
        return maxwell_slip_energy(par, first, act, x)
    if law == _PRANDTL:
        return prandtl_ishlinskii_energy(par, first, act, x)
    if law == _PREISACH:
        return preisach_energy(par, first, act, x)
    if law == _PLEATED:
        return pleated_factor_energy(par, first, act, x)
    if law == _ARCTANGENT:
        return arctangent_energy(par, first, act, x)
    if law == _FRACTIONAL:
        return fractional_maxwell_energy(par, first, act, x)
    if law >= USER_DEFINED:
        return user_energy(law, par, first, act, x)
    return math.nan


def chosen_rates(
    law: float,
    par: Row,
    first: int,
    act: Row,
    rates: MutableRow,
    x: float,
    x_rate: float,
    timestep: float,
) -> None:
    """Write the rates of the memory of the operator with a code [1/s]; nothing for code 0.

    Args:
        law: see `chosen_output`.
        par: parameter row of a muscle.
        first: index in the row of the operator's own parameters.
        act: the muscle's states.
        rates: written, as many as the operator has states.
        x: contraction kappa [-].
        x_rate: [1/s].
        timestep: of the explicit Euler step that follows [s].
    """
    if law == _BOUC_WEN:
        bouc_wen_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _MAXWELL_SLIP:
        maxwell_slip_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _PRANDTL:
        prandtl_ishlinskii_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _PREISACH:
        preisach_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _PLEATED:
        pleated_factor_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _ARCTANGENT:
        arctangent_rates(par, first, act, rates, x, x_rate, timestep)
    elif law == _FRACTIONAL:
        fractional_maxwell_rates(par, first, act, rates, x, x_rate, timestep)
    elif law >= USER_DEFINED:
        user_rates(law, par, first, act, rates, x, x_rate, timestep)


def user_output(law: float, par: Row, first: int, act: Row, x: float) -> float:
    """`chosen_output` of an operator from outside the package [-]; NaN if it is not loaded.

    The compiled kernel finds the same function by `pamsim.engine.user_laws`.
    """
    card = OPERATORS.with_code(law)
    return math.nan if card is None else card.output(par, first, act, x)


def user_energy(law: float, par: Row, first: int, act: Row, x: float) -> float:
    """`chosen_energy` of an operator from outside [contraction]; NaN if it is not loaded."""
    card = OPERATORS.with_code(law)
    return math.nan if card is None else card.energy(par, first, act, x)


def user_rates(
    law: float,
    par: Row,
    first: int,
    act: Row,
    rates: MutableRow,
    x: float,
    x_rate: float,
    timestep: float,
) -> None:
    """`chosen_rates` of an operator from outside [1/s]; writes nothing if it is not loaded."""
    card = OPERATORS.with_code(law)
    if card is not None:
        card.rates(par, first, act, rates, x, x_rate, timestep)
