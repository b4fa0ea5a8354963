"""Errors that points of a group share: found by their agreement, allowed for in standard errors."""

import numpy as np
import pytest
import scipy.stats

from pamsim.inference.shared_errors import errors_of_groups, shared_by_group


def test_shared_residuals_are_found_by_the_f_test():
    label = np.repeat([1.0, 2.0, 3.0], 8)
    noise = np.random.default_rng(5).normal(size=24)
    expected = scipy.stats.f_oneway(noise[:8], noise[8:16], noise[16:]).pvalue
    assert shared_by_group(noise, label) == pytest.approx(expected)
    assert shared_by_group(noise + 4.0 * label, label) < 1e-4
    for residual, groups in ((noise, np.zeros(24)), (label, label), ([1.0, 2.0], [1.0, 2.0])):
        assert shared_by_group(residual, groups) == 1.0


def line(groups, each):
    """Columns of a line, the groups of its points, and (J^T J)^-1."""
    x = np.tile(np.linspace(0.0, 1.0, each), groups) + np.repeat(np.arange(groups), each)
    columns = np.column_stack([np.ones_like(x), x])
    return columns, np.repeat(np.arange(float(groups)), each), np.linalg.inv(columns.T @ columns)


def test_groups_of_one_point_have_the_errors_of_independent_points_without_bias():
    columns, _, inverse = line(1, 20)
    drawn = np.random.default_rng(0).normal(size=(800, 20))
    residuals = drawn - drawn @ columns @ inverse @ columns.T
    alone = np.arange(20.0)
    found = [errors_of_groups(columns, one, alone, inverse)[0] ** 2 for one in residuals]
    np.testing.assert_allclose(np.mean(found, axis=0), np.diag(inverse), rtol=0.08)


@pytest.mark.parametrize("groups", [6, 12])
def test_intervals_hold_where_points_of_a_group_share_an_error(groups):
    columns, label, inverse = line(groups, 5)
    rng, held = np.random.default_rng(1), []
    for _ in range(600):
        errors = rng.normal(size=label.size) + rng.normal(size=groups)[label.astype(int)]
        estimate = inverse @ columns.T @ errors  # of a line that is zero
        residual = errors - columns @ estimate
        spread, freedom = errors_of_groups(columns, residual, label, inverse)
        assert np.all(freedom < groups)
        held.append(np.abs(estimate) <= scipy.stats.t.ppf(0.975, freedom) * spread)
    assert np.mean(held) == pytest.approx(0.95, abs=0.02)
