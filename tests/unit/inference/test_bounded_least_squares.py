"""Bounded least squares: planted optima, bounds, starts, breakdowns, counts."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.inference.bounded_least_squares import BreakdownError, bounded_least_squares
from pamsim.inference.difference_jacobian import difference_jacobian

TIME = np.linspace(0.0, 2.0, 40)
PLANTED = np.array([0.7, 0.3])
BEGIN = [np.array([0.2, 0.9])]


def decay(x):
    return x[0] * np.exp(-5.0 * x[1] * TIME)


class Counted:
    """Decays against the planted one, every place counted."""

    def __init__(self, breaks_down=lambda x: False):
        self.breaks_down, self.count = breaks_down, 0

    def __call__(self, x):
        self.count += 1
        return None if self.breaks_down(x) else decay(x) - decay(PLANTED)


def exact_jacobian(x, residual):
    assert residual == pytest.approx(decay(x) - decay(PLANTED), abs=1e-15)
    slope = np.exp(-5.0 * x[1] * TIME)
    return np.column_stack([slope, -5.0 * x[0] * TIME * slope])


def test_of_no_coordinate_the_fit_is_what_is_there():
    fit = bounded_least_squares(lambda x: np.full(3, 2.0), [np.empty(0)])
    assert (fit.x.shape, fit.jacobian.shape, fit.cost) == ((0,), (3, 0), 12.0)
    assert (fit.converged, fit.steps) == (True, 1)


def test_a_planted_optimum_is_found_and_nothing_is_computed_twice():
    for jacobian in ("2-point", "3-point", exact_jacobian):
        residual = Counted()
        fit = bounded_least_squares(residual, BEGIN, jacobian=jacobian)
        assert fit.x == pytest.approx(PLANTED, abs=1e-6), jacobian
        assert fit.converged
        assert fit.jacobian[:, 0] == pytest.approx(np.exp(-1.5 * TIME), abs=1e-4)
        assert fit.start_cost == pytest.approx(np.sum((decay(BEGIN[0]) - decay(PLANTED)) ** 2))
    assert residual.count == fit.steps  # with a Jacobian of the client's own
    short = bounded_least_squares(Counted(), BEGIN, max_steps=2)
    assert (short.converged, short.steps) == (False, 2)


def test_a_box_in_other_units_and_an_open_side():
    fit = bounded_least_squares(
        lambda x: np.array([x[0] / 1e5 - 3.0, x[1] - 2.0, x[2] + 4.0]),
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
    inside = bounded_least_squares(residual, start)
    assert inside.x[0] < 1.0
    fit = bounded_least_squares(residual, start, try_bounds=True)
    assert fit.x.tolist() == [1.0, pytest.approx(0.5)]
    assert fit.cost == pytest.approx(0.25)


def test_the_most_promising_starts_are_followed_and_the_best_end_counts():
    def residual(x):  # two valleys: at 0.2, and a shallower one at 0.8
        return np.array([(x[0] - 0.2) * (x[0] - 0.8) * 5.0, 0.1 * (x[0] - 0.2)])

    starts = [np.array([v]) for v in (0.95, 0.75, 0.1, 0.5)]
    fit = bounded_least_squares(residual, starts, follow=2)
    costs = [float(residual(s) @ residual(s)) for s in starts]
    assert fit.x == pytest.approx([0.2], abs=1e-6)
    assert fit.start_cost == pytest.approx(sorted(costs)[1])
    nearest = bounded_least_squares(residual, starts, follow=1)
    assert nearest.start_cost == pytest.approx(min(costs))
    assert nearest.x == pytest.approx([0.8], abs=0.02)


def test_a_search_goes_round_where_the_simulation_breaks_down():
    residual = Counted(breaks_down=lambda x: x[1] < 0.28)
    fit = bounded_least_squares(residual, BEGIN, jacobian=exact_jacobian)
    assert fit.x == pytest.approx(PLANTED, abs=1e-5)
    residual = Counted(breaks_down=lambda x: x[0] > 0.8)
    starts = [np.array([0.9, 0.5]), np.array([0.5, 0.5])]
    fit = bounded_least_squares(residual, starts)
    assert fit.x == pytest.approx(PLANTED, abs=1e-5)
    with pytest.raises(BreakdownError, match="at all 1 starts"):
        bounded_least_squares(residual, starts[:1])
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
    def valley(x):
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    def jacobian(x, _):
        return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])

    begin, seen = [np.array([0.1, 0.9])], []

    def give_up(residual, columns):
        seen.append((residual, columns))
        return len(seen) == 3

    whole = bounded_least_squares(valley, begin, jacobian=jacobian)
    part = bounded_least_squares(valley, begin, jacobian=jacobian, give_up=give_up)
    assert (whole.converged, part.converged, len(seen)) == (True, False, 3)
    np.testing.assert_array_equal(valley(part.x), seen[-1][0])
    assert part.jacobian is seen[-1][1]
    assert whole.cost < part.cost < part.start_cost
