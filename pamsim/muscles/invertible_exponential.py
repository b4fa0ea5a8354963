"""The invertible exponential force law with all its terms (Sarosi, equations (4) and (5)).

F = (a p + b) exp(c kappa) + (e p + f) kappa + g p + h, in the letters of the paper.

The paper has an eighth constant, d, in exp(c kappa + d). It is fixed at 0 here: exp(d) only
multiplies a and b, so any d gives the same forces with other a and b, and a fit of all eight has no
unique answer. `InvertibleExponential.from_paper` folds a printed d into a and b. What remains is
the six-parameter law (`pamsim.muscles.exponential`) and one term more, f kappa: elasticity without
pressure that is linear in contraction. The six-parameter law is this one with f = 0.

The force is linear in pressure, which is what makes it invertible in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.muscles.exponential import (
    SixParameter,
    six_parameter_force,
    six_parameter_force_dkappa,
    six_parameter_force_dp,
    six_parameter_pressure,
)
from pamsim.muscles.single_pressure_exponential import folded_factor


@dataclass(frozen=True, kw_only=True)
class InvertibleExponential(ParameterGroup):
    """Coefficients in SI, in the letters of the paper without d."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "invertible_exponential"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    a: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="exponential, per pressure")
    b: float = parameter(unit="N", low=-1e4, high=1e4, doc="exponential, without pressure")
    c: float = parameter(unit="1", low=-200.0, high=0.0, doc="decay of the exponential")
    e: float = parameter(unit="N/Pa", low=-1.0, high=1.0, doc="loss with contraction, per pressure")
    f: float = parameter(unit="N", low=-1e5, high=1e5, doc="change with contraction, no pressure")
    g: float = parameter(unit="N/Pa", low=0.0, high=1.0, doc="force per pressure")
    h: float = parameter(unit="N", low=-1e4, high=1e4, doc="force without pressure")

    @classmethod
    def from_paper(
        cls,
        *,
        a: float,
        b: float,
        c: float,
        d: float,
        e: float,
        f: float,
        g: float,
        h: float,
    ) -> InvertibleExponential:
        """Take all eight constants of Sarosi (4) [SI] and fold d into a and b.

        Raises:
            ParameterError: if a folded constant is out of range.
        """
        return cls(a=folded_factor(a, d), b=folded_factor(b, d), c=c, e=e, f=f, g=g, h=h)

    @classmethod
    def from_six_parameter(cls, law: SixParameter) -> InvertibleExponential:
        """The same law as a six-parameter one: its d, e, f are e, g, h here, and f is 0."""
        return cls(scale=law.scale, a=law.a, b=law.b, c=law.c, e=law.d, f=0.0, g=law.e, h=law.f)


def invertible_exponential_force(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Force of the invertible law (Sarosi, equation (4) with d = 0).

    Args:
        pressure: gauge pressure p [Pa].
        contraction: kappa = 1 - l/l0 [-].
        a: [N/Pa].
        b: [N].
        c: [-], negative.
        e: [N/Pa].
        f: [N].
        g: [N/Pa].
        h: [N].

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    return six_parameter_force(pressure, contraction, a, b, c, e, g, h) + f * contraction


def invertible_exponential_force_dp(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Derivative dF/dp [N/Pa] of `invertible_exponential_force`, whose arguments it takes."""
    return six_parameter_force_dp(pressure, contraction, a, b, c, e, g, h)


def invertible_exponential_force_dkappa(
    pressure: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Derivative dF/dkappa [N] of `invertible_exponential_force`, whose arguments it takes."""
    return six_parameter_force_dkappa(pressure, contraction, a, b, c, e, g, h) + f


def invertible_exponential_pressure(
    force: float,
    contraction: float,
    a: float,
    b: float,
    c: float,
    e: float,
    f: float,
    g: float,
    h: float,
) -> float:
    """Pressure that gives a force (Sarosi, equation (5)).

    Args:
        force: F [N].
        contraction: kappa [-].
        a: [N/Pa].
        b: [N].
        c: [-].
        e: [N/Pa].
        f: [N].
        g: [N/Pa].
        h: [N].

    Returns:
        Gauge pressure p [Pa], negative if no filling gives so little force; NaN where the force
        does not depend on pressure.
    """
    return six_parameter_pressure(force - f * contraction, contraction, a, b, c, e, g, h)
