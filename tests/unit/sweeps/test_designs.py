"""Which runs a study makes, and sensitivities of functions whose answer is known."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from scipy.stats import kstest, norm

from pamsim.core.errors import InputError
from pamsim.sweeps import result
from pamsim.sweeps.design import Design, factor, runs_of
from pamsim.sweeps.result import rank_correlations, sobol_indices
from tests.unit.core.refusals import refused

NORMAL = {"distribution": "norm", "loc": 10.0, "scale": 0.5}
UNIT = {"low": 0, "high": 1}


def values(runs, name):
    return np.array([run[name] for run in runs])


def test_a_grid_is_every_combination_in_order_and_rows_go_together():
    factors = [factor("a", {"values": [1, 2]}), factor("b", {**UNIT, "count": 3})]
    grid = runs_of(Design.GRID, factors, 0, 0)
    assert grid == [{"a": a, "b": b} for a in (1.0, 2.0) for b in (0.0, 0.5, 1.0)]
    rigs = factor("rig", {"values": ["one", "two"]})
    rows = runs_of(Design.ROWS, [factors[0], rigs], 0, 0)
    assert rows == [{"a": 1.0, "rig": "one"}, {"a": 2.0, "rig": "two"}]


def test_draws_have_the_distribution_stated_follow_from_the_seed_and_sobol_s_are_more_even():
    factors, off = [factor("a", NORMAL), factor("b", {"low": 2, "high": 4})], {}
    for design in (Design.RANDOM, Design.SOBOL):
        runs = runs_of(design, factors, 512, 3)
        assert runs == runs_of(design, factors, 512, 3)
        assert runs != runs_of(design, factors, 512, 4)
        assert kstest(values(runs, "a"), norm(10.0, 0.5).cdf).pvalue > 0.01
        even = 2.0 + (np.arange(512) + 0.5) / 256
        off[design] = np.abs(np.sort(values(runs, "b")) - even).max()
    assert off[Design.RANDOM] < 0.2
    assert off[Design.SOBOL] < 0.3 * off[Design.RANDOM]


def test_in_a_sensitivity_design_each_further_part_changes_one_factor():
    runs = runs_of(Design.SENSITIVITY, [factor(name, UNIT) for name in "abc"], 8, 0)
    assert len(runs) == 8 * 5
    base, other = runs[:8], runs[8:16]
    for i, name in enumerate("abc"):
        part = runs[16 + 8 * i : 24 + 8 * i]
        assert part == [{**base[k], name: other[k][name]} for k in range(8)]


def test_the_fewest_and_the_most_that_a_design_takes():
    assert factor("a", {**UNIT, "count": 2}).values == (0.0, 1.0)
    assert runs_of(Design.GRID, [factor("a", {"values": [3]})], 0, 0) == [{"a": 3.0}]
    assert len(runs_of(Design.RANDOM, [factor("a", UNIT)], 1, 0)) == 1
    for most in ({"values": [1.0] * 100_000}, {**UNIT, "count": 100_000}):
        assert len(factor("a", most).values) == 100_000
    for table in ({"values": [1.0] * 100_001}, {**UNIT, "count": 100_001}):
        with refused("vary.a", "100,000"):
            factor("a", table)
    two, taken = [factor(name, UNIT) for name in "ab"], []
    for runs in range(1, 40):
        with contextlib.suppress(InputError):
            assert len(runs_of(Design.SENSITIVITY, two, runs, 0)) == 4 * runs
            taken.append(runs)
    assert taken == [2, 4, 8, 16, 32]


def test_a_factor_that_is_none_names_its_key():
    for table, message in (
        (3, "must be a table"),
        ({}, "needs values, low and high, or a distribution"),
        ({"low": 0}, "needs values, low and high, or a distribution"),
        ({"low": 2, "high": 1}, "low (2) must be below high (1)"),
        ({**UNIT, "count": 1}, "count = 1; write count = a whole number of 2 to"),
        ({"values": []}, "a list of 1 to 100,000 numbers"),
        ({"values": [1, "x"]}, "'x']; write values = a list of"),
        ({"values": [1], "seed": 2}, "unknown key seed"),
        ({"values": [1], "unit": 3}, "unit = 3; write unit = "),
        ({"distribution": "nrom"}, "no distribution 'nrom'; did you mean 'norm'"),
        ({"distribution": ["norm"]}, "no distribution ['norm']"),
        ({"distribution": "gamma"}, "gamma takes loc, scale, a"),
        ({"distribution": "norm", "scale": -1}, "scale must be above 0"),
        ({"distribution": "norm", "loc": float("nan")}, "loc = nan; write loc = a finite number"),
    ):
        with refused("vary.chamber.dead_volume", message):
            factor("chamber.dead_volume", table)
    for table, message in (
        (UNIT, "vary.rig: unknown key low"),
        ({"values": ["mas20_arm"], "unit": "kPa"}, "vary.rig: unknown key unit"),
        ({"values": []}, "names or folders of rigs"),
        ({"values": ["mas20_arm", 3]}, "names or folders of rigs"),
    ):
        with refused(message):
            factor("rig", table)


def test_a_design_that_does_not_fit_its_factors_is_refused():
    for design, tables, runs, message in (
        (Design.GRID, {}, 0, "nothing varies"),
        (Design.GRID, {"a": NORMAL}, 0, "vary.a is a distribution; design 'grid' needs listed"),
        (Design.GRID, {key: {**UNIT, "count": 400} for key in "abc"}, 0, "64,000,000 com"),
        (Design.ROWS, {"a": {"values": [1]}, "b": {"values": [1, 2]}}, 0, "here: a 1, b 2"),
        (Design.SOBOL, {"a": {"values": [1]}}, 8, "vary.a lists values; design 'sobol' draws"),
        (Design.RANDOM, {"a": NORMAL}, 0, "runs is missing or 0"),
        (Design.SOBOL, {"a": NORMAL}, 10**12, "1,000,000,000,000 runs"),
        (Design.SENSITIVITY, {"a": NORMAL, "b": NORMAL}, 2**30, "4,294,967,296 runs"),
        (Design.GRID, {"a": {"values": [1]}}, 8, "leave runs out"),
        (Design.SENSITIVITY, {"a": NORMAL, "b": NORMAL}, 100, "a power of 2"),
        (Design.SENSITIVITY, {"a": NORMAL}, 64, "only a varies"),
    ):
        with refused(message):
            runs_of(design, [factor(name, table) for name, table in tables.items()], runs, 0)


RUNS = 1024


@pytest.fixture(scope="module")
def ishigami():
    """Ishigami and Homma (1990) with a = 7, b = 0.1: an interaction, and a factor without effect
    by itself."""
    factors = [factor(name, {"low": -np.pi, "high": np.pi}) for name in "abc"]
    runs = runs_of(Design.SENSITIVITY, factors, RUNS, 1)
    x = np.array([values(runs, name) for name in "abc"])
    y = np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    return dict(zip("abc", x, strict=True)), y


def test_sobol_indices_of_ishigami_s_function(ishigami):
    _, y = ishigami
    found = sobol_indices("abc", {"y": y}, RUNS, 0)["y"]
    first, total = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)
    for name, one, all_ in zip("abc", first, total, strict=True):
        index = found[name]
        assert index.first == pytest.approx(one, abs=0.05)
        assert index.total == pytest.approx(all_, abs=0.05)
        assert index.first_interval95[0] < index.first < index.first_interval95[1]
        assert index.total_interval95[0] <= all_ + 0.05
    # c acts by its interaction with a alone.
    assert found["c"].first_interval95[1] < found["c"].total_interval95[0]
    assert found == sobol_indices("abc", {"y": y}, RUNS, 0)["y"]


def test_intervals_miss_the_shares_of_a_sum_s_terms_as_rarely_as_they_state(monkeypatch):
    """Of independent draws: with Sobol's, which are more even, they hardly ever miss."""
    monkeypatch.setattr(result, "_RESAMPLES", 60)
    weights, below, above = np.array([1.0, 2.0, 4.0]), 0, 0
    for seed in range(20):
        a, b = np.random.default_rng(seed).random((2, 64, 3))
        mixed = [np.where(np.arange(3) == i, b, a) for i in range(3)]
        y = np.concatenate([a, b, *mixed]) @ weights
        found = sobol_indices("abc", {"y": y, "milli": 1e3 * y}, 64, seed)
        for name, share in zip("abc", weights**2 / 21.0, strict=True):
            index = found["y"][name]
            assert found["milli"][name].total_interval95 == pytest.approx(index.total_interval95)
            for low, high in (index.first_interval95, index.total_interval95):
                below += share < low
                above += share > high
    assert max(below, above) < 16  # of 120, of which a fortieth on each side is due


def test_outputs_that_do_not_vary_or_are_not_complete_have_no_index(ishigami):
    factors, y = ishigami
    gaps = np.where(np.arange(y.size) == 5, np.nan, y)
    flat = np.full(y.size, 3.0) + 1e-9 * y
    outputs = {"gaps": gaps, "flat": flat, "none": np.full(y.size, np.nan)}
    assert sobol_indices("abc", outputs, RUNS, 0) == {}
    assert set(rank_correlations(factors, outputs)) == {"gaps"}


def test_a_rank_correlation_sees_any_monotonic_dependence():
    a, b = np.random.default_rng(0).random((2, 200))
    found = rank_correlations({"a": a, "b": b, "same": np.ones(200)}, {"y": np.exp(-9.0 * a)})
    assert found["y"]["a"] == pytest.approx(-1.0)
    assert abs(found["y"]["b"]) < 0.2
    assert "same" not in found["y"]
    small = rank_correlations({"a": 1e-3 * a}, {"y": 1e6 * np.exp(-9.0 * a)})
    assert small["y"]["a"] == found["y"]["a"]
    for runs, known in ((3, set()), (4, {"y"})):
        assert rank_correlations({"a": a[:runs]}, {"y": b[:runs]}).keys() == known
