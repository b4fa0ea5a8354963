"""Fit percent: its two fixed points, its scale, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.linear.fit_percent import fit_percent
from tests.unit.linear.planted import refuses

Y = np.random.default_rng(11).standard_normal(200) + 5.0


def test_identical_is_100_and_the_mean_is_0() -> None:
    assert fit_percent(Y, Y) == 100.0
    assert fit_percent(Y, np.full(200, Y.mean())) == pytest.approx(0.0, abs=1e-12)


def test_half_the_deviation_is_50_in_any_unit() -> None:
    half = Y.mean() + 0.5 * (Y - Y.mean())
    assert fit_percent(Y, half) == pytest.approx(50.0)
    assert fit_percent(1e3 * Y - 7.0, 1e3 * half - 7.0) == pytest.approx(50.0)
    assert fit_percent(Y, Y.mean() - 2.0 * (Y - Y.mean())) == pytest.approx(-200.0)


def test_exploded_simulation_is_minus_infinity() -> None:
    assert fit_percent(Y, np.where(Y > 5.0, np.inf, Y)) == float("-inf")
    assert fit_percent(Y, np.full(200, 1e300)) == float("-inf")


def test_bad_series_are_refused() -> None:
    refuses("constant", fit_percent, np.ones(5), np.ones(5))
    refuses("one length", fit_percent, Y, Y[:-1])
    refuses("not finite", fit_percent, np.append(Y, np.nan), np.append(Y, 0.0))
    refuses("one length", fit_percent, [], [])
