"""Exact shape and force of a pleated muscle with many fibres (Van Damme 2008, (1), N -> inf).

Van Damme 2008 names a system of equations with elliptic integrals and does not print it; it follows
from three assumptions. The membrane carries no tension round its circumference (the pleats unfold
freely), the fibres along its meridian do not stretch, and friction is absent, so that the total
fibre tension T is the same everywhere on the meridian. End discs have radius R, the meridian has
length l0, phi is its angle to the axis, r its radius, s its arc length.

Cut at radius r: the fibres hold the load F and the pressure on the cut,
    T cos(phi) = F + pi p r^2.                                                                  (i)
At the equator phi = 0 and r = r_m, so T = F + pi p r_m^2, and subtracting (i) gives
    sin^2(phi / 2) = pi p (r_m^2 - r^2) / (2 T).
With r = r_m cos(t) and m = pi p r_m^2 / (2 T) this is sin(phi / 2) = sqrt(m) sin(t). From it and
dr = -sin(phi) ds, counting from the equator, with D(t) = sqrt(1 - m sin^2 t),
    ds = r_m / (2 sqrt(m)) dt / D,    dz = cos(phi) ds = (2 D^2 - 1) ds.
At the end disc t = a with cos(a) = R / r_m. Half a meridian is l0 / 2, so with the elliptic
integrals of the first and second kind, F(a|m) and E(a|m),
    l0 / R = F(a|m) / (sqrt(m) cos(a)),                                                        (ii)
    l / l0 = 2 E / F - 1,  hence  eps = 2 (F - E) / F,                                        (iii)
and (i) at the equator is the force, F = T - pi p r_m^2 = p l0^2 f_t0, with
    f_t0 = pi (1 - 2 m) / (2 F(a|m)^2).                                                        (iv)
For a slenderness l0/R, (ii) gives a for every m and (iii) then grows with m, from eps = 0 at m = 0.
The pull ends at m = 1/2: there eps is the largest contraction, 40.3 % for l0/R = 6 and
2 (1 - E(1/2) / K(1/2)) = 54.3 % for an infinitely slender muscle. Beyond it the muscle pushes.

The meridian turned round the axis encloses V = 2 pi times the integral of r^2 dz from 0 to a:
    V = pi l0^3 m (F + (1 - 2 m) B + 2 sin(a) cos(a) D(a)) / (3 F^3),  B = (F - E) / m,         (v)
from the cylinder pi R^2 l0 at eps = 0. Its derivative is the force, dV/deps = l0 F / p.

As eps -> 0, f_t0 -> pi R / (l0 sqrt(6 eps)): the exact force diverges more slowly than the f0/eps
of the paper's approximation (2).

In the code F and B = (F - E) / m stand for themselves (`pamsim.physics.force_laws.elliptic`) and E
for F - m B, so that no digits are lost as m -> 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.force_laws.elliptic import elliptic_integrals, first_elliptic_integral


@dataclass(frozen=True, kw_only=True)
class PleatedShape(ParameterGroup):
    """The one design number that sets the shape."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "pleated_shape"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    slenderness: float = parameter(
        unit="1", low=0.1, high=1e3, doc="l0/R, length of the membrane over radius of its ends"
    )


def end_amplitude(parameter: float, slenderness: float) -> float:
    """Amplitude a at the end disc: the solution of (ii).

    F(a|m) - (l0/R) sqrt(m) cos(a) grows with a and is convex, and the start lies above its zero
    because sin(a) <= F(a|m): Newton's iteration comes down to the zero without overshoot.

    Args:
        parameter: m in (0, 1).
        slenderness: l0/R.

    Returns:
        a in (0, pi/2) [rad].
    """
    reach = slenderness * math.sqrt(parameter)
    amplitude = math.atan(reach)
    for _ in range(60):
        sine, cosine = math.sin(amplitude), math.cos(amplitude)
        miss = first_elliptic_integral(amplitude, parameter) - reach * cosine
        step = miss / (1.0 / math.sqrt(1.0 - parameter * sine * sine) + reach * sine)
        amplitude -= step
        # Quadratic convergence: after such a step what is left is below rounding.
        if abs(step) < 1e-9 * amplitude:
            break
    return amplitude


