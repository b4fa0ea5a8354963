"""Intervals cover the true value as often as stated, whatever the noise or groups of points."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from scipy.signal import lfilter

from pamsim.inference.coloured_noise import LARGEST_REFLECTION, ArNoise
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.intervals import FittedRecords, parameter_covariance
from pamsim.inference.shared_errors import errors_of_groups, shared_by_group
from pamsim.inference.simulator_fit import BlockPlace, Linearisation, ResidualBlock
from tests.unit.inference.closed_form_rigs import TIME, TRUTH, coloured, decay_rig, free, line_rig

NEAR = (free("gain", 1.9, scale="log"), free("rate", 1.6))


def test_single_trials_cover_under_coloured_noise():
    rng = np.random.default_rng(12)
    runs, hits, ratio = 100, np.zeros(2), []
    for _ in range(runs):
        rig = decay_rig([0.05 * coloured(rng, TIME.size, 0.9) for _ in "ab"], "ab")
        fit = fit_simulator(rig, NEAR, central=False)
        assert fit.status == "converged", fit.sentence
        sides = [p.interval95 for p in fit.parameters]
        hits += [low <= v <= high for (low, high), v in zip(sides, TRUTH, strict=True)]
        ratio.append([np.sqrt(p.rise95 / 3.84) for p in fit.parameters])
    share, ratio = hits / runs, np.median(ratio, axis=0)
    # Binomial(100, 0.95): 96 % of all seeds lie between 0.90 and 0.98.
    assert np.all((share >= 0.90) & (share <= 0.98)), share
    wanted = np.sqrt(1.9 / 0.1)  # width relative to that of white noise, of a slow parameter
    assert np.all((ratio > 0.7 * wanted) & (ratio < 1.3 * wanted)), ratio


def tangents(protocols, interval=0.01, size=400):
    """A linear simulator: amplitude, rate and offset of a step, one trial per protocol."""
    time = np.arange(size) / 100.0
    fading = np.exp(-3.0 * time)
    rows = [
        np.column_stack([s * (1.0 - fading), s * time * fading, np.ones(size)])
        for s in np.resize([1.0, -0.6, 1.5, 0.8], len(protocols))
    ]
    places = tuple(
        BlockPlace(
            ResidualBlock(
                trial=f"t{k}",
                protocol=protocol,
                channel="angle",
                residual=np.zeros(size),
                sample_interval=interval,
            ),
            slice(size * k, size * (k + 1)),
        )
        for k, protocol in enumerate(protocols)
    )
    return places, np.vstack(rows)


def estimated(places, rows, noise):
    """Least-squares estimate of zeros from noise alone, with its covariance."""
    estimate = np.linalg.lstsq(rows, -noise, rcond=None)[0]
    residual = noise + rows @ estimate
    weight = np.full(noise.size, 1.0 / np.std(residual))
    linear = Linearisation(places=places, residual=residual, jacobian=rows, weight=weight)
    return estimate, parameter_covariance(linear, np.eye(3), np.zeros((3, 3)))


def test_slow_noise_leaves_few_degrees_of_freedom():
    """A mean under AR(1) noise: d ln f(0) / d phi = 2 / (1 - phi), var(phi) = (1 - phi^2) / n."""
    count, phi = 20_000, 0.9
    none, gain = [np.zeros(count)], np.full((count, 1), 1.0 / count)
    mean = FittedRecords(none, [np.ones((count, 1))], [gain])
    by_hand = 2.0 * (count - 1) / (2.0 + 4.0 * (1.0 + phi) / (1.0 - phi))
    (found,) = mean.degrees_of_freedom(ArNoise((-phi,), 2.0))
    assert found == pytest.approx(by_hand, rel=0.01)
    assert mean.degrees_of_freedom(ArNoise((), 2.0)) == pytest.approx(count - 1)
    # As of the residuals of a fit that is far from its optimum.
    (stuck,) = mean.degrees_of_freedom(ArNoise((-LARGEST_REFLECTION,) * 24, 2.0))
    assert 1.0 <= stuck <= count
    # What changes from sample to sample hardly hangs on the slow part.
    quick = gain * (-1.0) ** np.arange(count)[:, None]
    (sure,) = FittedRecords(none, [0.0 * gain], [quick]).degrees_of_freedom(ArNoise((-phi,), 2.0))
    assert sure > 20.0 * found


def slow_drift(rng, count):
    return rng.standard_normal(count) + coloured(rng, count, 0.967)


def ringing(rng, count):
    e = rng.standard_normal(count + 300)
    return lfilter([1.0], [1.0, -1.94 * np.cos(0.3), 0.97**2], e)[300:]


@pytest.mark.parametrize(("noise", "trials"), [(slow_drift, "abcd"), (ringing, "ab")])
def test_noise_that_is_no_short_recursion_is_covered_too(noise, trials):
    places, rows = tangents(trials, size=800)
    rng = np.random.default_rng(4)
    runs, hits = 50, np.zeros(3)
    for _ in range(runs):
        e = np.concatenate([noise(rng, 800) for _ in trials])
        estimate, found = estimated(places, rows, e)
        hits += np.abs(estimate) <= found.quantile * np.sqrt(np.diag(found.matrix))
    # Binomial(50, 0.95): 96 % of all seeds give 0.9 or more.
    assert np.all(hits / runs >= 0.89), hits / runs


def test_repeats_show_what_differs_from_trial_to_trial():
    """From three degrees of freedom on, as clusters; as single trials they do not cover."""
    places, rows = tangents("aabbcc")
    alone = tuple(
        dataclasses.replace(p, block=dataclasses.replace(p.block, protocol=p.block.trial))
        for p in places
    )
    rng = np.random.default_rng(6)
    runs, clustered, single = 40, np.zeros(3), np.zeros(3)
    for _ in range(runs):
        moved = np.repeat(0.3 * rng.standard_normal((len(places), 3)), 400, axis=0)
        e = rng.standard_normal(len(rows)) + (rows * moved).sum(axis=1)
        for hits, as_given in ((clustered, places), (single, alone)):
            estimate, found = estimated(as_given, rows, e)
            hits += np.abs(estimate) <= found.quantile * np.sqrt(np.diag(found.matrix))
    # Of two protocols 91 % are covered: Binomial(40, 0.91) is 0.83 or more for 94 % of all seeds.
    assert np.all(clustered / runs >= 0.83), clustered / runs
    assert np.min(single) <= np.min(clustered) - 0.05 * runs, (single / runs, clustered / runs)


def test_the_covariance_of_a_known_noise_is_the_sandwich():
    places, rows = tangents("abcd")
    found = np.zeros((3, 3))
    rng = np.random.default_rng(9)
    for _ in range(24):
        e = np.concatenate([coloured(rng, 400, 0.8) for _ in range(4)])
        found += estimated(places, rows, e)[1].matrix / 24
    lag = np.abs(np.subtract.outer(np.arange(1600), np.arange(1600)))
    same = np.equal.outer(np.arange(1600) // 400, np.arange(1600) // 400)
    inverse = np.linalg.inv(rows.T @ rows)
    exact = inverse @ rows.T @ (same * 0.8**lag) @ rows @ inverse
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(exact)), rel=0.1)


def test_repeats_give_the_scatter_of_their_scores_with_students_quantile():
    places, rows = tangents("aaaa")
    e = np.random.default_rng(1).standard_normal(1600)
    estimate, found = estimated(places, rows, e)
    inverse = np.linalg.inv(rows.T @ rows)
    residual = e + rows @ estimate
    pulls = np.array([inverse @ rows[p.rows].T @ residual[p.rows] for p in places])
    assert found.matrix == pytest.approx(4.0 * np.cov(pulls.T), rel=1e-9)
    assert found.quantile == pytest.approx(np.full(3, 3.182446305), rel=1e-6)  # t(3, 0.975)
    pair = tangents("aaaabbbb")
    both = estimated(*pair, np.random.default_rng(2).standard_normal(3200))[1]
    assert np.all((both.quantile > 2.447) & (both.quantile < 3.182))  # t(6) to t(3)


def test_rows_without_order_have_the_classical_interval():
    rng = np.random.default_rng(8)
    rows = rng.standard_normal((50, 2))
    measured = rows @ [1.0, 2.0] + 0.3 * rng.standard_normal(50)
    fit = fit_simulator(line_rig(rows, measured, noise_sd=None), (free("a"), free("b")))
    variance = np.sum(fit.linearisation.residual**2) / 48
    classical = np.sqrt(variance * np.diag(np.linalg.inv(rows.T @ rows)))
    assert [p.standard_error for p in fit.parameters] == pytest.approx(classical, rel=0.02)
    half = 2.010635 * classical  # t(48, 0.975)
    found = [0.5 * (p.interval95[1] - p.interval95[0]) for p in fit.parameters]
    assert found == pytest.approx(half, rel=0.02)


def test_intervals_are_symmetric_in_the_logarithm_and_end_at_the_bounds():
    rig = decay_rig(0.02 * np.random.default_rng(0).standard_normal((3, TIME.size)))
    gain = fit_simulator(rig, NEAR).parameters[0]
    assert np.sqrt(np.prod(gain.interval95)) == pytest.approx(gain.value, rel=1e-9)
    rows = np.ones((4, 1))
    wide = fit_simulator(line_rig(rows, [0.1, 3.0, 0.2, 0.3], noise_sd=None), (free("m"),))
    assert wide.parameters[0].interval95[0] == 0.1


def test_colour_absorbed_by_a_fit_is_given_back():
    places, rows = tangents("ab", size=300)
    rng = np.random.default_rng(6)
    plain, corrected = [], []
    for _ in range(30):
        e = np.concatenate([coloured(rng, 300, 0.95) for _ in range(2)])
        estimate = np.linalg.lstsq(rows, -e, rcond=None)[0]
        gain = rows @ np.linalg.inv(rows.T @ rows)
        residual = e + rows @ estimate
        own, columns, gains = ([x[p.rows] for p in places] for x in (residual, rows, gain))
        true = ArNoise((-0.95,), 1.0 - 0.95**2)
        lag = np.abs(np.subtract.outer(np.arange(300), np.arange(300)))
        known = sum(g.T @ 0.95**lag @ g for g in gains)
        none = [np.zeros_like(c) for c in columns]
        for found, jacobians in ((corrected, columns), (plain, none)):
            noise, _ = FittedRecords(own, jacobians, gains).colours(true, known)
            found.append(noise.autocovariance(20)[[0, 19]])
    truth = np.array([1.0, 0.95**19])
    assert np.mean(corrected, axis=0) == pytest.approx(truth, rel=0.15)
    assert np.all(np.mean(plain, axis=0) < 0.9 * truth)


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
