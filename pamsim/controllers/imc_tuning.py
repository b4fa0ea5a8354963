"""PID gains by internal model control: the loop answers as one lag of the wanted time constant.

For ``K exp(-L s) / (a2 s^2 + a1 s + 1)``: gain a1 / (K (lambda + L)), Ti = a1, Td = a2 / a1
(Rivera, Morari and Skogestad 1986, table 1, with the dead time as in Skogestad 2003).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.controllers.second_order_model import SecondOrderModel, is_all_pole
from pamsim.core.errors import InputError
from pamsim.identification.model import IdentifiedModel


@dataclass(frozen=True, kw_only=True)
class PidGains:
    """Gains of ``K (e + 1/Ti integral of e - Td rate)``.

    Attributes:
        gain: K [input unit per output unit].
        integral_time: Ti [s].
        derivative_time: Td [s].
    """

    gain: float
    integral_time: float
    derivative_time: float


def imc_gains(
    model: SecondOrderModel, *, closed_loop_time: float, dead_time: float = 0.0
) -> PidGains:
    """Gains for G2, or G1 as G2 with a2 near 0, behind a dead time L [s].

    The closed loop is to have the time constant lambda [s].

    Raises:
        InputError: for a time constant that is not above 0.
    """
    return PidGains(
        gain=model.a1 / (model.gain * _speed(closed_loop_time, dead_time)),
        integral_time=model.a1,
        derivative_time=model.a2 / model.a1,
    )


def imc_gains_of_fit(fit: IdentifiedModel, *, closed_loop_time: float) -> PidGains:
    """Gains for a fitted continuous model of one or two stable poles, its dead time included.

    The closed loop is to have the time constant lambda [s].

    Raises:
        InputError: for a model of another structure, or a time constant that is not above 0.
    """
    if is_all_pole(fit, order=1):
        lag = fit.denominator[0]
        return PidGains(
            gain=lag / (fit.gain * _speed(closed_loop_time, fit.dead_time)),
            integral_time=lag,
            derivative_time=0.0,
        )
    return imc_gains(
        SecondOrderModel.of_fit(fit), closed_loop_time=closed_loop_time, dead_time=fit.dead_time
    )


def _speed(closed_loop_time: float, dead_time: float) -> float:
    """Sum of the closed-loop time constant and the dead time [s]."""
    if not closed_loop_time > 0.0:
        raise InputError(f"closed-loop time constant {closed_loop_time!r} s must be above 0")
    return closed_loop_time + dead_time
