"""Each force law against the equation that its authors printed, and what follows from it."""

import itertools
import math

import numpy as np
import pytest

from pamsim.core.units import to_si
from pamsim.physics.braid import volume_slope
from pamsim.physics.force_laws.exponential import (
    invertible_exponential_force,
    single_pressure_force,
    six_parameter_force,
)
from pamsim.physics.force_laws.force_law import coefficients_of, swept_volume
from pamsim.physics.force_laws.mckibben import (
    CorrectedMcKibben,
    corrected_mckibben_force,
    elastic_energy_force,
    ideal_force,
    ideal_tension,
)
from pamsim.physics.force_laws.mooney_rivlin import mooney_rivlin_force
from pamsim.physics.force_laws.pleated import (
    SLENDERNESS_6,
    pleated_force,
    pleated_function,
    pleated_shape_force,
)
from pamsim.physics.force_laws.published import PUBLISHED
from tests.unit.papers.printed_equations import isobar

LENGTH, BRAID = 0.3, (0.02, math.radians(28.6))  # DMSP-20-300N of Nguyen 2024
POINTS = list(itertools.product((0.0, 1e5, 4.3e5), (-0.03, 0.0, 0.08, 0.25)))
"""Gauge pressure [Pa] and contraction."""


# --- exponential laws: one family ----------------------------------------------------------------

# a [N/bar], b [N], c [1/%], d [N/(bar %)], e [N/bar], f [N]: p in bar, k in percent
PRINTED = {
    "DMSP-20-200": (-4.00180705, 292.4620246, -0.32930845, -9.33564098, 294.0538256, -280.498151),
    "DMSP-20-400": (-4.35573, 281.22370, -0.32866, -9.27035, 302.20107, -263.69185),
    "DMSP-10": (-9.2194029, 203.7012413, -0.34221042, -3.2255991, 109.2038216, -208.372034),
}


@pytest.mark.parametrize("name", PRINTED)
def test_published_constants_in_si_give_the_printed_force(name):
    """Which falls with contraction and rises with pressure."""
    a, b, c, d, e, f = PRINTED[name]
    law = PUBLISHED[name]
    in_si = [to_si(one, "N/bar", "N/Pa", where="test") for one in (a, d * 100.0, e)]
    per_percent = to_si(c, "1/percent", "1", where="test")
    assert coefficients_of(law)[1:] == pytest.approx([in_si[0], b, per_percent, *in_si[1:], f])
    surface = np.zeros((6, 26))
    for (i, p), k in itertools.product(enumerate(np.linspace(1.0, 6.0, 6)), range(26)):
        terms = ((a * p + b) * math.exp(c * k), d * p * k, e * p, f)
        force = six_parameter_force(p * 1e5, k / 100.0, *coefficients_of(law)[1:])
        assert force == pytest.approx(sum(terms), abs=1e-12 * max(map(abs, terms)))
        surface[i, k] = force
    assert np.all(np.diff(surface, axis=1) < 0.0)
    assert np.all(np.diff(surface, axis=0) > 0.0)
    if name == "DMSP-20-200":  # sources for 6 bar and no contraction: 1264 to 1752 N
        assert 1264.0 < surface[-1, 0] < 1760.0


def test_the_exponential_laws_are_one_family():
    """Eight printed constants are seven, six are seven without one, an isobar is the single one."""
    a, b, c, d, *rest = (7e-5, 420.0, -51.0, 0.4, -8.9e-3, 159.0, 2.7e-3, -327.0)
    e, f, g, h = rest
    seven = (a * math.exp(d), b * math.exp(d), c, *rest)
    for p, k in POINTS:
        wanted = (a * p + b) * math.exp(c * k + d) + (e * p + f) * k + g * p + h
        found = invertible_exponential_force(p, k, *seven)
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-9)
        for law in PUBLISHED.values():
            a_, b_, c_, d_, e_, f_ = coefficients_of(law)[1:]
            six = six_parameter_force(p, k, a_, b_, c_, d_, e_, f_)
            assert invertible_exponential_force(p, k, a_, b_, c_, d_, 0.0, e_, f_) == six
            cut = coefficients_of(isobar(law, p))[1:]
            assert single_pressure_force(1.0, k, *cut) == pytest.approx(six, rel=1e-12, abs=1e-9)
    a, b, c, d, e = 350.0, -35.0, 0.3, -900.0, 610.0  # Sarosi (3)
    for k in (0.0, 0.05, 0.2):
        wanted = a * math.exp(b * k + c) + d * k + e
        force = single_pressure_force(3e5, k, a * math.exp(c), b, d, e)
        assert force == pytest.approx(wanted, rel=1e-13)


def test_volume_of_a_law_that_states_its_force_alone_is_the_integral_of_its_slope_by_pressure():
    def force(pressure, contraction, area):
        return area * pressure * (1.0 - 3.0 * contraction + 40.0 * contraction**7)

    for kappa in (-0.05, 0.1, 0.4):
        expected = 2e-4 * (kappa - 1.5 * kappa**2 + 5.0 * kappa**8)
        assert swept_volume(force)(3e5, kappa, 2e-4) == pytest.approx(expected, rel=1e-9)


# --- the corrected McKibben law ------------------------------------------------------------------

FITTED = (15.53, -1.2386, 0.3788, -1.1877, 40.0)  # to a measured map of a 20 mm muscle


