"""Models are recommended for what they explain beyond chance, not for their parameters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.identification.choice import recommend
from pamsim.identification.models import Candidate
from pamsim.identification.structure_choice import p_value_of_improvement
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.identified_model import FitStatus
from pamsim.linear.signal_record import SignalRecord

TS = 0.02


def plant(constants, seed, noise=0.05, n=600):
    """A chain of lags driven by a random telegraph, with noise of 0.1 s correlation time."""
    draw = np.random.default_rng(seed)
    u = np.repeat(draw.choice([0.0, 1.0], n // 20 + 1), 20)[:n]
    u[0] = 0.0
    y = np.repeat(u, 10)
    for constant in constants:
        pole = np.exp(-TS / 10 / constant)
        y = lfilter([0.0, 1.0 - pole], [1.0, -pole], y)
    coloured = lfilter([np.sqrt(1 - 0.8**2)], [1.0, -0.8], draw.normal(size=n + 100))[100:]
    return SignalRecord(
        name=f"trial {seed}", time=np.arange(n) * TS, inputs=u, output=y[::10] + noise * coloured
    )


def candidates(records, held_out=()):
    fits = {
        "first_order": fit_continuous(records, order=1, held_out=held_out),
        "second_order": fit_continuous(records, order=2, held_out=held_out),
    }
    return [Candidate(name=name, fit=fit, independence=None) for name, fit in fits.items()]


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize(
    ("constants", "expected"), [((0.5,), "first_order"), ((0.15, 0.5), "second_order")]
)
def test_the_order_of_the_plant_is_recommended(constants, expected, hold):
    records = [plant(constants, seed) for seed in (1, 2)]
    held = [plant(constants, seed) for seed in (3, 4)] if hold else []
    recommendation = recommend(candidates(records, held), records, held)
    assert recommendation.name == expected, recommendation.reason
    assert ("held-out" in recommendation.reason) is hold or "only model" in recommendation.reason
    assert min(recommendation.aicc.values()) == 0.0


def test_a_parameter_that_is_not_there_is_seldom_accepted():
    accepted = []
    for seed in range(8):
        records, held = [plant((0.5,), seed, n=250)], [plant((0.5,), 100 + seed, n=250)]
        fits = {
            "plain": fit_continuous(records, order=1, held_out=held),
            "delayed": fit_continuous(records, order=1, dead_time=True, held_out=held),
        }
        given = [Candidate(name=n, fit=f, independence=None) for n, f in fits.items()]
        accepted.append(recommend(given, records, held).name == "delayed")
    assert sum(accepted) <= 1


def test_correlated_residuals_are_worth_fewer_samples():
    records = [plant((0.15, 0.5), seed) for seed in (1, 2)]
    recommendation = recommend(candidates(records), records, [])
    # Noise correlated by 0.8 from sample to sample: (1 - 0.8) / (1 + 0.8) of them count.
    assert recommendation.effective_samples == pytest.approx(1200 * 0.2 / 1.8, rel=0.35)


def test_no_model_is_recommended_when_none_can_be_trusted():
    records = [plant((0.5,), 1)]
    second = candidates(records)[1]
    assert second.fit.status is not FitStatus.CONVERGED
    recommendation = recommend([second], records, [])
    assert recommendation.name == ""
    assert second.fit.sentence in recommendation.reason


def coloured(draw, n):
    return lfilter([1.0], [1.0, -0.9], draw.normal(size=n + 200))[200:]


def test_slow_errors_at_two_rates_are_no_more_often_taken_for_a_difference():
    p_values = []
    for seed in range(200):
        draw = np.random.default_rng(seed)
        # Of one correlation time: sampled fifty times as slowly it is white.
        first, second = ([coloured(draw, 600), draw.normal(size=600)] for _ in range(2))
        p_values.append(p_value_of_improvement(first, second, [0.01, 0.5]))
    assert np.mean(np.array(p_values) < 0.05) == pytest.approx(0.05, abs=0.04)


def test_a_smaller_error_is_seen_and_an_equal_one_is_not():
    draw = np.random.default_rng(0)
    small = [coloured(draw, 800)]
    assert p_value_of_improvement([1.5 * small[0]], small, [0.01]) < 0.01
    assert p_value_of_improvement(small, [1.5 * small[0]], [0.01]) > 0.99
    assert p_value_of_improvement(small, small, [0.01]) == 1.0
