"""Fractional Maxwell element: three routes, and the printed loop."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from pamsim.fitting.maxwell import maxwell_loop
from pamsim.papers.nguyen2024.geometry import element
from pamsim.papers.nguyen2024.loop import (
    complex_stiffness,
    loop_distance,
    simulate_fractional,
)
from pamsim.physics.hysteresis.fractional_maxwell import (
    FractionalMaxwell,
    branch_rate,
    branch_weight,
)
from tests.unit.physics.hysteresis.operator_runs import run

ORDER, BETA, STIFFNESS = element()
PUBLISHED = FractionalMaxwell(order=ORDER, time_constant=BETA, span=1.0)


def band_error(group: FractionalMaxwell) -> float:
    """Largest relative error of the sum's complex stiffness between 0.05 and 50 Hz."""
    omega = np.geomspace(0.05, 50.0, 100) * (2.0 * math.pi)
    exact = [complex_stiffness(w, group.order, group.time_constant, 1.0) for w in omega.tolist()]
    approximate = sum(
        branch_weight(group, k) * 1j * omega / (1j * omega + branch_rate(group, k))
        for k in range(group.state_count)
    )
    return float(np.max(np.abs(approximate / np.array(exact) - 1.0)))


def test_complex_stiffness_solves_the_equation():
    """(8) under exp(jwt): F + beta^a (jw)^a F = K_e beta^a (jw)^a x."""
    for omega in (0.3, 9.0, 300.0):
        found = complex_stiffness(omega, ORDER, BETA, STIFFNESS)
        derivative = BETA**ORDER * cmath.exp(ORDER * cmath.log(1j * omega))
        assert found + derivative * found == pytest.approx(STIFFNESS * derivative)
    assert abs(complex_stiffness(1e40, 0.5, 1.0, 3.0)) == pytest.approx(3.0)


def test_the_sum_of_branches_meets_the_element_within_the_stated_bound():
    assert band_error(PUBLISHED) < 5e-4
    for order, beta, branches, bound in (
        (0.1, 1.0, 16, 5e-4),
        (0.5, 1.0, 16, 1e-3),
        (0.7, 0.1, 24, 5e-4),
        (0.27, 0.01, 16, 5e-4),
    ):
        group = FractionalMaxwell(order=order, time_constant=beta, span=1.0, branches=branches)
        assert band_error(group) < bound, order


def test_the_outer_branches_have_the_mean_rates_of_the_tails_they_stand_for():
    """Slow rates by their own mean, fast ones by that of their times: what a loop sees of each."""
    for order in (0.2, 0.6):
        group = FractionalMaxwell(order=order, time_constant=BETA, span=1.0)
        slow, fast = (branch_rate(group, group.state_count - k) for k in (2, 1))
        tail = np.geomspace(1.0, 1e40, 100_001)
        # The density is r^order below and r^-order above, per logarithm of the rate.
        all_, first = (np.trapezoid(tail ** (-order - k), np.log(tail)) for k in (0, 1))
        assert slow == pytest.approx(group.slowest_rate * first / all_, rel=1e-4), order
        assert fast == pytest.approx(group.fastest_rate * all_ / first, rel=1e-4), order


def test_weights_are_positive_and_add_up_to_one():
    """Positive weights make any such sum passive; the sum is the instantaneous stiffness."""
    for order in (0.05, 0.27, 0.6, 0.95):
        for branches, error in ((16, 5e-5), (64, 1e-7)):
            group = FractionalMaxwell(order=order, time_constant=BETA, span=1.0, branches=branches)
            weights = [branch_weight(group, k) for k in range(branches)]
            assert min(weights) > 0.0
            if order <= 0.6:
                assert math.fsum(weights) == pytest.approx(1.0, abs=error), order


def test_engine_operator_follows_the_reference():
    """A motion with rests and turns, over two seconds."""
    step = 1e-3
    t = step * np.arange(2001)
    x = 0.05 * np.sin(9.0 * t) ** 2 * np.clip(t, 0.0, 1.0)
    reference = simulate_fractional(x, step, ORDER, BETA, 1.0)
    found = np.array([0.0, *run(PUBLISHED, x[1:].tolist(), timestep=step)[0]])
    assert np.max(np.abs(found - reference)) < 2e-3 * np.max(np.abs(reference))


@pytest.mark.parametrize("hertz", [3.5, 10.0])
def test_simulated_loop_lies_on_the_printed_one(hertz):
    """(13) within 1 % of F_0, after the slow branches have forgotten the start."""
    omega, force, step = 2.0 * math.pi * hertz, 125.0, 1e-3
    stiffness = complex_stiffness(omega, ORDER, BETA, STIFFNESS)
    size, phase = force / abs(stiffness), cmath.phase(stiffness)
    count = round(8.0 / hertz / step)
    t = step * np.arange(1, count + 1)
    # Displacement that gives F_0 sin(w t) in the end; it starts from zero, as the operator does.
    x = size * np.sin(omega * t - phase)
    ramp = np.minimum(1.0, t * hertz)
    w = STIFFNESS * np.array(run(PUBLISHED, (ramp * x).tolist(), timestep=step)[0])
    last = slice(count - round(1.0 / hertz / step), count)
    distance = loop_distance(x[last], w[last], force, omega, ORDER, BETA, STIFFNESS)
    assert np.max(np.abs(distance)) < 0.01


def test_loop_points_are_where_the_paper_puts_them():
    """(14) and (15) from the complex stiffness: x at F = F_0, and at F = 0 on the way up."""
    omega, force = 22.0, 148.0
    lag = force / complex_stiffness(omega, ORDER, BETA, STIFFNESS)
    loop = maxwell_loop(ORDER, BETA, STIFFNESS, omega, force)
    assert (loop.at_force, loop.at_zero) == pytest.approx((lag.real, lag.imag))
    x = np.array([loop.at_force, loop.at_zero])
    points = loop_distance(x, np.array([force, 0.0]), force, omega, ORDER, BETA, STIFFNESS)
    assert points == pytest.approx(np.zeros(2), abs=1e-12)
