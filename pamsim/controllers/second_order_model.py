"""The second-order model G2 about an operating point, and PID gains by internal model control.

By these gains the loop answers as one lag of the wanted time constant lambda. For
``K exp(-L s) / (a2 s^2 + a1 s + 1)``: gain a1 / (K (lambda + L)), Ti = a1, Td = a2 / a1
(Rivera, Morari and Skogestad 1986, table 1, with the dead time as in Skogestad 2003).
"""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.core.errors import InputError
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.model import IdentifiedModel


def is_all_pole(fit: IdentifiedModel, *, order: int) -> bool:
    """Whether a fit is continuous and has stable poles alone: no zero, no integrator."""
    form = fit.structure
    return isinstance(form, ContinuousStructure) and (
        (form.order, form.zeros, form.integrators) == (order, 0, 0)
    )


@dataclass(frozen=True, kw_only=True)
class SecondOrderModel:
    """``G2(s) = K / (a2 s^2 + a1 s + 1)``: two real lags, or an oscillation with damping.

    Attributes:
        gain: K > 0 [output unit per input unit].
        a1: T1 + T2, or 2 zeta/wn [s].
        a2: T1 T2, or 1/wn^2 [s^2].

    Raises:
        InputError: if a number is not above 0: the model is unstable, or its gain negative.
    """

    gain: float
    a1: float
    a2: float

    def __post_init__(self) -> None:
        if not (self.gain > 0.0 and self.a1 > 0.0 and self.a2 > 0.0):
            raise InputError(
                f"G2 with K = {self.gain:g}, a1 = {self.a1:g} s, a2 = {self.a2:g} s^2: all three"
                " must be above 0; fit p1 - p2 to the angle, which is stable and rising"
            )

    @classmethod
    def of_fit(cls, fit: IdentifiedModel) -> SecondOrderModel:
        """The model of a fit of two poles; its dead time must be covered by the margins.

        Raises:
            InputError: if the fit has another order, a zero or an integrator, or is discrete.
        """
        if not is_all_pole(fit, order=2):
            raise InputError(
                f"the fit is {fit.structure.sentence}; G2 is continuous and has two poles, no zero"
                " and no integrator: fit with order=2"
            )
        return cls(gain=fit.gain, a1=fit.denominator[1], a2=fit.denominator[0])

    def input_for(self, output: float, rate: float, acceleration: float) -> float:
        """Input under which the output moves so; all from the operating point [input unit]."""
        return (output + self.a1 * rate + self.a2 * acceleration) / self.gain

    def matrices(self) -> tuple[list[list[float]], list[list[float]]]:
        """A and B of the states (output, its rate), continuous."""
        return (
            [[0.0, 1.0], [-1.0 / self.a2, -self.a1 / self.a2]],
            [[0.0], [self.gain / self.a2]],
        )


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