def _shape(parameter: float, slenderness: float) -> tuple[float, float, float]:
    """Contraction and F(a|m) of the shape m, and the contraction's derivative by m along (ii)."""
    amplitude = end_amplitude(parameter, slenderness)
    first, part = elliptic_integrals(amplitude, parameter)
    sine, cosine = math.sin(amplitude), math.cos(amplitude)
    root = math.sqrt(1.0 - parameter * sine * sine)
    reach = slenderness * math.sqrt(parameter)
    # dF/dm and d(m B)/dm at fixed amplitude, from d(E)/dm = -B/2.
    first_dm = 0.5 * (first - part - sine * cosine / root) / (1.0 - parameter)
    lost_dm = first_dm + 0.5 * part
    amplitude_dm = -(first_dm - 0.5 * reach * cosine / parameter) / (1.0 / root + reach * sine)
    first_dm += amplitude_dm / root
    lost_dm += amplitude_dm * parameter * sine * sine / root
    contraction = 2.0 * parameter * part / first
    contraction_dm = (2.0 * lost_dm - contraction * first_dm) / first
    return contraction, first, contraction_dm


def shape_parameter(contraction: float, slenderness: float) -> float:
    """Shape parameter m of a contraction: the solution of (ii) and (iii).

    Args:
        contraction: eps = 1 - l/l0 [-].
        slenderness: l0/R [-].

    Returns:
        m in (0, 1), above 1/2 where the muscle pushes; NaN at and below zero contraction, and
        where no shape has that contraction.
    """
    if not (contraction > 0.0 and slenderness > 0.0):
        return math.nan
    low, high = 0.0, 1.0
    # Between the limits of a short muscle, sqrt(3 eps / 2) R / l0, and a slender one, eps.
    parameter = contraction / math.sqrt(1.0 + slenderness * slenderness * contraction)
    if parameter > 0.5:
        parameter = 0.5
    for _ in range(100):
        reached, _, slope = _shape(parameter, slenderness)
        miss = reached - contraction
        if miss > 0.0:
            high = parameter
        else:
            low = parameter
        following = parameter - miss / slope
        if not low <= following < high:
            following = 0.5 * (low + high)
        # The largest contraction of all, as m -> 1, may lie below the one asked for: then the
        # bracket closes at 1 and the miss remains.
        if abs(following - parameter) < 1e-9 * parameter:
            return following if abs(miss) < 1e-8 else math.nan
        parameter = following
    return math.nan


def pleated_shape_function(contraction: float, slenderness: float) -> float:
    """Dimensionless force function f_t0 of the exact shape, equation (iv).

    Args:
        contraction: eps = 1 - l/l0 [-].
        slenderness: l0/R [-].

    Returns:
        f_t0 = F / (p l0^2) [-], negative beyond the largest contraction; NaN as `shape_parameter`.
    """
    parameter = shape_parameter(contraction, slenderness)
    if math.isnan(parameter):
        return math.nan
    _, first, _ = _shape(parameter, slenderness)
    return 0.5 * math.pi * (1.0 - 2.0 * parameter) / (first * first)


def pleated_max_contraction(slenderness: float) -> float:
    """Contraction at which the pull ends: the shape with m = 1/2.

    Args:
        slenderness: l0/R [-].

    Returns:
        eps_max [-].
    """
    return _shape(0.5, slenderness)[0]


def pleated_shape_force(
    pressure: float, contraction: float, slenderness: float, nominal_length: float
) -> float:
    """Force of a pleated muscle with many fibres (Van Damme 2008, equation (1)).

    Args:
        pressure: gauge pressure p [Pa].
        contraction: eps = 1 - l/l0 [-].
        slenderness: l0/R [-].
        nominal_length: length l0 of the membrane [m].

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension. NaN for eps <= 0.
    """
    area = nominal_length * nominal_length
    return pressure * area * pleated_shape_function(contraction, slenderness)


def pleated_shape_volume(
    pressure: float, contraction: float, slenderness: float, nominal_length: float
) -> float:
    """Volume that belongs to `pleated_shape_force`, whose arguments it takes: equation (v).

    Returns:
        Volume gained since nominal length, where the membrane is a cylinder, per nominal length
        [m^2]. The pressure has no influence. NaN for eps <= 0.
    """
    parameter = shape_parameter(contraction, slenderness)
    if math.isnan(parameter):
        return math.nan
    amplitude = end_amplitude(parameter, slenderness)
    first, part = elliptic_integrals(amplitude, parameter)
    sine, cosine = math.sin(amplitude), math.cos(amplitude)
    end = sine * cosine * math.sqrt(1.0 - parameter * sine * sine)
    inside = parameter * (first + (1.0 - 2.0 * parameter) * part + 2.0 * end) / (3.0 * first**3)
    gained = inside - 1.0 / (slenderness * slenderness)
    return math.pi * nominal_length * nominal_length * gained
