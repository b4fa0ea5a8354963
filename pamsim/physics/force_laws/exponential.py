"""Exponential force laws fitted to Festo fluidic muscles (Sarosi, equations (3) to (5)).

Sarosi (4) is F = (a p + b) exp(c kappa + d) + (e p + f) kappa + g p + h. Its d is fixed at 0 here:
exp(d) only multiplies a and b, so a fit of all eight constants has no unique answer. What is left
is the invertible law. The six-parameter law leaves out f kappa, the elasticity without pressure
that is linear in contraction, and calls e, g, h by d, e, f; `pamsim.physics.force_laws.published`
has constants. The p-terms are what the air does, the others what the rubber does. Both laws are
linear in pressure, which makes them invertible in closed form (5).

Sarosi (3), F = a exp(b kappa + c) + d kappa + e, is one isobar of a force map. Its exp(c) is folded
into a for the same reason. It does not know what pressure does: it has no inverse p(F, kappa).
"""

from __future__ import annotations

import math

from pamsim.core.parameters import quantity
from pamsim.physics.force_laws.force_law import FESTO_PRESSURES, ForceLaw, ForceParameters


class SixParameter(ForceParameters, law="six_parameter"):
    """Coefficients in SI; contraction as a fraction (the papers print it in percent)."""

    a: float = quantity("[-1, 1] N/Pa", "exponential, per pressure")
    b: float = quantity("[-1e4, 1e4] N", "exponential, without pressure")
    c: float = quantity("[-200, 0]", "decay of the exponential")
    d: float = quantity("[-1, 1] N/Pa", "loss with contraction, per pressure")
    e: float = quantity("[0, 1] N/Pa", "force per pressure")
    f: float = quantity("[-1e4, 1e4] N", "force without pressure")


def six_parameter_force(
    pressure: float, contraction: float, a: float, b: float, c: float, d: float, e: float, f: float
) -> float:
    """Force [N] of the six-parameter law (Sarosi, (4), its d and f zero), not limited to tension.

    The arguments are gauge pressure p [Pa], contraction kappa [-] and the fields of the group.
    """
    decay = math.exp(c * contraction)
    return (a * pressure + b) * decay + d * pressure * contraction + e * pressure + f


def six_parameter_volume(contraction: float, a: float, c: float, d: float, e: float) -> float:
    """Volume gained since nominal length, per nominal length [m^2]: the integral of dF/dp."""
    return a * _exponential_integral(contraction, c) + contraction * (0.5 * d * contraction + e)


def six_parameter_work(contraction: float, b: float, c: float, f: float) -> float:
    """Work of the part without pressure from nominal length on, per nominal length [N]."""
    return b * _exponential_integral(contraction, c) + f * contraction


def six_parameter_derivatives(
    pressure: float, contraction: float, a: float, b: float, c: float, d: float, e: float, f: float
) -> tuple[float, float, float, float, float]:
    """Force [N], its derivatives, volume [m^2] and work [N] in one exponential, see `ForceLaw`."""
    grown = math.expm1(c * contraction)
    swept = contraction if c == 0.0 else grown / c
    per_pressure = a * grown + a + d * contraction + e
    rising = c * (a * pressure + b) * (1.0 + grown) + d * pressure
    gained = a * swept + contraction * (0.5 * d * contraction + e)
    work = pressure * gained + b * swept + f * contraction
    return pressure * per_pressure + b * grown + b + f, rising, per_pressure, gained, work


def _exponential_integral(contraction: float, c: float) -> float:
    """Integral of exp(c kappa) from 0."""
    return contraction if c == 0.0 else math.expm1(c * contraction) / c


SIX_PARAMETER = ForceLaw(
    title="Six-parameter exponential",
    equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f",
    source="Sarosi, equation (4) with its d and f zero; inverse (5)",
    group=SixParameter,
    force_function=six_parameter_force,
    volume_function=six_parameter_volume,
    work_function=six_parameter_work,
    derivatives_function=six_parameter_derivatives,
    volume_varies=False,
    pressure_range=FESTO_PRESSURES,
    notes="A fit to Festo DMSP muscles; constants in published.py. exp(c kappa)"
    " grows steeply for a stretched muscle, kappa < 0, where nothing was measured.",
)


