"""Compiled loops of an autoregressive model: as scipy's filter and as Burg's formulas."""

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.core.units import FloatArray
from pamsim.inference.autoregression import burg_reflections, filtered

LIMIT = 0.9999


@pytest.mark.parametrize("shape", [(3,), (2500,), (2048, 3), (1025, 1)])
def test_a_filter_is_that_of_scipy(shape):
    rng = np.random.default_rng(1)
    predictor, values = rng.standard_normal(31), rng.standard_normal(shape)
    found = filtered(predictor, values)
    np.testing.assert_allclose(found, lfilter(predictor, [1.0], values, axis=0), atol=1e-12)
    np.testing.assert_array_equal(filtered(predictor, np.asfortranarray(values)), found)


def coloured(rng, size) -> FloatArray:
    return np.asarray(lfilter([1.0], [1.0, -1.2, 0.5], rng.standard_normal(size)))


def burg(rows, most):
    """The recursion as it is printed: errors ahead and behind, each order a sample shorter."""
    forward = backward = rows
    found = []
    for _ in range(most):
        pairs = [(f[1:], b[:-1]) for f, b in zip(forward, backward, strict=True)]
        cross = sum(f @ b for f, b in pairs)
        found.append(-2.0 * cross / sum(f @ f + b @ b for f, b in pairs))
        forward = [f + found[-1] * b for f, b in pairs]
        backward = [b + found[-1] * f for f, b in pairs]
    return found


def test_reflections_are_those_of_the_recursion_over_all_rows():
    rng = np.random.default_rng(2)
    sizes = (3000, 31, 1025, 1024, 400)
    rows = [coloured(rng, size) for size in sizes]
    kept = [row.copy() for row in rows]
    np.testing.assert_allclose(burg_reflections(rows, 30, LIMIT), burg(rows, 30), rtol=1e-9)
    np.testing.assert_array_equal(np.concatenate(rows), np.concatenate(kept))


def test_a_reflection_is_limited_and_nothing_has_none():
    assert burg_reflections([np.ones(40)], 1, LIMIT) == [-LIMIT]
    assert burg_reflections([np.zeros(40)], 5, LIMIT) == []
    assert burg_reflections([np.ones(40)], 0, LIMIT) == []
