"""The second-order model G2 about an operating point, as controllers are designed on it."""

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
