"""Preisach: the engine's operator against relays switched one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.papers.vandamme2008.loop import (
    RelaySum,
    levels_of,
    printed_weight,
    relay_weights,
)
from pamsim.physics.hysteresis.preisach import (
    PleatedFactor,
    Preisach,
    pleated_factor_output,
    preisach_rates,
    staircase_sums,
    virgin_count,
)
from tests.unit.physics.hysteresis.operator_runs import run

C, D = -0.1, -1.0


def relay_steps(alpha: float, beta: float, inputs) -> list[float]:
    """A relay as Van Damme 2008, figure 12, draws it."""
    state, found = float(np.sign(-round(alpha + beta, 9))), []
    for u in inputs:
        state = 1.0 if u >= alpha else -1.0 if u < beta else state
        found.append(state)
    return found


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
    inputs = np.random.default_rng(1).uniform(-1.1, 1.1, 200)
    single = sum(
        weights[i, j] * np.array(relay_steps(levels[i], levels[j], inputs))
        for i in range(9)
        for j in range(i + 1)
    )
    relays = RelaySum(weights)
    assert [relays.step(u) for u in inputs] == pytest.approx(single)


@pytest.mark.parametrize(
    ("levels", "c", "d", "count"),
    [(2, C, D, 100), (8, C, D, 20), (20, C, D, 300), (41, 0.7, -0.3, 100), (100, -1.5, 1.2, 30)],
)
def test_engine_operator_equals_the_relays(levels, c, d, count):
    relays = RelaySum(relay_weights(levels, lambda alpha, beta: printed_weight(alpha, beta, c, d)))
    rng = np.random.default_rng(levels + 1)
    inputs = rng.uniform(-1.1, 1.1, count)
    if levels == 8:  # on the levels themselves too, which are numbers without rounding
        inputs = np.concatenate([inputs, rng.permutation(np.tile(levels_of(8), 10))])
    by_relays = [relays.step(u) for u in inputs]
    assert engine_output(levels, inputs, c, d) == pytest.approx(by_relays, abs=1e-12)


def test_output_and_energy_of_any_memory_are_those_of_its_relays_row_by_row():
    """Also of one written by hand, whose counts do not rise; each relay is up from its count on.

    Between its thresholds it has taken up u - beta since it went down, or alpha - u.
    """
    n, rng = np.arange(8), np.random.default_rng(2)
    levels, weights = levels_of(8), relay_weights(8, printed_weight)
    for reached, u in enumerate(levels + 0.05, start=1):
        counts = rng.integers(0, n + 2)
        z = [float(count) - virgin_count(8, i) for i, count in enumerate(counts)]
        up = np.where(n < reached, n + 1, np.minimum(counts, reached))
        risen = n[None, :] < up[:, None]
        output, *_, held = staircase_sums(8, C, D, z, float(u))
        assert output == pytest.approx(np.sum(weights * np.where(risen, 1.0, -1.0)), abs=1e-12)
        taken = np.where(risen, levels[:, None] - u, u - levels[None, :])
        between = (n[:, None] >= reached) & (n[None, :] < reached)
        assert held == pytest.approx(np.sum(weights * taken * between), abs=1e-12)


def test_virgin_state_is_neutral_and_saturation_and_the_centre_of_the_loop_are_one():
    for levels in (2, 3, 20, 21):
        weights, virgin = relay_weights(levels, printed_weight), [0.0] * levels
        assert float(np.sum(weights * RelaySum(weights).relays)) == pytest.approx(0.0, abs=1e-14)
        if levels % 2 == 0:  # with an odd number a level lies in the middle, and it switches
            neutral = staircase_sums(levels, C, D, virgin, -1e-9)[0]
            assert neutral == pytest.approx(0.0, abs=1e-13)
        group = Preisach(levels=levels, low_contraction=-0.2, high_contraction=0.2)
        for u in (1.0, -1.0):
            assert staircase_sums(levels, C, D, virgin, u)[0] == pytest.approx(u)
            # With a level in the centre the mean of both its sides counts.
            found = [run(group, [-0.3 * u, x * u])[0][-1] for x in (-1e-9, 1e-9)]
            assert 0.5 * sum(found) == pytest.approx(u, abs=1e-9)


def test_weight_is_as_printed():
    """Van Damme 2008, (5), at points on both sides of alpha + beta = 0."""
    assert printed_weight(0.3, -0.5) == math.exp(-((-0.8 + 0.1) ** 2) - (-0.2 + 1.0) ** 2)
    assert printed_weight(0.5, -0.3) == math.exp(-((-0.8 + 0.1) ** 2) - (0.2 - 1.0) ** 2)


def test_pleated_factor_is_the_loop_of_the_paper_less_the_line_through_it():
    """Van Damme 2008, (6): e lies below 0 while contracting, above 0 while extending."""
    levels = 40
    relays = RelaySum(relay_weights(levels, printed_weight))
    grid = np.linspace(-1.0, 1.0, 4001)
    relays.step(-1.0)
    loop = [relays.step(u) for u in (*grid, *grid[::-1])]
    slope, offset = np.polyfit(np.r_[grid, grid[::-1]], loop, 1)
    found = staircase_sums(levels, C, D, [0.0] * levels, 1.0)[3]
    assert found == pytest.approx(slope, abs=1e-3)
    assert offset == pytest.approx(0.0, abs=1e-3)
    group = PleatedFactor(levels=levels)
    for x in (0.0, 0.35):
        u = 2.0 * x / 0.35 - 1.0
        w = pleated_factor_output(group, [0.0] * levels, x)
        assert w == pytest.approx(found * u - u)
    # The paper takes eps_s between -1 and 1: the line ends where the relays do.
    assert pleated_factor_output(group, [0.0] * levels, 0.6) == pytest.approx(w)
    outputs = run(PleatedFactor(levels=100), [0.0, 0.175, 0.35, 0.175])[0]
    assert outputs[1::2] == pytest.approx([0.278, -0.278], abs=0.02)
