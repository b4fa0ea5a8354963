"""Preisach: the engine's operator against relays switched one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.papers.vandamme2008.relays import (
    RelaySum,
    levels_of,
    printed_weight,
    relay_weights,
    triangle_integral,
)
from pamsim.physics.hysteresis.preisach import (
    PleatedFactor,
    Preisach,
    pleated_factor_output,
    preisach_rates,
    staircase_sums,
)
from tests.unit.physics.hysteresis.operator_runs import run

C, D = -0.1, -1.0


class PlainRelay:
    """A relay as Van Damme 2008, figure 12, draws it."""

    def __init__(self, alpha: float, beta: float) -> None:
        self.alpha, self.beta = alpha, beta
        self.state = float(np.sign(-round(alpha + beta, 9)))

    def step(self, u: float) -> float:
        if u >= self.alpha:
            self.state = 1.0
        elif u < self.beta:
            self.state = -1.0
        return self.state


def reversals(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.1, 1.1, count)


def engine_output(levels: int, inputs: np.ndarray, c: float = C, d: float = D) -> list[float]:
    group = Preisach(levels=levels, low_contraction=-0.5, high_contraction=0.5, c=c, d=d)
    act, rates = [0.0] * levels, [0.0] * levels
    found = []
    for u in inputs:
        found.append(staircase_sums(levels, c, d, act, u)[0])
        preisach_rates(group, act, rates, 0.5 * u, 0.0, 1e-3)
        act = [z + 1e-3 * rate for z, rate in zip(act, rates, strict=True)]
    return found


def test_relay_sum_is_the_sum_of_single_relays():
    levels, weights = levels_of(9), relay_weights(9, printed_weight)
    single = [
        (weights[i, j], PlainRelay(levels[i], levels[j])) for i in range(9) for j in range(i + 1)
    ]
    relays = RelaySum(weights)
    for u in reversals(200, seed=1):
        assert relays.step(u) == pytest.approx(math.fsum(w * r.step(u) for w, r in single))


@pytest.mark.parametrize(
    ("levels", "c", "d", "count"),
    [(2, C, D, 300), (3, C, D, 300), (20, C, D, 1000), (41, 0.7, -0.3, 300), (100, -1.5, 1.2, 60)],
)
def test_engine_operator_equals_the_relays(levels, c, d, count):
    relays = RelaySum(relay_weights(levels, lambda alpha, beta: printed_weight(alpha, beta, c, d)))
    inputs = reversals(count, seed=levels + 1)
    by_relays = [relays.step(u) for u in inputs]
    assert engine_output(levels, inputs, c, d) == pytest.approx(by_relays, abs=1e-12)


def test_inputs_on_the_levels_themselves_agree():
    levels = 8
    weights = relay_weights(levels, printed_weight)
    relays = RelaySum(weights)
    inputs = np.random.default_rng(5).permutation(np.tile(levels_of(levels), 20))
    by_relays = [relays.step(u) for u in inputs]
    assert engine_output(levels, inputs) == pytest.approx(by_relays, abs=1e-12)


@pytest.mark.parametrize("levels", [2, 3, 20, 21])
def test_virgin_state_is_neutral_and_saturation_is_one(levels):
    weights = relay_weights(levels, printed_weight)
    relays = RelaySum(weights)
    assert float(np.sum(weights * relays.relays)) == pytest.approx(0.0, abs=1e-14)
    virgin = [0.0] * levels
    if levels % 2 == 0:  # with an odd number a level lies in the middle, and it switches
        assert staircase_sums(levels, C, D, virgin, -1e-9)[0] == pytest.approx(0.0, abs=1e-13)
    for u in (1.0, -1.0):
        assert relays.step(u) == pytest.approx(u)
        assert staircase_sums(levels, C, D, virgin, u)[0] == pytest.approx(u)


def test_weight_as_printed():
    """Van Damme 2008, (5), written out at points on both sides of alpha + beta = 0."""
    assert printed_weight(0.3, -0.5) == math.exp(-((-0.8 + 0.1) ** 2) - (-0.2 + 1.0) ** 2)
    assert printed_weight(0.5, -0.3) == math.exp(-((-0.8 + 0.1) ** 2) - (0.2 - 1.0) ** 2)
    assert printed_weight(0.8, 0.1) == pytest.approx(printed_weight(-0.1, -0.8), rel=1e-14)


@pytest.mark.parametrize(("c", "d"), [(C, D), (0.5, 0.5), (-1.0, -2.0)])
def test_weight_is_normalised_on_the_triangle(c, d):
    """Sum over a fine grid, whose error falls with the square of the cell."""
    sums = []
    for count in (150, 300):
        points = levels_of(count)
        alpha, beta = np.meshgrid(points, points, indexing="ij")
        middle = np.abs(alpha + beta) + d
        values = np.exp(-((beta - alpha - c) ** 2) - middle**2)
        sums.append(float(np.sum(np.tril(values, -1)) + 0.5 * np.trace(values)) * 4.0 / count**2)
    assert sums[1] + (sums[1] - sums[0]) / 3.0 == pytest.approx(triangle_integral(c, d), rel=1e-6)


def test_pleated_line_is_the_least_squares_line_through_the_major_loop():
    levels = 40
    relays = RelaySum(relay_weights(levels, printed_weight))
    grid = np.linspace(-1.0, 1.0, 8001)
    relays.step(-1.0)
    rising = [relays.step(u) for u in grid]
    falling = [relays.step(u) for u in grid[::-1]]
    slope, offset = np.polyfit(np.r_[grid, grid[::-1]], np.r_[rising, falling], 1)
    found = staircase_sums(levels, C, D, [0.0] * levels, 1.0)[3]
    assert found == pytest.approx(slope, abs=1e-3)
    assert offset == pytest.approx(0.0, abs=1e-3)
    group = PleatedFactor(levels=levels)
    for x in (0.0, 0.35):
        u = 2.0 * x / 0.35 - 1.0
        w = pleated_factor_output(group, [0.0] * levels, x)
        assert w == pytest.approx(found * u - u)


def test_pleated_factor_is_small_beside_the_loop_of_the_paper():
    """Van Damme 2008, (6): e lies below 0 while contracting, above 0 while extending."""
    levels = 100
    group = PleatedFactor(levels=levels)
    act, rates = [0.0] * levels, [0.0] * levels
    outputs = []
    for x in (0.0, 0.175, 0.35, 0.175):
        outputs.append(pleated_factor_output(group, act, x))
        preisach_rates(group, act, rates, x, 0.0, 1e-3)
        act = [z + 1e-3 * rate for z, rate in zip(act, rates, strict=True)]
    assert outputs[1] == pytest.approx(0.278, abs=0.02)
    assert outputs[3] == pytest.approx(-0.278, abs=0.02)


def test_pleated_factor_ends_with_its_span():
    """Van Damme 2008 takes eps_s between -1 and 1: the line ends where the relays do."""
    group = PleatedFactor(levels=12)
    at_end = pleated_factor_output(group, [0.0] * 12, 0.35)
    assert pleated_factor_output(group, [0.0] * 12, 0.6) == pytest.approx(at_end)


@pytest.mark.parametrize("levels", [2, 20, 31])
def test_preisach_is_one_in_the_centre_of_its_major_loop(levels):
    """An odd number has a level in the centre: there the mean of both its sides counts."""
    group = Preisach(levels=levels, low_contraction=-0.2, high_contraction=0.2)
    for side in (1.0, -1.0):
        found = [run(group, [-0.3 * side, x * side])[0][-1] for x in (-1e-9, 1e-9)]
        assert 0.5 * sum(found) == pytest.approx(side, abs=1e-9)
