"""What a search of a separable fit walks down: gradient and directions of its slope."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz

from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.separable import Separable, minimise, scaled_solution
from pamsim.identification.weighted_fit import Weights, fit_separable
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.trial_noise import WHITE, TrialNoise
from tests.unit.identification.planted import coloured, record


@pytest.mark.parametrize("colour", [(), (-0.8, 0.2)])
def test_slope_gives_the_gradient_and_leaves_out_what_is_solved_for(colour):
    noise = TrialNoise((ArNoise(colour, 1.0), ArNoise(colour, 4.0)))
    records = [record(1, noise=0.1), record(2, noise=0.1)]
    problem = ContinuousStructure(2, 1, True, False, "free").problem(records)
    x = np.array([0.5, 0.2, 0.031])
    part = problem.linear_part(x, noise)
    slope = problem.jacobian(x, part)

    def cost(at):
        residual = problem.linear_part(at, noise).residual
        return float(residual @ residual)

    gradient = [(cost(x + step) - cost(x - step)) / 2e-5 for step in 1e-5 * np.eye(3)]
    np.testing.assert_allclose(2.0 * slope.T @ part.residual, gradient, rtol=1e-4)
    # A change of theta or of a trial's own coefficients cannot undo any part of it.
    first = part.blocks[0].shape[0]
    for block, rows in zip(part.blocks, (slice(0, first), slice(first, None)), strict=True):
        columns = block[:, : part.own[0].size]
        assert np.max(np.abs(columns.T @ slope[rows])) <= 1e-8 * np.linalg.norm(columns)
    shared = np.concatenate([block[:, part.own[0].size : -1] for block in part.blocks])
    assert np.max(np.abs(shared.T @ slope)) <= 1e-8 * np.linalg.norm(shared)


def test_an_input_that_acts_only_after_the_record_has_no_slope():
    late = np.append(np.zeros(99), 1.0)
    given = replace(record(1, n=100), inputs=late)
    problem = ContinuousStructure(1).problem([given])
    x = np.array([np.log(0.3)])
    slope = problem.jacobian(x, problem.linear_part(x, WHITE))
    np.testing.assert_array_equal(slope, np.zeros((100, 1)))


def test_weighted_estimates_that_simulate_much_worse_are_not_kept():
    t = np.linspace(-1.0, 1.0, 150)
    walk = np.cumsum(np.random.default_rng(166).standard_normal(t.size))
    problem = Separable(
        outputs=(walk,),
        shared=lambda x, i: np.polynomial.legendre.legvander(t, 2)[:, 1:],
        own=lambda x, i: np.ones((t.size, 1)),
        lower=np.empty(0),
        upper=np.empty(0),
        sample_times=(1.0,),
    )
    fit = fit_separable(problem, [np.empty(0)])
    # They lie within their uncertainty, which after slow noise is wide, and leave 1.57 times more.
    assert fit.disagreement > 0.01
    assert not fit.weighted
    np.testing.assert_allclose(fit.coordinates, minimise(problem, [np.empty(0)]).theta)


def test_a_linear_solution_does_not_depend_on_units():
    draw = np.random.default_rng(1)
    design, truth = draw.normal(size=(50, 4)), np.array([[1.0], [-2.0], [0.0], [3.0]])
    design[:, 2] = 0.0  # explains nothing
    units = np.array([1.0, 1e-20, 1.0, 1e20])
    found = scaled_solution(design * units, design @ truth)
    np.testing.assert_allclose(found[:, 0] * units, truth[:, 0], rtol=1e-9)


def test_intervals_of_a_plain_fit_allow_for_noise_however_slowly_it_fades():
    n = 300
    noise = coloured(np.random.default_rng(3), n, 0.97)
    column = np.sin(0.02 * np.arange(n))[:, np.newaxis]
    problem = Separable(
        outputs=(column[:, 0] + noise,),
        shared=lambda x, i: column,
        own=lambda x, i: np.ones((n, 1)),
        lower=np.empty(0),
        upper=np.empty(0),
        sample_times=(1.0,),
    )
    fit = fit_separable(problem, [np.empty(0)], Weights.EQUAL)
    weights = np.linalg.pinv(np.hstack([column, np.ones((n, 1))]))[0]
    errors = toeplitz(fit.noise.models[0].autocovariance(n)) * n / (n - 2)
    assert fit.covariance[0, 0] == pytest.approx(weights @ errors @ weights, rel=1e-6)
