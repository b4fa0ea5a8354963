"""A linear plant's structure by likelihood, others' by free runs; what the records do not show."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.identification.choice import recommend
from pamsim.identification.models import ModelSet, fit_models
from pamsim.identification.structure_choice import choice_by_free_run
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.residual_tests import residual_nonlinearity
from pamsim.linear.signal_record import SignalRecord
from pamsim.linear.structure_scan import rough_fit
from tests.unit.linear.planted import coloured, sampled, steps

TS = 0.05


def trial(numerator, denominator, seed, *, n=600, noise=0.03, bend=0.0, slow=0.0, drift=0.0):
    draw = np.random.default_rng(seed)
    given = steps(draw, n + 100, 10)
    output = sampled(numerator, denominator, given, TS)
    output = output + bend * output**2
    white = draw.normal(size=output.size)
    disturbance = noise * np.std(output) * (coloured(draw, output.size, slow) if slow else white)
    output = output + disturbance + drift * np.arange(-100, n) / (n - 1)
    return SignalRecord(f"trial {seed}", TS * np.arange(n), given[100:], output[100:])


def identified(record):
    fitted = fit_models([record], [], ModelSet(start="free"))
    chosen = recommend(fitted.candidates, [record], [], chosen=fitted.chosen, why=fitted.why)
    best = next(c.fit for c in fitted.candidates if c.name == chosen.best)
    return fitted, chosen, best


PLANTS = {
    "one lag": ([2.0], [0.4, 1.0]),
    "oscillation": ([2.0], [1.0 / 16.0, 0.4 / 4.0, 1.0]),
    "lag and integrator": ([0.8], [0.3, 1.0, 0.0]),
    "three poles, one zero": ([1.0, 2.0], np.convolve([1.0 / 25.0, 0.2 / 5.0, 1.0], [1.0, 1.0])),
}


@pytest.mark.parametrize("name", PLANTS)
def test_poles_of_the_plant_are_chosen_and_leave_nothing_to_explain(name):
    numerator, denominator = PLANTS[name]
    fitted, chosen, best = identified(trial(numerator, denominator, 1))
    assert chosen.name == chosen.best == fitted.chosen
    assert "the Hannan-Quinn criterion" in chosen.reason
    expected = np.sort(np.abs(np.roots(denominator)))
    assert np.sort(np.abs(best.poles)) == pytest.approx(expected, rel=0.1, abs=1e-12)


def test_a_bent_plant_is_said_to_be_nonlinear_and_not_recommended():
    record = trial([2.0], [0.4, 1.0], 2, bend=0.1)
    _, chosen, best = identified(record)
    assert chosen.name == ""
    assert chosen.best != ""
    assert "the plant is not linear" in chosen.missing
    assert "the last third of each trial" in chosen.reason
    assert residual_nonlinearity(best, [record]).p_value < 1e-4


@pytest.mark.slow
def test_a_linear_plant_is_seldom_taken_for_a_bent_one():
    p_values: list[float] = []
    for seed in range(40):
        record = trial([2.0], [0.4, 1.0], 100 + seed, n=200)
        fitted = fit_models([record], [], ModelSet(start="free", order=1, dead_time="none"))
        p_values.append(residual_nonlinearity(fitted.candidates[0].fit, [record]).p_value)
    assert np.mean(np.array(p_values) < 0.05) < 0.2
    assert 0.3 < np.mean(p_values) < 0.7


def test_a_step_response_shows_one_pole():
    draw = np.random.default_rng(7)
    given = np.append(np.zeros(10), np.ones(390))
    output = sampled([2.0], [0.4, 1.0], given, TS) + 0.01 * draw.normal(size=400)
    record = SignalRecord("step", TS * np.arange(400), given, output)
    best = identified(record)[2]
    assert best.structure.order == 1
    assert not best.structure.drift


def test_a_bent_plant_whose_record_rests_at_its_end_is_judged_by_aicc():
    draw = np.random.default_rng(7)
    given = np.concatenate([steps(draw, 300, 10), np.zeros(200)])
    output = sampled([2.0], [0.4, 1.0], given, TS)
    output = output + 0.3 * output**2 + 0.01 * draw.normal(size=500)
    record = SignalRecord("rests", TS * np.arange(500), given, output)
    assert "the best by AICc" in identified(record)[1].reason


def test_the_drift_of_an_output_is_estimated_instead_of_taken_for_poles():
    record = trial([2.0], [0.4, 1.0], 4, drift=0.5)
    _, chosen, best = identified(record)
    assert chosen.name == "first_order_drift"
    assert best["T"].value == pytest.approx(0.4, rel=0.05)
    assert best.trials[0].drift == pytest.approx(0.5, abs=0.1)
    assert chosen.reason.startswith("1 pole, drift: the best by the Hannan-Quinn criterion")


@pytest.mark.slow
def test_slow_noise_is_not_taken_for_poles():
    right = 0
    for seed in range(6):
        best = identified(trial([2.0], [0.4, 1.0], 20 + seed, noise=0.05, slow=0.85))[2]
        right += best.structure.order + best.structure.integrators == 1
    assert right >= 5


def test_held_out_trials_judge_a_linear_plant_too():
    fitted, held_out = (trial([2.0], [0.4, 1.0], seed) for seed in (5, 6))
    models = fit_models([fitted], [held_out], ModelSet(start="free"))
    assert models.choice.judged_by == "the held-out trials"


def test_a_dead_time_is_chosen_where_it_is_asked_for_and_not_where_it_is_ruled_out():
    draw = np.random.default_rng(9)
    given = steps(draw, 700, 10)
    output = sampled([2.0], [0.4, 1.0], given, TS, delay=0.4)
    output = output + 0.02 * np.std(output) * draw.normal(size=output.size)
    record = SignalRecord("late", TS * np.arange(600), given[100:], output[100:])
    for dead_time, expected in (("free", True), ("none", False)):
        fitted = fit_models([record], [], ModelSet(start="free", dead_time=dead_time))
        chosen = next(c.fit.structure for c in fitted.candidates if c.name == fitted.chosen)
        assert chosen.dead_time is expected


@pytest.mark.parametrize("integrators", [0, 1])
@pytest.mark.parametrize("seed", range(3))
def test_the_end_of_a_record_that_began_at_rest_is_not_judged_as_if_it_rested_there(
    integrators, seed
):
    draw = np.random.default_rng(seed)
    denominator = [0.3, 1.0, 0.0] if integrators else [3.0, 1.0]
    given = steps(draw, 600, 10)
    output = sampled([1.0], denominator, given, TS)
    output += 0.02 * np.std(output) * draw.normal(size=output.size)
    record = SignalRecord("trial", TS * np.arange(output.size), given, output)
    scores: list[float] = []
    for start in ("rest", "free"):
        structure = ContinuousStructure(order=1, integrators=integrators, start=start)
        fit = rough_fit(structure, [record], [np.log(denominator[:1])])
        scores += choice_by_free_run([fit], [record], []).held_out
    assert scores[0] == pytest.approx(scores[1], abs=1.0)
    assert scores[0] > 90.0
