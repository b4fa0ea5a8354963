"""The elastic tube against the derivative of its energy."""

from __future__ import annotations

import math

import pytest

from pamsim.physics.braid import volume_slope
from pamsim.physics.force_laws.mooney_rivlin import mooney_rivlin_force

BRAID = (0.02, math.radians(28.6))
WALL = (-152.2, 363.6, 0.0021, 0.9533)  # as fitted to the DMSP-20 map
KAPPAS = [-0.02, 0.0, 0.0133, 0.06, 0.15, 0.25]


def energy(braid, c1, c2, angle):
    """Energy of the wall per nominal length, from the stretches themselves."""
    along = 1.0 - braid
    hoop = math.sqrt(1.0 - (math.cos(angle) * along) ** 2) / math.sin(angle)
    thin = 1.0 / (along * hoop)
    first = along**2 + hoop**2 + thin**2
    second = along**-2 + hoop**-2 + thin**-2
    return 0.5 * (c1 * (first - 3.0) + c2 * (second - 3.0))


def slope(pressure, kappa, *args):
    """Derivative of the force by contraction."""
    h = 1e-5
    ends = [mooney_rivlin_force(pressure, at, *args) for at in (kappa - h, kappa + h)]
    return (ends[1] - ends[0]) / (2.0 * h)


@pytest.mark.parametrize("kappa", KAPPAS)
@pytest.mark.parametrize("wall", [(200.0, 0.0), (0.0, 200.0), (-152.2, 363.6)])
def test_the_wall_takes_the_derivative_of_its_energy(kappa, wall):
    h = 1e-5
    rise = (energy(kappa + h, *wall, BRAID[1]) - energy(kappa - h, *wall, BRAID[1])) / (2.0 * h)
    force = mooney_rivlin_force(0.0, kappa, *wall, 0.0, 1.0, *BRAID)
    assert force == pytest.approx(-rise, rel=1e-6, abs=1e-4)


def test_without_a_wall_it_is_the_ideal_law_and_at_slack_the_wall_is_free():
    ideal = -3e5 * volume_slope(0.9, 1.0, *BRAID)
    assert mooney_rivlin_force(3e5, 0.1, 0.0, 0.0, 0.0, 1.0, *BRAID) == pytest.approx(ideal)
    assert mooney_rivlin_force(0.0, 0.01, 90.0, 400.0, 0.01, 0.9, *BRAID) == pytest.approx(0.0)


def test_stiffness_at_small_strain_is_that_of_the_sum_of_both_constants():
    ends = [slope(0.0, 0.0, *w, 0.0, 1.0, *BRAID) for w in ((1, 0), (0, 1))]
    assert ends[0] == pytest.approx(ends[1], rel=1e-7)
    assert ends[0] < 0.0


def test_as_fitted_it_falls_with_contraction_wherever_it_pulls():
    for p in (0.5e5, 1e5, 3e5, 7e5):
        for i in range(-20, 300):
            kappa = i / 1000.0
            if mooney_rivlin_force(p, kappa, *WALL, *BRAID) > 0.0:
                assert slope(p, kappa, *WALL, *BRAID) < 0.0


def test_where_the_braid_cannot_be_there_is_no_number():
    for kappa in (-0.2, 1.1):  # fibres straight; shorter than nothing
        assert math.isnan(mooney_rivlin_force(1e5, kappa, 1.0, 1.0, 0.0, 1.0, *BRAID))
    assert math.isnan(mooney_rivlin_force(math.nan, 0.1, *WALL, *BRAID))
