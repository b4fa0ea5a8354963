"""Pleated muscles: the exact shape for many fibres, and the force function fitted to it.

The force is F = p l0^2 f_t0(eps) (Van Damme 2008, equation (1)), eps = 1 - l/l0. The fitted
f_t0 = f0 / eps + f1 + f2 eps + f3 eps^2 + f4 eps^3 (2) is good above 5 % contraction. Van Damme
2008 prints no coefficients; `SLENDERNESS_6` has those fitted to the exact shape.

The exact f_t0 (N -> inf) is not printed; it follows from three assumptions. The membrane carries no
tension round its circumference (the pleats unfold freely), the fibres along its meridian do not
stretch, and friction is absent, so that the total fibre tension T is the same everywhere. End discs
have radius R, the meridian has length l0, phi is its angle to the axis, r its radius, s its arc
length. Cut at radius r: the fibres hold the load F and the pressure on the cut,
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
The pull ends at m = 1/2: there eps is the largest contraction, 40.3 % for l0/R = 6 and 54.3 % for
an infinitely slender muscle. The meridian turned round the axis encloses
    V = pi l0^3 m (F + (1 - 2 m) B + 2 sin(a) cos(a) D(a)) / (3 F^3),  B = (F - E) / m,         (v)
from the cylinder pi R^2 l0 at eps = 0. Its derivative is the force, dV/deps = l0 F / p. In the code
F and B stand for themselves and E for F - m B, so that no digits are lost as m -> 0.

The membrane cannot be longer than l0: both laws are NaN for eps <= 0, so that a run stops. Near 0
the exact f_t0 goes as pi R / (l0 sqrt(6 eps)); between 0 and 5 % the elasticity of the fibres,
which both neglect, limits the real force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pamsim.core.parameters import quantity
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.force_law import ForceLaw, ForceParameters, Range

FIT_RANGE: Range = (0.05, 0.35)
"""Contractions of the fit: from where the law holds to the largest one Van Damme 2008 measures."""

_PRESSURES: Range = (1e5, 2.5e5)


class Pleated(ForceParameters, law="pleated"):
    """Coefficients of the dimensionless force function."""

    f0: float = quantity("[-10, 10]", "coefficient of 1/eps")
    f1: float = quantity("[-100, 100]", "constant")
    f2: float = quantity("[-1e3, 1e3]", "coefficient of eps")
    f3: float = quantity("[-1e4, 1e4]", "coefficient of eps^2")
    f4: float = quantity("[-1e4, 1e4]", "coefficient of eps^3")


SLENDERNESS_6 = Pleated(
    f0=0.02300273978, f1=1.031348789, f2=-4.596929223, f3=6.726459461, f4=-5.078786628
)
"""Slenderness l0/R = 6, as in Van Damme 2008: fitted to the exact shape, not measured."""


def pleated_function(
    contraction: float, f0: float, f1: float, f2: float, f3: float, f4: float
) -> float:
    """Dimensionless force function f_t0 [-] of eps (Van Damme 2008, (2)); NaN for eps <= 0."""
    if not contraction > 0.0:
        return math.nan
    return f0 / contraction + f1 + contraction * (f2 + contraction * (f3 + contraction * f4))


def pleated_force(
    pressure: float,
    contraction: float,
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    f4: float,
    nominal_length: float,
) -> float:
    """Force of a pleated muscle [N] (Van Damme 2008, equations (1) and (2)); NaN for eps <= 0.

    The arguments are gauge pressure p [Pa], contraction eps [-], the fields of the group, and the
    length l0 of the membrane [m].
    """
    area = nominal_length * nominal_length
    return pressure * area * pleated_function(contraction, f0, f1, f2, f3, f4)


def pleated_volume(
    contraction: float, f0: float, f1: float, f2: float, f3: float, f4: float, nominal_length: float
) -> float:
    """Volume gained since nominal length, per nominal length [m^2]; NaN for eps <= 0.

    The fitted force has no integral from nominal length, where the exact one goes as 1 / sqrt(eps).
    Up to the lower end of the fit it is continued as such: the volume gained there is 2 eps f_t0.
    """
    if not contraction > 0.0:
        return math.nan
    low = FIT_RANGE[0]
    gained = 2.0 * low * pleated_function(low, f0, f1, f2, f3, f4)
    gained += f0 * math.log(contraction / low) + f1 * (contraction - low)
    gained += f2 / 2.0 * (contraction**2 - low**2) + f3 / 3.0 * (contraction**3 - low**3)
    gained += f4 / 4.0 * (contraction**4 - low**4)
    return nominal_length * nominal_length * gained


FITTED = ForceLaw(
    title="Pleated muscle, fitted force function",
    equation="F = p l0^2 (f0 / eps + f1 + f2 eps + f3 eps^2 + f4 eps^3)",
    source="Van Damme 2008, equations (1) and (2)",
    group=Pleated,
    force_function=pleated_force,
    volume_function=pleated_volume,
    volume_varies=False,
    braid_fields=("nominal_length",),
    pressure_range=_PRESSURES,
    limits=FIT_RANGE,
    notes="NaN at and below zero contraction, too large below 5 %. Coefficients for l0/R = 6 in"
    " pleated.py. Leave braid.extensibility 0. The braid's diameter is that of the"
    " end discs: its cylinder is the volume at nominal length.",
)


class PleatedShape(ForceParameters, law="pleated_shape"):
    """The one design number that sets the shape."""

    slenderness: float = quantity(
        "[0.1, 1e3]", "l0/R, length of the membrane over radius of its ends"
    )


def carlson_integrals(x: float, y: float, z: float) -> tuple[float, float]:
    """Carlson's elliptic integrals R_F and R_D [-] (DLMF 19.16.1, 19.16.5), x, y >= 0, z > 0.

    scipy's cannot be compiled with the law. Each step of the duplication theorem (Carlson 1995;
    DLMF 19.26.18) brings the arguments four times closer together, so that some ten do; a series
    in what is left of their spread ends it (DLMF 19.36.1, 19.36.2).
    """
    total, weight = 0.0, 1.0
    for _ in range(40):
        mean = (x + y + 3.0 * z) / 5.0
        if abs(x - mean) + abs(y - mean) + abs(z - mean) < 6e-3 * mean:
            break
        mixed = math.sqrt(x) * math.sqrt(y) + math.sqrt(z) * (math.sqrt(x) + math.sqrt(y))
        total += 3.0 * weight / (math.sqrt(z) * (z + mixed))
        weight *= 0.25
        x, y, z = 0.25 * (x + mixed), 0.25 * (y + mixed), 0.25 * (z + mixed)
    mean = (x + y + z) / 3.0
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -dx - dy
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0
    first = series / math.sqrt(mean)
    mean = (x + y + 3.0 * z) / 5.0
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -(dx + dy) / 3.0
    e2, e3 = dx * dy - 6.0 * dz * dz, (3.0 * dx * dy - 8.0 * dz * dz) * dz
    e4, e5 = 3.0 * (dx * dy - dz * dz) * dz * dz, dx * dy * dz * dz * dz
    series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
    series += -3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0 + 3.0 * e5 / 26.0
    return first, total + weight * series / (mean * math.sqrt(mean))


def elliptic_integrals(amplitude: float, parameter: float) -> tuple[float, float]:
    """F(a|m) and B = (F - E) / m, the integral of sin^2 t / sqrt(1 - m sin^2 t) [-].

    Amplitude a in [0, pi/2] [rad], parameter m in [0, 1) (DLMF 19.25.5, 19.25.9); E is F - m B.
    """
    sine, cosine = math.sin(amplitude), math.cos(amplitude)
    first, second = carlson_integrals(cosine * cosine, 1.0 - parameter * sine * sine, 1.0)
    return sine * first, sine * sine * sine * second / 3.0


def end_amplitude(parameter: float, slenderness: float) -> float:
    """Amplitude a in (0, pi/2) [rad] at the end disc, the solution of (ii), for m in (0, 1).

    F(a|m) - (l0/R) sqrt(m) cos(a) grows with a and is convex, and the start lies above its zero
    because sin(a) <= F(a|m): Newton's iteration comes down to the zero without overshoot.
    """
    reach = slenderness * math.sqrt(parameter)
    amplitude = math.atan(reach)
    for _ in range(60):
        sine, cosine = math.sin(amplitude), math.cos(amplitude)
        miss = elliptic_integrals(amplitude, parameter)[0] - reach * cosine
        step = miss / (1.0 / math.sqrt(1.0 - parameter * sine * sine) + reach * sine)
        amplitude -= step
        # Quadratic convergence: after such a step what is left is below rounding.
        if abs(step) < 1e-9 * amplitude:
            break
    return amplitude


def _shape(parameter: float, slenderness: float) -> tuple[float, float, float, float]:
    """Contraction of the shape m, its derivative by m along (ii), F(a|m), and V / (pi l0^3)."""
    if math.isnan(parameter):
        return math.nan, math.nan, math.nan, math.nan
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
    enclosed = first + (1.0 - 2.0 * parameter) * part + 2.0 * sine * cosine * root
    return contraction, contraction_dm, first, parameter * enclosed / (3.0 * first**3)


def shape_parameter(contraction: float, slenderness: float) -> float:
    """Shape parameter m in (0, 1) [-] of a contraction eps and l0/R: from (ii) and (iii).

    Above 1/2 the muscle pushes. NaN for eps <= 0, and where no shape has that contraction.
    """
    if not (contraction > 0.0 and slenderness > 0.0):
        return math.nan
    low, high = 0.0, 1.0
    # Between the limits of a short muscle, sqrt(3 eps / 2) R / l0, and a slender one, eps.
    parameter = min(contraction / math.sqrt(1.0 + slenderness * slenderness * contraction), 0.5)
    for _ in range(100):
        reached, slope, _, _ = _shape(parameter, slenderness)
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
    """Dimensionless force function f_t0 [-] of the exact shape (iv); NaN as `shape_parameter`."""
    parameter = shape_parameter(contraction, slenderness)
    first = _shape(parameter, slenderness)[2]
    return 0.5 * math.pi * (1.0 - 2.0 * parameter) / (first * first)


def pleated_max_contraction(slenderness: float) -> float:
    """Contraction eps_max [-] at which the pull of a slenderness l0/R ends: that of m = 1/2."""
    return _shape(0.5, slenderness)[0]


def pleated_shape_force(
    pressure: float, contraction: float, slenderness: float, nominal_length: float
) -> float:
    """Force [N] of a pleated muscle with many fibres (Van Damme 2008, (1)); NaN for eps <= 0.

    The arguments are gauge pressure p [Pa], contraction eps [-], l0/R and l0 of the membrane [m].
    """
    area = nominal_length * nominal_length
    return pressure * area * pleated_shape_function(contraction, slenderness)


def pleated_shape_volume(contraction: float, slenderness: float, nominal_length: float) -> float:
    """Volume gained since the cylinder of nominal length, per nominal length [m^2], by (v)."""
    enclosed = _shape(shape_parameter(contraction, slenderness), slenderness)[3]
    gained = enclosed - 1.0 / (slenderness * slenderness)
    return math.pi * nominal_length * nominal_length * gained


def _to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """From where the fibres no longer stretch to where the pull ends."""
    return FIT_RANGE[0], pleated_max_contraction(coefficients[1])


EXACT = ForceLaw(
    title="Pleated muscle, exact shape for many fibres",
    equation="F = p l0^2 pi (1 - 2 m) / (2 F(a|m)^2), l0/R = F(a|m) / (sqrt(m) cos(a)),"
    " eps = 2 (1 - E(a|m) / F(a|m))",
    source="Van Damme 2008, equation (1), derived from zero hoop stress",
    group=PleatedShape,
    force_function=pleated_shape_force,
    volume_function=pleated_shape_volume,
    volume_varies=False,
    braid_fields=("nominal_length",),
    pressure_range=_PRESSURES,
    limits=_to_largest,
    notes="The limit of many fibres: Van Damme 2008 measures less with 25 fibres than with 40."
    " NaN at and below zero contraction; leave braid.extensibility 0. Its cylinder at nominal"
    " length is the braid's: give it the diameter 2 R of the end discs.",
)
