"""Bouc-Wen hysteresis where it has a closed form, and what holds for all of its shapes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamsim.physics.hysteresis.bouc_wen import BoucWen, bouc_wen_rate, bouc_wen_rates

TRAVEL = 0.005


def test_rates_of_a_virgin_curve_at_its_end_and_when_it_unloads():
    """(1 - z^n) / D from rest to saturation; 2 sigma / D when a saturated loop turns back."""
    for sigma in (0.5, 1.0, 10.0):
        for sharpness in (1.0, 3.0, 20.0):
            shape = (TRAVEL, sigma, sharpness)
            for z in (0.0, 0.3, 0.8, 1.0):
                loading = (1.0 - z**sharpness) / TRAVEL
                assert bouc_wen_rate(z, 1.0, *shape) == pytest.approx(loading, abs=1e-9)
            assert bouc_wen_rate(1.0, -1.0, *shape) == pytest.approx(-2.0 * sigma / TRAVEL)
            for z in np.linspace(-1.0, 1.0, 21).tolist():
                unloading = bouc_wen_rate(z, -1.0 if z > 0.0 else 1.0, TRAVEL, 0.5, sharpness)
                assert abs(unloading) == pytest.approx(1.0 / TRAVEL, rel=1e-14)


def test_the_operator_hands_its_fields_on_by_their_meaning_and_nan_is_passed_on():
    group = BoucWen(yield_contraction=0.02, sigma=1.5, sharpness=3.0)
    rates = [0.0]
    for z, rate in ((0.4, 0.3), (0.4, -0.3)):
        bouc_wen_rates(group, [z], rates, 0.1, rate, 1e-3)
        named = {"yield_travel": 0.02, "sigma": 1.5, "sharpness": 3.0}
        assert rates == [bouc_wen_rate(z, rate, **named)]
    assert math.isnan(bouc_wen_rate(math.nan, 1.0, TRAVEL, 0.5, 1.0))
    assert math.isnan(bouc_wen_rate(0.1, math.nan, TRAVEL, 0.5, 1.0))


SHAPES = st.tuples(st.floats(1e-3, 0.5), st.floats(0.5, 10.0), st.floats(1.0, 20.0))
"""Yield travel D, sigma, sharpness n, over the whole range that the parameters allow."""
LEVELS = st.floats(-1.0, 1.0, allow_subnormal=False)


@given(SHAPES, LEVELS, st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.lists(LEVELS, max_size=60))
def test_any_shape_is_passive_odd_and_a_function_of_the_path_and_stays_inside_one(
    shape, z, velocity, factor, steps
):
    """Passive with the storage D z^2 / 2: z dx >= D z dz at every state, hence on every path.

    The rate grows in proportion to the speed, so that z depends on the path alone.
    """
    rate = bouc_wen_rate(z, velocity, *shape)
    assert z * velocity - shape[0] * z * rate >= -1e-12 * abs(velocity)
    assert bouc_wen_rate(-z, -velocity, *shape) == -rate
    fast = bouc_wen_rate(z, factor * velocity, *shape)
    assert fast == pytest.approx(factor * rate, rel=1e-12, abs=1e-300)
    assert bouc_wen_rate(z, 0.0, *shape) == 0.0
    # Explicit Euler as the engine takes it: no step beyond D/n and D/sigma leaves [-1, 1].
    largest = shape[0] * min(1.0 / shape[2], 1.0 / shape[1])
    for step in steps:
        z += bouc_wen_rate(z, step * largest, *shape)
        assert abs(z) <= 1.0 + 1e-12
