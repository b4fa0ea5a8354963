"""One log, inputs recorded once or twice: parts of trials are the evidence."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.noise_within_trial import FloorRoute
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.held_out_split import held_out_split
from pamsim.diagnosis.method.trial_diagnosis import diagnose_trials
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import UNREPEATED_GAIN
from tests.unit.diagnosis.toy_arm import (
    BIAS,
    DRY,
    LEAK,
    NUISANCE,
    RATE,
    TIME,
    recorded,
    regressors,
    simulator,
)


def data(named):
    """As `CalibrationData`: (name, protocol) of each trial."""
    return SimpleNamespace(
        trials=[
            SimpleNamespace(name=n, protocol=p, time=TIME, sample_interval=1.0 / RATE)
            for n, p in named
        ]
    )


def found(hidden, *, repeats=1, **options):
    trials = [t for t in recorded(hidden, repeats=repeats, **options) if not t[2]]
    split = held_out_split(data([t[:2] for t in trials]), ())
    arm = TrialSimulator(simulator(trials).simulate, parts=split.parts)
    whole = regressors(trials)
    return diagnose_trials(
        arm, NUISANCE, (DRY, BIAS, LEAK), lambda values: split.parts.signals(whole(values))
    )


@pytest.mark.parametrize(
    ("hidden", "repeats"),
    [
        ({"dry": 0.15}, 1),
        ({"dry": 0.15}, 2),
        ({"bias": -0.12}, 2),
        ({"leak": 0.15}, 1),
        ({"leak": 0.15}, 2),
    ],
)
def test_what_is_hidden_is_named_with_few_repeats(hidden, repeats):
    ((name, size),) = hidden.items()
    one = found(hidden, repeats=repeats)
    assert one.conclusion.verdict is Verdict.NAMED_WITH_REMAINDER  # what repeats would show
    assert not one.conclusion.lack.testable
    assert one.conclusion.best.names == (name,)
    assert one.conclusion.best.fit.values[name] == pytest.approx(size, rel=0.1)
    low, high = one.conclusion.explained.interval95
    assert 0.9 < low <= one.conclusion.explained.value <= high
    assert one.floor.route is (FloorRoute.REPEATS if repeats > 1 else FloorRoute.WITHIN_TRIALS)


def test_two_parts_of_an_input_that_differ_prove_nothing():
    """A bias shows in some parts of a trial more than in others: of two, the scatter is unknown."""
    one = found({"bias": -0.12}, repeats=1)
    assert one.conclusion.verdict is Verdict.NOT_IDENTIFIABLE
    assert one.conclusion.nearest.names == ("bias",)
    assert one.models[0].improvement.p_value * one.tried == pytest.approx(0.093, abs=0.01)


@pytest.mark.parametrize("repeats", [1, 2])
@pytest.mark.parametrize("drift", [False, True])
def test_nothing_is_claimed_where_nothing_is_hidden(repeats, drift):
    """Nor of what differs from trial to trial, which all parts of a trial agree on."""
    verdicts = [
        found({}, repeats=repeats, seed=seed, drift=drift, variation=0.01).conclusion
        for seed in range(5)
    ]
    assert all(v.best is None and v.verdict is not Verdict.UNEXPLAINED for v in verdicts)


def test_a_small_effect_in_one_log_is_not_claimed_but_most_similar():
    one = found({"dry": 0.02})
    assert one.conclusion.best is None
    best = min(one.models, key=lambda m: m.mean_loss)
    assert best.names == ("dry",)
    assert 0.0 < best.improvement.gain < best.least_gain
    assert best.least_gain >= UNREPEATED_GAIN


def test_trials_are_cut_only_where_no_protocol_has_two_to_judge_by():
    def split(*named, hold_out=()):
        return held_out_split(data(named), hold_out)

    four = [(f"a_{i}", "a") for i in range(4)]
    assert split(*four).parts is None
    assert split(*four).names == ("a_1", "a_3")
    two = split(*four[:2])
    assert two.parts.held_out_trials == two.trials == ("a_1",)
    assert set(two.names) == set(two.parts.rows["a_1"])
    checked = split(("a_1", "a"), ("a_check_1", "a_check"))
    assert checked.parts.held_out_trials == ("a_check_1",)
    assert not checked.parts.held_out & set(checked.parts.rows["a_1"])
    log = split(("log", "log"))
    assert (len(log.names), log.trials) == (2, ())
    assert "parts of every trial" in log.warnings[0]
    assert "parts of trials are judged" in log.warnings[-1]
    chosen = split(("a_1", "a"), ("b_1", "b"), hold_out=["b"])
    assert chosen.parts.held_out == frozenset(chosen.parts.rows["b_1"])
    assert np.all(["parts of every" not in w for w in chosen.warnings])