def test_the_corrected_law_is_printed_with_pressure_in_bar_and_ideal_without_corrections():
    """Equation (2) of Sarosi in its own unit, the bar, times 1e5 for newtons."""
    a, b = 3.0 / math.tan(BRAID[1]) ** 2, 1.0 / math.sin(BRAID[1]) ** 2
    area = math.pi * (BRAID[0] / 2.0) ** 2
    a_eps, b_eps, a_kappa, b_kappa, k0 = FITTED
    assert CorrectedMcKibben(a_eps=0.0, b_eps=-1.0, a_kappa=0.0, b_kappa=-1.0).k0 == k0
    for bar, kappa in itertools.product((0.5, 2.0, 6.0), (-0.02, 0.0, 0.07, 0.25)):
        eps = a_eps * math.exp(-bar) - b_eps
        mu = a_kappa * math.exp(-kappa * k0) - b_kappa
        printed = mu * bar * area * (a * (1.0 - eps * kappa) ** 2 - b) * 1e5
        force = corrected_mckibben_force(bar * 1e5, kappa, *FITTED, *BRAID)
        assert force == pytest.approx(printed, rel=1e-12)
        plain = corrected_mckibben_force(bar * 1e5, kappa, 0.0, -1.0, 0.0, -1.0, k0, *BRAID)
        ideal = ideal_force(bar * 1e5, LENGTH * (1.0 - kappa), LENGTH, *BRAID)
        assert plain == pytest.approx(ideal, rel=1e-12)


# --- the energy of the air -----------------------------------------------------------------------

WORK = (3e5, 0.12)
LOAD = ideal_tension(*WORK, LENGTH, *BRAID)
"""What the muscle pulls at the working point (Nguyen 2024, (3))."""


def test_with_the_load_at_the_working_point_the_elastic_energy_s_force_is_the_ideal_law():
    assert elastic_energy_force(*WORK, *WORK, *BRAID) == 0.0
    assert ideal_tension(3e5, 0.1, LENGTH, *BRAID) > 0.0  # the sign that the print of (3) has lost
    for p, kappa in POINTS:
        total = elastic_energy_force(p, kappa, *WORK, *BRAID) + LOAD
        ideal = ideal_force(p, LENGTH * (1.0 - kappa), LENGTH, *BRAID)
        assert total == pytest.approx(ideal, rel=1e-12, abs=1e-9)


# --- the elastic tube ----------------------------------------------------------------------------


def energy(kappa, c1, c2):
    """Energy of the wall per nominal length, from the stretches themselves."""
    along = 1.0 - kappa
    hoop = math.sqrt(1.0 - (math.cos(BRAID[1]) * along) ** 2) / math.sin(BRAID[1])
    squares = np.array([along, hoop, 1.0 / (along * hoop)]) ** 2
    return 0.5 * (c1 * (squares.sum() - 3.0) + c2 * ((1.0 / squares).sum() - 3.0))


def test_the_wall_of_a_tube_takes_the_derivative_of_its_energy():
    h = 1e-5
    for kappa in (-0.02, 0.0, 0.0133, 0.06, 0.15, 0.25):
        for wall in ((200.0, 0.0), (0.0, 200.0), (-152.2, 363.6)):
            rise = (energy(kappa + h, *wall) - energy(kappa - h, *wall)) / (2.0 * h)
            force = mooney_rivlin_force(0.0, kappa, *wall, 0.0, 1.0, *BRAID)
            assert force == pytest.approx(-rise, rel=1e-6, abs=1e-4)
    # Without a wall it is the ideal law of its active share; at slack the wall is free.
    ideal = -3e5 * volume_slope(1.0 - 0.1 / 0.9, 1.0, *BRAID)
    assert mooney_rivlin_force(3e5, 0.1, 0.0, 0.0, 0.0, 0.9, *BRAID) == pytest.approx(ideal)
    assert mooney_rivlin_force(0.0, 0.01, 90.0, 400.0, 0.01, 0.9, *BRAID) == pytest.approx(0.0)
    for kappa in (-0.2, 1.1):  # fibres straight; shorter than nothing
        assert math.isnan(mooney_rivlin_force(1e5, kappa, 1.0, 1.0, 0.0, 1.0, *BRAID))


# --- the pleated muscle's polynomial -------------------------------------------------------------


def test_the_pleated_polynomial_is_printed_and_pulls_too_hard_below_five_percent():
    """Its 1/eps grows faster than the exact force: 3 % too much at 3 %, 8 % at 2 %."""
    f = (0.02, 1.1, -4.7, 6.9, -5.2)
    for eps, length in ((0.05, 0.06), (0.2, 0.06), (0.4, 0.12)):  # by the square of its length
        polynomial = f[0] / eps + f[1] + f[2] * eps + f[3] * eps**2 + f[4] * eps**3
        wanted = 2e5 * length**2 * polynomial
        assert pleated_force(2e5, eps, *f, length) == pytest.approx(wanted, rel=1e-13)
    six = coefficients_of(SLENDERNESS_6)[1:]
    for eps, excess in ((0.03, 0.031), (0.02, 0.084)):
        ratio = pleated_force(1e5, eps, *six, 0.06) / pleated_shape_force(1e5, eps, 6.0, 0.06)
        assert ratio - 1.0 == pytest.approx(excess, abs=1e-3)
    for eps in (0.0, -0.05, math.nan):  # where it has no force
        assert math.isnan(pleated_function(eps, *six))
        assert math.isnan(pleated_force(1e5, eps, *six, 0.06))
