"""The McKibben force with its two empirical corrections (Sarosi, equation (2)).

F = mu p pi r0^2 (a (1 - eps kappa)^2 - b), a = 3 / tan^2(alpha0), b = 1 / sin^2(alpha0),
eps = a_eps exp(-p/bar) - b_eps, mu = a_kappa exp(-k0 kappa) - b_kappa.

eps makes the largest contraction depend on pressure, mu lowers the force near nominal length. The
paper puts p in bar into exp(-p): here p is in Pa throughout and divided by one bar inside eps, so
a_eps and b_eps keep the values a fit in bar gives. Both corrections are printed with a minus before
their second constant; the ideal law is a_eps = a_kappa = 0, b_eps = b_kappa = -1.

Where a_eps kappa >= 0, 1 - eps kappa never falls with pressure: from the threshold on, the pressure
at which it reaches sqrt(b/a), the pull grows with pressure, and each pull has one pressure.

Below the threshold the printed formula is not to be trusted: where eps kappa > 1 + sqrt(b/a) the
square turns a negative 1 - eps kappa into a pull that no muscle has. Constants fitted to force maps
(a_eps near 15) reach that point below about 1 bar at 20 % contraction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.core.units import PA_PER_BAR

VALID_FROM = 2e5
"""Gauge pressure from which the source claims validity [Pa]."""


@dataclass(frozen=True, kw_only=True)
class CorrectedMcKibben(ParameterGroup):
    """The four fitted constants and the decay that the paper fixes at 40."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "corrected_mckibben"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    a_eps: float = parameter(
        unit="1", low=-100.0, high=100.0, doc="part of eps that dies with pressure"
    )
    b_eps: float = parameter(
        unit="1", low=-10.0, high=10.0, doc="minus eps at high pressure; -1 is ideal"
    )
    a_kappa: float = parameter(
        unit="1", low=-100.0, high=100.0, doc="part of mu that dies with contraction"
    )
    b_kappa: float = parameter(
        unit="1", low=-10.0, high=10.0, doc="minus mu at large contraction; -1 is ideal"
    )
    k0: float = parameter(
        unit="1", low=0.0, high=200.0, doc="decay of mu with contraction", default=40.0
    )


def corrected_mckibben_force(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Force of the corrected McKibben law (Sarosi, equation (2)).

    The arguments are gauge pressure p [Pa], contraction kappa = 1 - l/l0 [-], the fields of
    `CorrectedMcKibben` after its scale, and diameter D0 = 2 r0 [m] and fibre angle alpha0 [rad] of
    `Braid`.

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension.
    """
    mu = a_kappa * math.exp(-k0 * contraction) - b_kappa
    eps = a_eps * math.exp(-pressure / PA_PER_BAR) - b_eps
    braid = _braid_bracket(1.0 - eps * contraction, fibre_angle)
    return 0.25 * math.pi * diameter * diameter * mu * pressure * braid


def corrected_mckibben_volume(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Volume that belongs to `corrected_mckibben_force`, whose arguments it takes.

    With J = integral from 0 to kappa of mu (a (1 - eps kappa)^2 - b), the volume gained is
    pi r0^2 d(p J)/dp = pi r0^2 (J + p eps' dJ/deps). It depends on pressure because eps does.

    Returns:
        Volume gained since nominal length, per nominal length [m^2]. Below 2 bar it is that at
        2 bar: the printed formula would make it negative there.
    """
    if pressure < VALID_FROM:
        pressure = VALID_FROM
    fading = a_eps * math.exp(-pressure / PA_PER_BAR)
    inside, by_eps = _swept(contraction, fading - b_eps, a_kappa, b_kappa, k0, fibre_angle)
    inside -= pressure / PA_PER_BAR * fading * by_eps
    return 0.25 * math.pi * diameter * diameter * inside


def corrected_mckibben_work(
    pressure: float,
    contraction: float,
    a_eps: float,
    b_eps: float,
    a_kappa: float,
    b_kappa: float,
    k0: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Work p pi r0^2 J at one pressure from nominal length on, per nominal length [N].

    The arguments are those of `corrected_mckibben_force`, J that of `corrected_mckibben_volume`.
    """
    eps = a_eps * math.exp(-pressure / PA_PER_BAR) - b_eps
    inside, _ = _swept(contraction, eps, a_kappa, b_kappa, k0, fibre_angle)
    return 0.25 * math.pi * diameter * diameter * pressure * inside


def _swept(
    contraction: float, eps: float, a_kappa: float, b_kappa: float, k0: float, fibre_angle: float
) -> tuple[float, float]:
    """J and dJ/deps."""
    sine = math.sin(fibre_angle)
    b = 1.0 / (sine * sine)
    a = 3.0 * (b - 1.0)
    # The integrals of mu, mu kappa and mu kappa^2.
    zeroth = a_kappa * _decaying_moment(0, contraction, k0) - b_kappa * contraction
    first = a_kappa * _decaying_moment(1, contraction, k0) - b_kappa * contraction**2 / 2.0
    second = a_kappa * _decaying_moment(2, contraction, k0) - b_kappa * contraction**3 / 3.0
    inside = (a - b) * zeroth + a * eps * (eps * second - 2.0 * first)
    return inside, 2.0 * a * (eps * second - first)


def _decaying_moment(power: int, contraction: float, decay: float) -> float:
    """Integral from 0 to x of t^n exp(-k t): its series where k x is small, else by parts."""
    exponent = decay * contraction
    if abs(exponent) < 1.0:
        term, total = contraction ** (power + 1), 0.0
        for j in range(18):
            total += term / (power + 1 + j)
            term *= -exponent / (j + 1)
        return total
    left = math.exp(-exponent)
    moment = (1.0 - left) / decay
    for n in range(1, power + 1):
        moment = (n * moment - contraction**n * left) / decay
    return moment


def _braid_bracket(stretch: float, fibre_angle: float) -> float:
    """A stretch^2 - b with the constants of the braid."""
    sine = math.sin(fibre_angle)
    return (3.0 * stretch * stretch * (1.0 - sine * sine) - 1.0) / (sine * sine)