class InvertibleExponential(ForceParameters, law="invertible_exponential"):
    """Coefficients in SI, in the letters of the paper without d."""

    a: float = quantity("[-1, 1] N/Pa", "exponential, per pressure")
    b: float = quantity("[-1e4, 1e4] N", "exponential, without pressure")
    c: float = quantity("[-200, 0]", "decay of the exponential")
    e: float = quantity("[-1, 1] N/Pa", "loss with contraction, per pressure")
    f: float = quantity("[-1e5, 1e5] N", "change with contraction, no pressure")
    g: float = quantity("[0, 1] N/Pa", "force per pressure")
    h: float = quantity("[-1e4, 1e4] N", "force without pressure")


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
    """Force [N] of the invertible law (Sarosi, equation (4) with d = 0).

    The arguments are gauge pressure p [Pa], contraction kappa [-] and the fields of the group.
    """
    return six_parameter_force(pressure, contraction, a, b, c, e, g, h) + f * contraction


def invertible_exponential_volume(
    contraction: float, a: float, c: float, e: float, g: float
) -> float:
    """Volume gained since nominal length, per nominal length [m^2]: the six-parameter law's."""
    return six_parameter_volume(contraction, a, c, e, g)


def invertible_exponential_work(
    contraction: float, b: float, c: float, f: float, h: float
) -> float:
    """Work of the part without pressure from nominal length on, per nominal length [N]."""
    return six_parameter_work(contraction, b, c, h) + 0.5 * f * contraction * contraction


INVERTIBLE = ForceLaw(
    title="Invertible exponential",
    equation="F = (a p + b) exp(c kappa) + (e p + f) kappa + g p + h",
    source="Sarosi, equation (4) with its d folded into a and b; inverse (5)",
    group=InvertibleExponential,
    force_function=invertible_exponential_force,
    volume_function=invertible_exponential_volume,
    work_function=invertible_exponential_work,
    volume_varies=False,
    pressure_range=FESTO_PRESSURES,
    notes="The six-parameter law and one term more, f kappa. No constants are published.",
)


class SinglePressureExponential(ForceParameters, law="single_pressure_exponential"):
    """Coefficients of one isobar, in the letters of the paper without c."""

    a: float = quantity("[-1e4, 1e4] N", "factor of the exponential")
    b: float = quantity("[-200, 0]", "decay of the exponential")
    d: float = quantity("[-1e5, 1e5] N", "change with contraction")
    e: float = quantity("[-1e4, 1e4] N", "force without the exponential")


def single_pressure_force(
    pressure: float, contraction: float, a: float, b: float, d: float, e: float
) -> float:
    """Force [N] on one isobar (Sarosi, equation (3)).

    The arguments are gauge pressure [Pa], without influence, contraction kappa [-] and the fields
    of the group.
    """
    # 0 p is NaN for a lost pressure, which must not go unnoticed.
    return a * math.exp(b * contraction) + d * contraction + e + 0.0 * pressure


def single_pressure_volume(contraction: float) -> float:
    """No volume gained [m^2]: air that does not change the force does no work. NaN for NaN."""
    return 0.0 * contraction


def single_pressure_work(contraction: float, a: float, b: float, d: float, e: float) -> float:
    """Work from nominal length on, per nominal length [N]."""
    return invertible_exponential_work(contraction, a, b, d, e)


SINGLE_PRESSURE = ForceLaw(
    title="Exponential at one pressure",
    equation="F = a exp(b kappa) + d kappa + e",
    source="Sarosi, equation (3) with its c folded into a",
    group=SinglePressureExponential,
    force_function=single_pressure_force,
    volume_function=single_pressure_volume,
    work_function=single_pressure_work,
    volume_varies=False,
    pressure_range=None,
    notes="One isobar: the force does not change with pressure, so the law fits a force map at"
    " one pressure and must not drive a muscle whose pressure changes.",
)
