"""Output-error fits: planted models, bounds, degenerate data, interval coverage, bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pamsim.core.errors import InputError
from pamsim.linear.first_second_order import first_order_step, second_order_step
from pamsim.linear.fit_percent import fit_percent
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.response_bands import step_response_band
from pamsim.linear.step_identification import fit_step

TIME = np.arange(1001) / 200.0


@settings(max_examples=15, deadline=None)
@given(t=st.floats(0.02, 2.0))
def test_planted_first_order_is_recovered(t: float) -> None:
    fit = fit_step(TIME, first_order_step(TIME, t), order=1)
    assert fit.status is FitStatus.CONVERGED
    assert fit.time_constants[0] == pytest.approx(t, rel=1e-6)
    assert fit.fit_percent == pytest.approx(100.0, abs=1e-5)


@settings(max_examples=15, deadline=None)
@given(ratio=st.sampled_from([0.05, 0.16, 0.5, 0.8]), slow=st.floats(0.3, 0.9))
def test_planted_second_order_is_recovered(ratio: float, slow: float) -> None:
    fit = fit_step(TIME, second_order_step(TIME, ratio * slow, slow), order=2)
    assert fit.status is FitStatus.CONVERGED
    assert fit.time_constants == pytest.approx((ratio * slow, slow), rel=1e-6)
    assert (fit.gain, fit["K"].interval95) == (1.0, None)


def test_the_printed_g2_is_recovered_and_its_step_is_the_response() -> None:
    y = second_order_step(TIME, 0.090314, 0.57873)
    fit = fit_step(TIME, y, order=2)
    assert fit.time_constants == pytest.approx((0.090314, 0.57873), rel=1e-6)
    np.testing.assert_allclose(step_response_band(fit, TIME).output, y, atol=1e-6)
    assert np.array_equal(fit_step(TIME, y, order=2).coordinates, fit.coordinates)


def test_a_search_that_did_not_converge_states_no_interval() -> None:
    rng = np.random.default_rng(1)
    y = first_order_step(TIME, 0.3, 1.0) + 0.01 * rng.normal(size=TIME.size)
    fit = fit_step(TIME, y, order=1)
    assert fit["T"].interval95 is not None
    stopped = replace(fit, status=FitStatus.NOT_CONVERGED)
    assert all(estimate.interval95 is None for estimate in stopped.estimates)


def test_origin_of_time_does_not_matter_and_time_may_be_uneven() -> None:
    t = np.sort(np.random.default_rng(21).uniform(0.0, 5.0, 400))
    t[0] = 0.0
    fit = fit_step(t + 100.0, first_order_step(t, 0.5), order=1)
    assert fit.time_constants[0] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_intervals_cover_the_truth_under_white_noise(order: int) -> None:
    truth = (0.58,) if order == 1 else (0.12, 0.58)
    clean = first_order_step(TIME, 0.58) if order == 1 else second_order_step(TIME, *truth)
    rng = np.random.default_rng(22)
    runs, hits = 120, np.zeros(order)
    for _ in range(runs):
        fit = fit_step(TIME, clean + 0.02 * rng.standard_normal(TIME.size), order=order)
        assert fit.status is FitStatus.CONVERGED
        sides = fit.interval95_time_constants
        hits += [low <= true <= high for (low, high), true in zip(sides, truth, strict=True)]
    # Binomial(120, 0.95): 99.9 % of all seeds give 105 to 120 hits. Too wide is as wrong as too
    # narrow, hence the upper end: 120 of 120 has chance 0.2 %.
    assert np.all(hits >= 105)
    assert np.all(hits <= 119)


def test_interval_width_is_that_of_the_scatter() -> None:
    rng = np.random.default_rng(23)
    clean = second_order_step(TIME, 0.12, 0.58)
    fitted, widths = [], []
    for _ in range(80):
        fit = fit_step(TIME, clean + 0.02 * rng.standard_normal(TIME.size), order=2)
        low, high = fit.interval95_time_constants[0]
        fitted.append(fit.time_constants[0])
        widths.append(high - low)
    assert np.mean(widths) == pytest.approx(2.0 * 1.96 * np.std(fitted), rel=0.25)


def test_white_residuals_look_white() -> None:
    noise = 0.05 * np.random.default_rng(24).standard_normal(TIME.size)
    (score,) = fit_step(TIME, second_order_step(TIME, 0.1, 0.5) + noise, order=2).trials
    assert score.rms == pytest.approx(0.05, rel=0.1)
    assert abs(score.residual_lag1) < 0.15


def test_wrong_order_says_that_residuals_are_correlated() -> None:
    fit = fit_step(TIME, second_order_step(TIME, 0.2, 0.5), order=1)
    assert fit.status is FitStatus.CONVERGED
    assert fit.trials[0].residual_lag1 > 0.9
    assert "too narrow" in fit.sentence


def test_scores_are_those_of_the_simulated_response() -> None:
    y = second_order_step(TIME, 0.2, 0.5)
    fit = fit_step(TIME, y, order=1)
    run = step_response_band(fit, TIME).output
    assert fit.fit_percent == pytest.approx(fit_percent(y, run), abs=1e-9)
    assert fit.trials[0].rms == pytest.approx(np.sqrt(np.mean((y - run) ** 2)), rel=1e-9)


def oscillation() -> np.ndarray:
    w, zeta = 6.0, 0.4
    damped = w * np.sqrt(1.0 - zeta**2)
    ring = np.cos(damped * TIME) + zeta * w / damped * np.sin(damped * TIME)
    return 1.0 - np.exp(-zeta * w * TIME) * ring


@pytest.mark.parametrize(
    ("response", "order", "status"),
    [
        (oscillation(), 2, FitStatus.DEGENERATE),
        (second_order_step(TIME, 0.3, 0.3), 2, FitStatus.DEGENERATE),
        (first_order_step(TIME, 0.6), 2, FitStatus.AT_BOUND),
        (-first_order_step(TIME, 0.6), 1, FitStatus.AT_BOUND),
    ],
    ids=["oscillation", "double_lag", "one_lag", "wrong_sign"],
)
def test_data_that_hold_no_such_model_do_not_converge_silently(
    response: np.ndarray, order: int, status: FitStatus
) -> None:
    fit = fit_step(TIME, response, order=order)
    assert fit.status is status
    assert fit.interval95_time_constants == (None,) * order
    assert len(fit.time_constants) == order


def test_noisy_double_lag_is_degenerate_but_a_wide_pair_is_not() -> None:
    rng = np.random.default_rng(25)
    caught = dict.fromkeys((0.29, 0.1), 0)
    for first in caught:
        for _ in range(30):
            y = second_order_step(TIME, first, 0.31) + 0.02 * rng.standard_normal(TIME.size)
            caught[first] += fit_step(TIME, y, order=2).status is FitStatus.DEGENERATE
    assert caught[0.29] >= 25  # the rule is two standard deviations of log(T2/T1)^2
    assert caught[0.1] == 0


def test_lag_below_one_sample_is_not_resolved() -> None:
    fit = fit_step(TIME, second_order_step(TIME, 0.002, 0.5), order=2)
    assert fit.status is FitStatus.DEGENERATE
    assert "shorter than one sample" in fit.sentence


def test_bad_input_is_refused_in_one_line() -> None:
    y = first_order_step(TIME, 0.5)
    cases: list[tuple[str, dict[str, object]]] = [
        ("order", {"order": 3}),
        ("too short", {"time": TIME[:7], "response": y[:7]}),
        ("one time per sample", {"response": y[:-1]}),
        ("constant", {"response": np.full(TIME.size, 2.0)}),
        ("index 3", {"response": np.where(np.arange(TIME.size) == 3, np.inf, y)}),
        ("does not increase", {"time": np.minimum(TIME, 4.0)}),
        ("ends where it began", {"response": np.where(TIME < 4.0, y, 0.0)}),
        ("(n,)", {"response": np.stack([y, y])}),
        ("not numbers", {"response": ["a"] * TIME.size}),
    ]
    for match, change in cases:
        arguments: dict[str, object] = {"time": TIME, "response": y, "order": 1, **change}
        with pytest.raises(InputError) as caught:
            fit_step(**arguments)
        assert match in str(caught.value)
        assert "\n" not in str(caught.value)
