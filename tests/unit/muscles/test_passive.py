"""The passive spring: what its three parameters mean."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.muscles.passive import HardeningPassive, hardening_force

SPRINGS = [(24000.0, 85.8, -0.0336), (500.0, 0.1, 0.2), (3e4, 5.0, 0.0)]


@pytest.mark.parametrize("spring", SPRINGS)
def test_free_at_the_slack_point_with_the_stated_stiffness(spring):
    stiffness, hardening, slack = spring
    assert hardening_force(slack, *spring) == 0.0
    h = 1e-3 / hardening
    f = [hardening_force(slack + k * h, *spring) for k in (-2, -1, 1, 2)]
    slope = (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * h)
    assert slope == pytest.approx(-stiffness, rel=1e-9)


@pytest.mark.parametrize("spring", SPRINGS)
def test_hardens_e_fold_per_one_over_h_of_stretch(spring):
    """Stiffness is the force's distance from -k/h times h: it grows by e per 1/h of stretch."""
    stiffness, hardening, slack = spring
    floor = stiffness / hardening
    for contraction in (slack - 1.0 / hardening, slack, slack + 0.5 / hardening):
        here = hardening_force(contraction, *spring) + floor
        stretched = hardening_force(contraction - 1.0 / hardening, *spring) + floor
        assert stretched / here == pytest.approx(math.e, rel=1e-12)


@pytest.mark.parametrize("spring", SPRINGS)
def test_falls_with_contraction_and_resists_with_k_over_h_at_most(spring):
    stiffness, hardening, slack = spring
    contractions = slack + np.linspace(-5.0, 20.0, 101) / hardening
    forces = np.array([hardening_force(float(k), *spring) for k in contractions])
    assert np.all(np.diff(forces) < 0.0)
    assert np.all(forces > -stiffness / hardening)
    assert forces[-1] == pytest.approx(-stiffness / hardening, rel=1e-8)


def test_default_spring_is_no_spring():
    spring = HardeningPassive()
    for contraction in (-0.3, 0.0, 0.25):
        force = hardening_force(
            contraction, spring.stiffness, spring.hardening, spring.slack_contraction
        )
        assert force == 0.0
