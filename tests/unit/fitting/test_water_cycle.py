"""The water cycle algorithm on known functions and on the cost (16) it was used for."""

import numpy as np
import pytest

from pamsim.core.encoding import to_dict
from pamsim.fitting.maxwell import (
    MAXWELL,
    _harmonic,
    loop_points,
    maxwell_loop,
    maxwell_residual,
)
from pamsim.fitting.water_cycle import _shares, compare_searches, water_cycle
from tests.unit.core.refusals import all_refused

LOW, HIGH = [c.low for c in MAXWELL], [c.high for c in MAXWELL]
PUBLISHED = (0.27, 49.82, 2260.0)  # Nguyen 2024, section 4.2


def loops(alpha, beta, stiffness):
    """Loops at 1 to 10 Hz and 150 N, the tests of Nguyen 2024."""
    return tuple(maxwell_loop(alpha, beta, stiffness, 2.0 * np.pi * f, 150.0) for f in range(1, 11))


def run(cost, size, seed=0, **options):
    rng = np.random.default_rng(seed)
    return water_cycle(cost, [-5.0] * size, [5.0] * size, rng=rng, **options)


KNOWN = {
    "sphere": (lambda x: float(np.sum((x - 0.3) ** 2)), [0.3, 0.3, 0.3]),
    "Rosenbrock": (lambda x: float((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2), [1.0, 1.0]),
    "Rastrigin": (lambda x: float(np.sum(x**2 - 10 * np.cos(2 * np.pi * x) + 10)), [0.0, 0.0]),
}


def test_it_finds_the_optimum_of_known_functions():
    for name, (cost, where) in KNOWN.items():
        for shrinking in (False, True):
            result = run(cost, len(where), shrinking=shrinking)
            assert result.value < 1e-4, (name, shrinking)
            assert result.x == pytest.approx(where, abs=0.02)


def test_its_result_is_the_best_it_has_tried_in_the_box_and_follows_from_the_generator():
    seen = []

    def cost(x):
        seen.append(x.copy())
        return float(np.sum(x))  # the optimum is a corner

    result = run(cost, 2, iterations=50)
    assert np.all(np.abs(seen) <= 5.0)
    assert result.value == min(np.sum(seen, axis=1)) == pytest.approx(-10.0, abs=1e-3)
    one, same, other = (run(lambda x: float(x @ x), 2, seed=s, iterations=20).x for s in (3, 3, 4))
    assert one.tolist() == same.tolist() != other.tolist()


def test_better_heads_get_more_streams_and_each_at_least_one():
    target = _shares(np.array([0.0, 6.0, 9.0, *np.linspace(10.0, 20.0, 20)]), 3)
    assert target[:3].tolist() == [0, 0, 0]  # rivers flow to the sea
    counts = np.bincount(target[3:], minlength=3)
    assert counts.sum() == 20
    assert counts[0] > counts[1] > counts[2] >= 1
    assert np.bincount(_shares(np.ones(23), 3)[3:]).sum() == 20  # a flat place


def test_points_of_a_loop_are_read_off_its_record():
    model = maxwell_loop(0.4, 0.05, 2e4, 22.0, 150.0)
    t = np.arange(0.0, 1.0, 0.002)
    turned = 22.0 * t + 0.7
    x = model.at_force * np.sin(turned) + model.at_zero * np.cos(turned) + 0.01
    x = x + 1e-6 * np.random.default_rng(0).normal(size=t.size)
    result = loop_points(t + 3.0, 150.0 * np.sin(turned) + 20.0, x)
    for name in ("frequency", "force", "at_force", "at_zero"):
        assert getattr(result, name) == pytest.approx(getattr(model, name), rel=1e-3)


def test_a_long_record_takes_no_more_harmonics_than_a_short_one(monkeypatch):
    counted = []

    def count(*args):
        counted.append(args)
        return _harmonic(*args)

    monkeypatch.setattr("pamsim.fitting.maxwell._harmonic", count)
    for periods in (1.2, 3.0, 700.0):
        t = np.linspace(0.0, 1.0, 5000)
        turned = 2.0 * np.pi * periods * t + 0.7
        counted.clear()
        result = loop_points(t, 150.0 * np.sin(turned) + 20.0, np.sin(turned - 0.3))
        assert result.frequency == pytest.approx(2.0 * np.pi * periods, rel=1e-4)
        assert len(counted) < 150


def test_what_cannot_be_searched_and_records_without_a_loop_are_refused():
    bad = {
        "empty": ([0.0], [0.0], {}, "water cycle"),
        "lengths": ([0.0], [1.0, 2.0], {}, "water cycle"),
        "population": ([0.0], [1.0], {"population": 7}, "water cycle"),
        "rivers": ([0.0], [1.0], {"rivers": 0}, "water cycle"),
    }

    def search(low, high, options):
        water_cycle(lambda x: 0.0, low, high, rng=np.random.default_rng(0), **options)

    all_refused(bad, search)
    u = np.linspace(0.0, 20.0, 400)
    bad = {
        "leads": (np.sin(u), np.cos(u), "leads the force"),
        "no sine": (np.sin(u) ** 5, np.sin(u), "not a sine"),
        "short": (np.sin(u / 20.0), -np.cos(u / 20.0), "less than one period"),
        "constant": (0.0 * u, np.sin(u), "constant"),
    }
    all_refused(bad, lambda force, displacement: loop_points(u, force, displacement))


def test_water_cycle_comes_near_the_optimum_of_16_and_least_squares_needs_far_fewer():
    planted = loops(0.5, 0.05, 2e4)  # omega beta about 1: the well-posed case
    box = ([0.05, -3.0, 3.0], [0.95, 2.0, 6.0])
    water, evolution, squares = compare_searches(
        lambda v: maxwell_residual(v, planted), *box, tolerance=1e-3, seed=1
    )
    # 0.1 N^2 over twenty equations in forces of 150 N: within 0.05 % of the load
    assert water.value < 0.1
    assert water.x == pytest.approx([0.5, np.log10(0.05), np.log10(2e4)], abs=0.02)
    assert squares.value < 1e-15
    assert squares.evaluations_to_tolerance < 100
    assert evolution.evaluations_to_tolerance > 10 * squares.evaluations_to_tolerance


def test_on_the_published_numbers_only_least_squares_finds_the_optimum():
    """(16) has a second minimum at the edge of the box, where both population searches end."""
    planted = loops(*PUBLISHED)
    water, evolution, squares = compare_searches(
        lambda v: maxwell_residual(v, planted), LOW, HIGH, tolerance=1e-3, iterations=100
    )
    assert squares.value < 1e-15  # of the model's own loops
    assert squares.x == pytest.approx([0.27, np.log10(49.82), np.log10(2260.0)], rel=1e-6)
    assert min(water.value, evolution.value) > 40.0
    assert (water.evaluations_to_tolerance, evolution.evaluations_to_tolerance) == (None, None)
    methods = ["water_cycle", "differential_evolution", "least_squares"]
    assert [to_dict(run)["method"] for run in (water, evolution, squares)] == methods
