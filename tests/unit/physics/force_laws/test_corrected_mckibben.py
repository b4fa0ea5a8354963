"""The corrected McKibben law: its limits, its unit of pressure, and its threshold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from pamsim.physics.force_laws.mckibben import (
    CorrectedMcKibben,
    corrected_mckibben_force,
    ideal_force,
)

DIAMETER, ANGLE = 0.02, math.radians(28.6)
IDEAL = (0.0, -1.0, 0.0, -1.0, 40.0)
FITTED = (15.53, -1.2386, 0.3788, -1.1877, 40.0)  # to a measured map of a 20 mm muscle


def printed(bar: float, kappa: float, a_eps, b_eps, a_kappa, b_kappa, k0) -> float:
    """Equation (2) of Sarosi in its own unit, the bar, times 1e5 for newtons."""
    a, b = 3.0 / math.tan(ANGLE) ** 2, 1.0 / math.sin(ANGLE) ** 2
    eps = a_eps * math.exp(-bar) - b_eps
    mu = a_kappa * math.exp(-kappa * k0) - b_kappa
    area = math.pi * (DIAMETER / 2.0) ** 2
    return mu * bar * area * (a * (1.0 - eps * kappa) ** 2 - b) * 1e5


@pytest.mark.parametrize("bar", [0.5, 2.0, 6.0])
@pytest.mark.parametrize("kappa", [-0.02, 0.0, 0.07, 0.25])
def test_is_the_printed_equation_with_pressure_in_bar(bar, kappa):
    force = corrected_mckibben_force(bar * 1e5, kappa, *FITTED, DIAMETER, ANGLE)
    assert force == pytest.approx(printed(bar, kappa, *FITTED), rel=1e-12)


@pytest.mark.parametrize("kappa", [-0.05, 0.0, 0.1, 0.3])
def test_without_corrections_it_is_the_ideal_law(kappa):
    force = corrected_mckibben_force(3e5, kappa, *IDEAL, DIAMETER, ANGLE)
    ideal = ideal_force(3e5, 0.3 * (1.0 - kappa), 0.3, DIAMETER, ANGLE)
    assert force == pytest.approx(ideal, rel=1e-12)


def test_k0_of_the_paper_is_the_default():
    assert CorrectedMcKibben(a_eps=0.0, b_eps=-1.0, a_kappa=0.0, b_kappa=-1.0).k0 == 40.0


def threshold_at(kappa: float) -> float:
    """Pressure [Pa] above which the muscle pulls."""
    return brentq(
        lambda p: corrected_mckibben_force(p, kappa, *FITTED, DIAMETER, ANGLE), 1e5, 1e6, xtol=1e-6
    )


@pytest.mark.parametrize("kappa", [0.15, 0.18, 0.22])
def test_above_the_threshold_the_pull_grows_with_pressure(kappa):
    above = np.linspace(threshold_at(kappa), 2e6, 2001)
    forces = [corrected_mckibben_force(p, kappa, *FITTED, DIAMETER, ANGLE) for p in above]
    assert forces[0] == pytest.approx(0.0, abs=1e-6)
    assert np.all(np.diff(forces) > 0.0)


def test_the_formula_pulls_again_far_below_the_threshold():
    """The flaw the module warns of: a square of a negative number, not a muscle."""
    kappa = 0.2
    threshold = threshold_at(kappa)
    assert 2e5 < threshold < 4e5
    assert corrected_mckibben_force(0.95 * threshold, kappa, *FITTED, DIAMETER, ANGLE) < 0.0
    assert corrected_mckibben_force(0.6e5, kappa, *FITTED, DIAMETER, ANGLE) > 0.0
