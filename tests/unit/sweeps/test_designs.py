"""Factors and designs: which runs a study makes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm

from pamsim.core.errors import InputError
from pamsim.sweeps.design import Design, runs_of
from pamsim.sweeps.factor import factor

NORMAL = {"distribution": "norm", "loc": 10.0, "scale": 0.5}


def values(runs, name):
    return np.array([run[name] for run in runs])


def test_a_grid_is_every_combination_in_order_and_rows_go_together():
    factors = [factor("a", {"values": [1, 2]}), factor("b", {"low": 0, "high": 1, "count": 3})]
    grid = runs_of(Design.GRID, factors, 0, 0)
    assert grid == [{"a": a, "b": b} for a in (1.0, 2.0) for b in (0.0, 0.5, 1.0)]
    rows = runs_of(Design.ROWS, [factor("a", {"values": [1, 2]}), factor("rig", RIGS)], 0, 0)
    assert rows == [{"a": 1.0, "rig": "one"}, {"a": 2.0, "rig": "two"}]


RIGS = {"values": ["one", "two"]}


@pytest.mark.parametrize("design", [Design.RANDOM, Design.SOBOL])
def test_draws_have_the_distribution_stated_and_follow_from_the_seed(design):
    factors = [factor("a", NORMAL), factor("b", {"low": 2, "high": 4})]
    runs = runs_of(design, factors, 500, 3)
    assert runs == runs_of(design, factors, 500, 3)
    assert runs != runs_of(design, factors, 500, 4)
    assert kstest(values(runs, "a"), norm(10.0, 0.5).cdf).pvalue > 0.01
    assert 2.0 <= values(runs, "b").min() < 2.1
    assert 3.9 < values(runs, "b").max() <= 4.0


def test_sobol_fills_more_evenly_than_random_draws():
    factors = [factor("a", {"low": 0, "high": 1})]
    off = {
        design: np.abs(
            np.sort(values(runs_of(design, factors, 256, 0), "a")) - (np.arange(256) + 0.5) / 256
        ).max()
        for design in (Design.RANDOM, Design.SOBOL)
    }
    assert off[Design.SOBOL] < 0.3 * off[Design.RANDOM]


def test_in_a_sensitivity_design_each_further_part_changes_one_factor():
    factors = [factor(name, {"low": 0, "high": 1}) for name in "abc"]
    runs = runs_of(Design.SENSITIVITY, factors, 8, 0)
    assert len(runs) == 8 * 5
    base, other = runs[:8], runs[8:16]
    for i, name in enumerate("abc"):
        part = runs[16 + 8 * i : 24 + 8 * i]
        for k in range(8):
            assert part[k] == {**base[k], name: other[k][name]}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (3, "must be a table"),
        ({}, "needs values, low and high, or a distribution"),
        ({"low": 0}, "needs values, low and high, or a distribution"),
        ({"low": 2, "high": 1}, r"low \(2\) must be below high \(1\)"),
        ({"low": 0, "high": 1, "count": 1}, "count is 1; it must be a whole number of 2 to"),
        ({"values": []}, "a list of 1 to 100,000 values"),
        ({"values": [1, "x"]}, "'x'; it must be a number"),
        ({"values": [1], "seed": 2}, "seed cannot be used there"),
        ({"values": [1], "unit": 3}, "unit must be text"),
        ({"distribution": "nrom"}, "no distribution 'nrom'; did you mean 'norm'"),
        ({"distribution": "gamma"}, "gamma takes loc, scale, a"),
        ({"distribution": "norm", "scale": -1}, "scale must be above 0"),
        ({"distribution": "norm", "loc": float("nan")}, "it must be a number"),
    ],
)
def test_a_factor_that_is_none_names_its_key(table, message):
    with pytest.raises(InputError, match=message) as error:
        factor("chamber.dead_volume", table)
    assert "vary.chamber.dead_volume" in str(error.value)


@pytest.mark.parametrize(
    ("design", "tables", "runs", "message"),
    [
        (Design.GRID, {}, 0, "nothing varies"),
        (Design.GRID, {"a": NORMAL}, 0, "vary.a is a distribution; design 'grid' needs listed"),
        (Design.GRID, {k: {"low": 0, "high": 1, "count": 400} for k in "abc"}, 0, "64,000,000 com"),
        (Design.ROWS, {"a": {"values": [1]}, "b": {"values": [1, 2]}}, 0, "here: a 1, b 2"),
        (Design.SOBOL, {"a": {"values": [1]}}, 8, "vary.a lists values; design 'sobol' draws"),
        (Design.RANDOM, {"a": NORMAL}, 0, "runs is 0"),
        (Design.SENSITIVITY, {"a": NORMAL}, 100, "a power of 2"),
    ],
)
def test_a_design_that_does_not_fit_its_factors_is_refused(design, tables, runs, message):
    factors = [factor(name, table) for name, table in tables.items()]
    with pytest.raises(InputError, match=message):
        runs_of(design, factors, runs, 0)
