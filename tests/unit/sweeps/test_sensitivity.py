"""Sensitivities of functions whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.sweeps.design import Design, runs_of
from pamsim.sweeps.factor import factor
from pamsim.sweeps.sensitivity import rank_correlations, sobol_indices

RUNS = 1024


@pytest.fixture(scope="module")
def ishigami():
    """Ishigami and Homma (1990) with a = 7, b = 0.1: an interaction, and a factor without effect
    by itself."""
    factors = [factor(name, {"low": -np.pi, "high": np.pi}) for name in "abc"]
    runs = runs_of(Design.SENSITIVITY, factors, RUNS, 1)
    x = np.array([[run[name] for name in "abc"] for run in runs]).T
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
    assert found == sobol_indices("abc", {"y": y}, RUNS, 0)["y"]


def test_outputs_that_do_not_vary_or_are_not_complete_have_no_index(ishigami):
    factors, y = ishigami
    gaps = np.where(np.arange(y.size) == 5, np.nan, y)
    flat = np.full(y.size, 3.0) + 1e-9 * y
    outputs = {"gaps": gaps, "flat": flat, "none": np.full(y.size, np.nan)}
    assert sobol_indices("abc", outputs, RUNS, 0) == {}
    assert set(rank_correlations(factors, outputs)) == {"gaps"}


def test_a_rank_correlation_sees_any_monotonic_dependence():
    rng = np.random.default_rng(0)
    a, b = rng.random(200), rng.random(200)
    found = rank_correlations({"a": a, "b": b, "same": np.ones(200)}, {"y": np.exp(-9.0 * a)})
    assert found["y"]["a"] == pytest.approx(-1.0)
    assert abs(found["y"]["b"]) < 0.2
    assert "same" not in found["y"]
