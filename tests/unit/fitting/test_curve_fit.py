"""Curve fits: planted coefficients, intervals that cover, and every flag."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pamsim.fitting.coefficients import (
    Coefficient,
    best_linear,
    held_coefficients,
    linear_coefficients,
)
from pamsim.fitting.curve_fit import fit_curve, search_curve
from pamsim.inference.bounded_least_squares import latin_hypercube
from pamsim.inference.estimate import Flag
from tests.unit.core.refusals import all_refused, refused

X = np.linspace(0.0, 1.0, 25)


def free(name, low=-10.0, high=10.0):
    return Coefficient(name=name, unit="1", low=low, high=high)


DECAY = (free("a"), free("b", -20.0, 0.0), free("c"))


def decay(v):
    return v[0] * np.exp(v[1] * X) + v[2]


PLANTED = np.array([2.0, -3.5, 0.7])


def flags(fit):
    return {c.name: set(c.flags) for c in fit.coefficients}


def test_planted_coefficients_are_recovered_among_local_minima():
    fit = fit_curve(decay, decay(PLANTED), DECAY)
    assert fit.values == pytest.approx(PLANTED, rel=1e-6)
    assert fit.scores.rmse < 1e-8
    assert fit.converged
    assert flags(fit) == {"a": set(), "b": set(), "c": set()}
    assert fit_curve(decay, decay(PLANTED), DECAY).values.tolist() == fit.values.tolist()

    def curve(v):
        return v[0] * np.exp(-v[1] * X) + v[2] * np.exp(-v[3] * X)

    y = curve([1.0, 2.0, -3.0, 25.0])
    four = (free("a"), free("r", 0.0, 10.0), free("b"), free("s", 10.0, 100.0))
    assert fit_curve(curve, y, four).values == pytest.approx([1.0, 2.0, -3.0, 25.0], rel=1e-5)


def test_intervals_cover_as_often_as_stated():
    rng = np.random.default_rng(11)
    runs, hits = 80, np.zeros(3)
    for _ in range(runs):
        fit = fit_curve(decay, decay(PLANTED) + 0.05 * rng.normal(size=X.size), DECAY)
        for i, c in enumerate(fit.coefficients):
            low, high = c.interval95
            hits[i] += low <= PLANTED[i] <= high
    spread = math.sqrt(0.95 * 0.05 / runs)
    assert np.all(np.abs(hits / runs - 0.95) < 3.0 * spread), hits / runs


def test_the_interval_of_a_mean_is_students_and_none_if_the_search_did_not_converge():
    fit = fit_curve(lambda v: np.full(4, v[0]), np.array([1.0, 2.0, 4.0, 5.0]), (free("m"),))
    half = 3.182446305 * math.sqrt(10.0 / 3.0) / 2.0  # t(3, 0.975) s / sqrt(n)
    assert fit.coefficients[0].interval95 == pytest.approx((3.0 - half, 3.0 + half), rel=1e-8)
    (stopped,) = replace(fit, converged=False).coefficients
    assert (stopped.interval95, stopped.value) == (None, fit.coefficients[0].value)


def test_held_coefficients_stay_and_have_no_interval():
    fit = fit_curve(decay, decay(PLANTED), held_coefficients(DECAY, {"c": 0.5}))
    held = fit.coefficients[2]
    assert (held.value, held.interval95, held.held) == (0.5, None, True)
    assert fit.scores.free == 2
    bad = {"name": ({"aa": 1.0}, "did you mean 'a'"), "high": ({"a": 11.0}, "outside")}
    bad["nan"] = ({"a": math.nan}, "outside")
    all_refused(bad, lambda held: held_coefficients(DECAY, held))


def test_what_the_points_do_not_determine_is_flagged_and_has_no_interval():
    def dead(v):
        return v[0] * X

    fit = fit_curve(dead, 2.0 * X + 0.01 * X**2, (free("k"), free("ghost")))
    assert flags(fit) == {"k": set(), "ghost": {Flag.DEAD}}
    assert fit.coefficients[1].interval95 is None

    def flat(v):
        return v[0] * v[1] * X + v[2]

    y = 6.0 * X + 1.0 + 0.01 * np.cos(40.0 * X)
    fit = fit_curve(flat, y, (free("a", 0.1, 10.0), free("b", 0.1, 10.0), free("c")))
    assert flags(fit) == {"a": {Flag.FLAT_DIRECTION}, "b": {Flag.FLAT_DIRECTION}, "c": set()}
    assert fit.coefficients[0].partners == ("b",)
    assert fit.coefficients[0].interval95 is None
    assert fit.coefficients[2].interval95 is not None
    assert fit.values[0] * fit.values[1] == pytest.approx(6.0, rel=0.01)

    fit = fit_curve(lambda v: v[0] * X + v[1], 5.0 * X + 1.0, (free("k", 0.0, 3.0), free("c")))
    assert fit.values[0] == pytest.approx(3.0)
    assert Flag.AT_BOUND in flags(fit)["k"]
    assert fit.coefficients[0].interval95 is None
    assert fit.coefficients[1].interval95 is not None


def test_a_trade_off_names_its_partner_and_a_sign_that_is_open_is_flagged():
    far = 100.0 + X  # slope and offset of a line far from the origin

    def curve(v):
        return v[0] * far + v[1]

    y = curve([0.5, 3.0]) + 0.01 * np.cos(50.0 * X)
    fit = fit_curve(curve, y, (free("slope"), free("offset", -1e3, 1e3)))
    assert Flag.TRADE_OFF in flags(fit)["slope"]
    assert fit.coefficients[0].partners == ("offset",)
    y = 1.0 + 0.1 * np.cos(40.0 * X)
    fit = fit_curve(lambda v: v[0] + v[1] * (X - 0.5), y, (free("c"), free("k")))
    assert flags(fit) == {"c": set(), "k": {Flag.NOT_PINNED}}


def test_linear_coefficients_are_known_and_keep_to_their_bounds():
    def curve(v):  # a scale over all, two linear terms, one exponent
        return v[0] * (v[1] * np.exp(v[2] * X) + v[3] * X)

    four = (free("scale", 0.1, 5.0), free("a"), free("b", -5.0, 0.0), free("c"))
    assert linear_coefficients(curve, four, np.array([1.0, 0.0, -1.0, 0.0])) == (1, 3)
    held = held_coefficients(four, {"a": 1.0, "c": 2.0})
    assert linear_coefficients(curve, held, np.array([1.0, 1.0, -1.0, 2.0])) == (0,)

    def line(v):
        return v[0] * X + v[1]

    pair = (free("a", -1.0, 1.0), free("b"))
    full, predicted = best_linear(line, 3.0 * X + 1.0, np.zeros(2), (0, 1), pair)
    assert full == pytest.approx([1.0, 2.0], rel=1e-6)  # the offset makes up for the slope
    assert predicted == pytest.approx(full[0] * X + full[1])


def test_a_curve_is_fitted_where_it_has_a_value_and_refused_where_points_are_too_few():
    def curve(v):
        with np.errstate(invalid="ignore"):
            return np.sqrt(v[0] - X)

    fit = fit_curve(curve, np.sqrt(1.5 - X), (free("edge", 0.0, 5.0),))
    assert fit.values[0] == pytest.approx(1.5, rel=1e-6)
    pair = (free("a"), free("b"))
    bad = {
        "few": (np.zeros(2), pair, "2 points do not determine 2"),
        "nan": (np.array([1.0, np.nan, 2.0]), pair[:1], "not finite"),
        "empty": (np.zeros(5), (free("a", 1.0, 1.0),), "is empty"),
    }
    all_refused(bad, lambda y, given: search_curve(lambda v: np.full(y.size, v[0]), y, given))
    with refused("no value at 3 of 5 points"):
        fit_curve(lambda v: np.where(np.arange(5) < 3, np.nan, v[0]), np.ones(5), pair)


def test_a_latin_hypercube_has_one_point_in_every_slice():
    points = latin_hypercube(np.random.default_rng(0), 7, 3)
    assert np.sort(np.floor(7 * points), axis=0).tolist() == [[i] * 3 for i in range(7)]
    assert latin_hypercube(np.random.default_rng(0), 4, 0).shape == (4, 0)
