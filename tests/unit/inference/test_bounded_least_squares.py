"""Bounded least squares: planted optima, bounds, starts, breakdowns, counts."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.bounded_least_squares import (
    BreakdownError,
    bounded_least_squares,
    one_by_one,
)
from pamsim.inference.difference_jacobian import difference_jacobian

TIME = np.linspace(0.0, 2.0, 40)


def decay(x):
    return x[0] * np.exp(-5.0 * x[1] * TIME)


class Counted:
    """Decays against one of them, every batch counted."""

    def __init__(self, truth, breaks_down=lambda x: False):
        self.truth, self.breaks_down, self.batches = np.array(truth), breaks_down, []

    def __call__(self, places):
        self.batches.append(len(places))
        return [None if self.breaks_down(x) else decay(x) - decay(self.truth) for x in places]


BEGIN = [np.array([0.2, 0.9])]


def test_of_no_coordinate_the_fit_is_what_is_there():
    fit = bounded_least_squares(one_by_one(lambda x: np.full(3, 2.0)), [np.empty(0)])
    assert (fit.x.shape, fit.jacobian.shape, fit.cost) == ((0,), (3, 0), 12.0)
    assert fit.converged
    assert (fit.steps, fit.evaluations) == (1, 1)


def test_a_planted_optimum_is_found_and_described():
    for jacobian, sizes in (("2-point", {1}), ("3-point", {1}), (1e-6, {1, 2})):
        residuals = Counted([0.7, 0.3])
        fit = bounded_least_squares(residuals, BEGIN, jacobian=jacobian)
        assert fit.x == pytest.approx([0.7, 0.3], abs=1e-6), jacobian
        assert fit.converged
        assert fit.cost == pytest.approx(float(fit.residual @ fit.residual))
        assert fit.jacobian[:, 0] == pytest.approx(np.exp(-1.5 * TIME), abs=1e-4)
        assert set(residuals.batches) == sizes  # of a step, a Jacobian is one call
        assert fit.evaluations == sum(residuals.batches)
        start = decay([0.2, 0.9]) - decay([0.7, 0.3])
        assert fit.start_cost == pytest.approx(np.sum(start**2))
    short = bounded_least_squares(Counted([0.7, 0.3]), BEGIN, max_steps=2)
    assert (short.converged, short.steps) == (False, 2)


def test_the_clients_jacobian_is_handed_the_residual_and_nothing_is_computed_twice():
    residuals, asked = Counted([0.7, 0.3]), []

    def jacobian(x, residual):
        asked.append(x)
        assert residual == pytest.approx(decay(x) - decay([0.7, 0.3]), abs=1e-15)
        slope = np.exp(-5.0 * x[1] * TIME)
        return np.column_stack([slope, -5.0 * x[0] * TIME * slope])

    fit = bounded_least_squares(residuals, [np.array([0.2, 0.9])], jacobian=jacobian)
    assert fit.x == pytest.approx([0.7, 0.3], abs=1e-7)
    assert set(residuals.batches) == {1}
    assert fit.evaluations == len(residuals.batches) == fit.steps
    assert len(asked) <= fit.steps


def test_a_box_in_other_units_and_an_open_side():
    def residual(x):
        return np.array([x[0] / 1e5 - 3.0, x[1] - 2.0, x[2] + 4.0])

    fit = bounded_least_squares(
        one_by_one(residual),
        [np.array([1e5, 0.0, 0.0])],
        lower=[0.0, -np.inf, -1.0],
        upper=[2e5, np.inf, np.inf],
        try_bounds=True,
    )
    assert fit.x.tolist() == [2e5, pytest.approx(2.0), -1.0]


def test_a_bound_that_attracts_is_tried_only_if_asked_for():
    def residual(x):
        return np.array([x[0] - 1.5, x[1] - 0.5])

    start = [np.array([0.5, 0.5])]
    inside = bounded_least_squares(one_by_one(residual), start)
    assert inside.x[0] < 1.0
    fit = bounded_least_squares(one_by_one(residual), start, try_bounds=True)
    assert fit.x.tolist() == [1.0, pytest.approx(0.5)]
    assert fit.cost == pytest.approx(0.25)


def test_the_most_promising_starts_are_followed_and_the_best_end_counts():
    def residual(x):  # two valleys: at 0.2, and a shallower one at 0.8
        return np.array([(x[0] - 0.2) * (x[0] - 0.8) * 5.0, 0.1 * (x[0] - 0.2)])

    starts = [np.array([v]) for v in (0.95, 0.75, 0.1, 0.5)]
    fit = bounded_least_squares(one_by_one(residual), starts, follow=2)
    costs = [float(residual(s) @ residual(s)) for s in starts]
    assert fit.x == pytest.approx([0.2], abs=1e-6)
    assert fit.start_cost == pytest.approx(sorted(costs)[1])
    nearest = bounded_least_squares(one_by_one(residual), starts, follow=1)
    assert nearest.start_cost == pytest.approx(min(costs))
    assert nearest.x == pytest.approx([0.8], abs=0.02)
    assert nearest.evaluations < fit.evaluations


def test_a_search_goes_round_where_the_simulation_breaks_down():
    residuals = Counted([0.7, 0.3], breaks_down=lambda x: x[1] < 0.28)
    fit = bounded_least_squares(residuals, BEGIN, jacobian=1e-5)
    assert fit.x == pytest.approx([0.7, 0.3], abs=1e-5)
    residuals = Counted([0.7, 0.3], breaks_down=lambda x: x[0] > 0.8)
    starts = [np.array([0.9, 0.5]), np.array([0.5, 0.5])]
    fit = bounded_least_squares(residuals, starts, jacobian=1e-6)
    assert fit.x == pytest.approx([0.7, 0.3], abs=1e-5)
    with pytest.raises(BreakdownError, match="at all 1 starts"):
        bounded_least_squares(residuals, starts[:1])
    assert issubclass(BreakdownError, InputError)


@pytest.mark.parametrize("central", [False, True])
def test_differences_go_inward_and_to_the_other_side_where_one_breaks_down(central):
    place, step = np.array([0.6, 0.2]), 1e-6
    asked = []

    def residuals(places):
        asked.append(places)
        return [None if x[1] > 0.2 else decay(x) for x in places]

    found = difference_jacobian(residuals, place, decay(place), step, central=central)
    exact = np.exp(-TIME)
    assert found[:, 0] == pytest.approx(exact, abs=1e-6)
    assert found[:, 1] == pytest.approx(-5.0 * 0.6 * TIME * exact, abs=1e-4)
    assert [len(places) for places in asked] == ([4] if central else [2, 1])
    nowhere = difference_jacobian(lambda p: [None] * len(p), place, decay(place), step)
    assert np.all(nowhere == 0.0)


def test_a_search_that_is_not_worth_its_time_ends_where_it_has_arrived():
    def valley(places):
        return [np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]) for x in places]

    begin = [np.array([0.1, 0.9])]
    whole = bounded_least_squares(valley, begin, jacobian=1e-6)
    seen = []

    def give_up(residual, jacobian):
        seen.append((residual, jacobian))
        return len(seen) == 3

    part = bounded_least_squares(valley, begin, jacobian=1e-6, give_up=give_up)
    assert whole.converged
    assert not part.converged
    assert len(seen) == 3
    np.testing.assert_array_equal(part.residual, seen[-1][0])
    assert whole.cost < part.cost < part.start_cost
    assert part.cost == pytest.approx(float(part.residual @ part.residual))
