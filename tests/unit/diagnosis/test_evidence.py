"""Trials are the units of evidence, protocols are strata, and repeats give the floor."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from pamsim.comparison.noise_floor import noise_floor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.diagnosis.method.evidence import (
    compare_models,
    compare_rows,
    compare_trials,
    losses,
    perfect_losses,
    share_of_rows,
    share_of_trials,
)
from pamsim.inference.residual_block import ResidualBlock, layout


def table(rng, *, sizes=(4, 4), shift=0.0, spread=0.1, strata=(0.0, 1.0)):
    """Losses before and after over trials of some protocols, which differ by themselves."""
    before, after, protocol_of = {}, {}, {}
    for number, (count, level) in enumerate(zip(sizes, strata, strict=True)):
        for k in range(count):
            name = f"{number}_{k}"
            protocol_of[name] = f"p{number}"
            before[name] = 1.0 + level + spread * rng.standard_normal()
            after[name] = before[name] - shift - 0.5 * spread * rng.standard_normal()
    return before, after, protocol_of


def test_one_protocol_is_the_paired_t_test():
    before, after, protocol_of = table(
        np.random.default_rng(1), sizes=(6,), shift=0.05, strata=(0.0,)
    )
    found = compare_trials(before, after, protocol_of)
    peer = stats.ttest_rel(list(before.values()), list(after.values()), alternative="greater")
    assert found.p_value == pytest.approx(peer.pvalue)
    assert found.degrees == pytest.approx(peer.df)


def test_false_alarms_are_as_rare_as_promised():
    rng = np.random.default_rng(2)
    p = np.array([compare_trials(*table(rng)).p_value for _ in range(800)])
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.025)
    assert np.mean(p < 0.5) == pytest.approx(0.5, abs=0.06)


def repeated(protocol_of, origin=None):
    return SimpleNamespace(protocol_of=protocol_of, origin=origin or {})


def test_of_two_models_false_alarms_are_no_more_than_promised():
    """In five protocols with three trials each, one of which scatters most."""
    rng = np.random.default_rng(3)
    found: list[float] = []
    for _ in range(600):
        before, after, protocol_of = table(rng, sizes=(3,) * 5, strata=(0.0,) * 5)
        after = {t: b + (10.0 if t[0] == "0" else 1.0) * (after[t] - b) for t, b in before.items()}
        found.append(compare_models(before, after, repeated(protocol_of)).p_value)
    p = np.array(found)
    assert np.mean(p < 0.05) <= 0.05 + 2.5 * np.sqrt(0.05 * 0.95 / p.size)
    assert np.mean(p < 0.01) <= 0.01 + 2.5 * np.sqrt(0.01 * 0.99 / p.size)


def test_a_gain_in_every_trial_is_certain_though_one_protocol_has_most_of_it():
    gains = {"a": (0.6, 0.5, 0.6), "b": (0.3, 0.3, 0.3), "c": (4.8, 5.6, 3.1), "d": (0.4, 0.4, 0.3)}
    after = {f"{p}{k}": 1.0 for p in gains for k in range(3)}
    before = {f"{p}{k}": 1.0 + gain for p, own in gains.items() for k, gain in enumerate(own)}
    protocol_of = {trial: trial[0] for trial in after}
    alone = compare_trials(before, after, protocol_of)
    both = compare_models(before, after, repeated(protocol_of))
    assert alone.p_value > 0.004
    assert both.p_value < 0.0015
    assert (both.gain, both.error, both.degrees) == (alone.gain, alone.error, alone.degrees)
    # Parts of one trial agree on what varies from trial to trial.
    parts = compare_models(before, after, repeated(protocol_of, {"a0": "one trial"}))
    assert parts == alone
    few = [trial for trial in after if trial[0] in "abc"]  # all agree by chance in one of 512 cases
    before, after = {t: before[t] for t in few}, {t: after[t] for t in few}
    assert compare_models(before, after, repeated(protocol_of)) == compare_trials(
        before, after, protocol_of
    )


def test_a_protocol_with_more_trials_has_no_more_say():
    before = {"a": 2.0, "b": 2.0, **{f"c{k}": 1.0 for k in range(10)}}
    after = dict.fromkeys(before, 1.0)
    protocol_of = {name: "few" if name in "ab" else "many" for name in before}
    assert compare_trials(before, after, protocol_of).gain == pytest.approx(0.5)


def test_without_repeats_nothing_is_sure():
    found = compare_trials({"a": 2.0, "b": 3.0}, {"a": 1.0, "b": 1.0}, {"a": "p", "b": "q"})
    assert found.p_value == 1.0
    assert found.error == np.inf


def test_the_standard_error_is_the_scatter_of_the_gain():
    """Of protocols of two, five and one trial; the one that is alone scatters as the others."""
    rng = np.random.default_rng(16)
    found = [
        compare_trials(*table(rng, sizes=(2, 5, 1), strata=(0.0, 1.0, 2.0))) for _ in range(3000)
    ]
    scatter = np.std([one.gain for one in found])
    assert np.sqrt(np.mean([one.error**2 for one in found])) == pytest.approx(scatter, rel=0.05)
    assert found[0].standard_errors == found[0].gain / found[0].error


def test_a_gain_without_any_scatter_is_certain_and_none_is_none():
    before = {"a": 2.0, "b": 2.0}
    protocol_of = dict.fromkeys(before, "p")
    for after, p_value in ((1.0, 0.0), (2.0, 1.0), (3.0, 1.0)):
        found = compare_trials(before, dict.fromkeys(before, after), protocol_of)
        assert (found.gain, found.error, found.p_value) == (2.0 - after, 0.0, p_value)
        assert found.standard_errors == 0.0


def test_the_loss_of_a_perfect_model_is_the_noise_of_its_protocol():
    """0.1 and 0.3 deg of noise: a fifth and nine fifths of their mean variance, in each channel."""
    found = blocks(np.random.default_rng(17), repeats=6)
    residual = np.concatenate([b.residual for b in found])
    held_out = frozenset({"calm_0", "rough_0", "rough_1"})
    places = TrialLayout(places=layout(found), held_out=held_out)
    floor = noise_floor(places, residual)
    expected = {"calm_0": 0.2, "rough_0": 1.8, "rough_1": 1.8}
    assert perfect_losses(places, floor) == pytest.approx(expected, rel=0.1)
    assert losses(places, residual, floor, held_out=True) == pytest.approx(expected, rel=0.15)
    twice = losses(places, 2.0 * residual, floor, held_out=False)
    once = losses(places, residual, floor, held_out=False)
    assert set(once) == {b.trial for b in found} - held_out
    assert twice == pytest.approx({name: 4.0 * loss for name, loss in once.items()})


def blocks(rng, *, repeats, count=400, model=0.0):
    time = np.linspace(0.0, 6.0, count)
    return [
        ResidualBlock(
            trial=f"{protocol}_{k}",
            protocol=protocol,
            channel=channel,
            residual=model * np.sin(time) + sd * rng.standard_normal(count),
        )
        for protocol, factor in (("calm", 1.0), ("rough", 3.0))
        for k in range(repeats)
        for channel, sd in (("angle", 0.1 * factor), ("pressure_1", 20.0 * factor))
    ]


def test_floor_is_the_planted_noise_whatever_the_model_misses():
    for model in (0.0, 50.0):
        found = blocks(np.random.default_rng(3), repeats=5, model=model)
        places = TrialLayout(places=layout(found), held_out=frozenset())
        floor = noise_floor(places, np.concatenate([b.residual for b in found]))
        assert not floor.assumed
        assert floor.variance["angle", "calm"] == pytest.approx(0.01, rel=0.1)
        assert floor.variance["pressure_1", "rough"] == pytest.approx(3600.0, rel=0.1)
        assert floor.sd["angle"] == pytest.approx(np.sqrt((0.01 + 0.09) / 2.0), rel=0.05)


@pytest.mark.parametrize(("repeats", "assumed"), [(1, True), (2, True), (3, False)])
def test_a_floor_without_enough_repeats_is_said_to_be_assumed(repeats, assumed):
    found = blocks(np.random.default_rng(4), repeats=repeats)
    places = TrialLayout(places=layout(found), held_out=frozenset())
    floor = noise_floor(places, np.concatenate([b.residual for b in found]))
    assert floor.assumed is assumed
    assert floor.repeats == repeats
    assert floor.sd["angle"] == pytest.approx(np.sqrt(0.05), rel=0.1)


def test_what_a_model_leaves_is_never_counted_as_explained():
    """A gain of .332 and a remainder of .113 are 75 %, significant or not."""
    rng = np.random.default_rng(12)
    names = [f"{p}_{i}" for p in "ab" for i in range(4)]
    protocol_of = {name: name[0] for name in names}
    perfect = dict.fromkeys(names, 1.0)
    left = rng.standard_normal(8)
    after = dict(zip(names, 1.113 + 0.05 * (left - left.mean()), strict=True))
    before = {name: loss + 0.332 for name, loss in after.items()}
    share = share_of_trials(before, after, perfect, protocol_of)
    assert share.value == pytest.approx(0.332 / 0.445)
    low, high = share.interval95
    assert low < share.value < high < 1.0
    single = {name: name for name in names}
    assert share_of_trials(before, after, perfect, single).interval95 is None


def test_the_interval_of_the_share_holds_the_true_share():
    """95 %, of 400 data sets whose trials differ in what is missed and in what is left."""
    inside, runs = 0, 400
    names = [f"{p}_{i}" for p in "abc" for i in range(4)]
    protocol_of = {name: name[0] for name in names}
    perfect = dict.fromkeys(names, 1.0)
    for run in range(runs):
        rng = np.random.default_rng([13, run])
        left = 0.2 + 0.05 * rng.standard_normal(len(names))
        gain = 0.6 + 0.1 * rng.standard_normal(len(names))
        after = dict(zip(names, 1.0 + left, strict=True))
        before = dict(zip(names, 1.0 + left + gain, strict=True))
        low, high = share_of_trials(before, after, perfect, protocol_of).interval95
        inside += low <= 0.75 <= high
    assert inside / runs == pytest.approx(0.95, abs=0.035)


def test_the_share_of_rows_is_that_of_their_mean_squares():
    rng = np.random.default_rng(14)
    before, after = rng.standard_normal(60), 0.5 * rng.standard_normal(60)
    share = share_of_rows(before, after)
    assert share.value == pytest.approx(1.0 - np.mean(after**2) / np.mean(before**2))
    low, high = share.interval95
    assert low < 0.75 < high
    assert share_of_rows(after, before).value == 0.0


def test_nothing_is_explained_where_nothing_is_gained_and_all_where_nothing_was_missed():
    names = [f"{p}_{i}" for p in "ab" for i in range(3)]
    protocol_of = {name: name[0] for name in names}

    def share(before, after, perfect):
        levels = (dict.fromkeys(names, level) for level in (before, after, perfect))
        return share_of_trials(*levels, protocol_of).value

    assert share(2.0, 2.0, 1.0) == share(2.0, 2.5, 1.0) == 0.0
    assert share(0.9, 0.8, 1.0) == share(1.0, 0.9, 1.0) == 1.0
    assert share(2.0, 0.5, 1.0) == 1.0
    assert share(1.08, 1.04, 1.0) == pytest.approx(0.5)  # of a small gap


def test_rows_are_compared_by_their_squared_errors():
    rng = np.random.default_rng(18)
    before, after = rng.standard_normal(40), 0.8 * rng.standard_normal(40)
    found = compare_rows(before, after)
    peer = stats.ttest_rel(before**2, after**2)
    assert found.gain == pytest.approx(np.mean(before**2) - np.mean(after**2))
    assert found.standard_errors == pytest.approx(peer.statistic)
    assert found.degrees == peer.df
    order = rng.permutation(40)
    assert compare_rows(before[order], after[order]).p_value == found.p_value
    assert compare_rows(before[:1], after[:1]).error == np.inf


def test_rows_in_which_neither_is_better_have_uniform_p_values():
    runs = 300
    p = np.array([
        compare_rows(*np.random.default_rng([19, run]).standard_normal((2, 12))).p_value
        for run in range(runs)
    ])  # fmt: skip
    for level in (0.05, 0.25, 0.5):
        error = np.sqrt(level * (1.0 - level) / runs)
        assert np.mean(p <= level) == pytest.approx(level, abs=3.0 * error)
