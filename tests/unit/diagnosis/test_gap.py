"""Gaps on held-out trials: trials are the units, intervals cover, two repeats claim no interval."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.diagnosis.method.gap import gaps

SAMPLES = 60


def drawn(rng, *, repeats=4, protocols=("a", "b"), bias=0.0, spread=0.0, sd=1.0):
    """Residuals of trials that share a bias, differ in level, and carry white noise."""
    protocol_of = {f"{p}_{i}": p for p in protocols for i in range(repeats)}
    residuals = {
        trial: {"angle": bias + spread * rng.standard_normal() + sd * rng.standard_normal(SAMPLES)}
        for trial in protocol_of
    }
    return residuals, protocol_of


def floor_of(residuals, protocol_of):
    variance = {}
    for p in set(protocol_of.values()):
        stack = np.stack([r["angle"] for t, r in residuals.items() if protocol_of[t] == p])
        ddof = 1 if len(stack) > 1 else 0
        variance["angle", p] = float(np.mean(np.var(stack, axis=0, ddof=ddof)))
    sd = {"angle": float(np.sqrt(np.mean(list(variance.values()))))}
    return NoiseFloor(sd=sd, variance=variance, repeats=1, assumed=False)


def gap_of(residuals, protocol_of, after=None, held_out=None):
    floor = floor_of(residuals, protocol_of)
    (one,) = gaps(residuals, after or {}, floor, protocol_of, held_out or tuple(protocol_of))
    return one


def test_levels_are_root_mean_squares_of_the_held_out_trials_alone():
    residuals = {t: {"angle": np.full(SAMPLES, level)} for t, level in
                 (("a_1", 3.0), ("a_2", 4.0), ("b_1", 9.0))}  # fmt: skip
    protocol_of = {"a_1": "a", "a_2": "a", "b_1": "b"}
    after = {t: {"angle": 0.5 * r["angle"]} for t, r in residuals.items()}
    one = gap_of(residuals, protocol_of, after, held_out=("a_1", "a_2"))
    assert one.before.value == pytest.approx(np.sqrt(12.5))
    assert one.after.value == pytest.approx(0.5 * np.sqrt(12.5))
    assert one.floor.value == pytest.approx(np.sqrt(0.5))  # of protocol a alone
    both = gap_of(residuals, protocol_of)
    assert both.before.value == pytest.approx(
        np.sqrt((12.5 + 81.0) / 2)
    )  # protocols have equal weight
    assert both.after is None


@pytest.mark.parametrize(("repeats", "spread"), [(3, 0.0), (4, 0.3)])
def test_an_interval_covers_in_19_of_20_draws(repeats, spread):
    rng = np.random.default_rng(3)
    truth = {"before": np.sqrt(1.0 + 0.25 + spread**2), "floor": np.sqrt(1.0 + spread**2)}
    inside = dict.fromkeys(truth, 0)
    for _ in range(400):
        one = gap_of(*drawn(rng, bias=0.5, spread=spread, repeats=repeats))
        for which, value in truth.items():
            low, high = getattr(one, which).interval95
            inside[which] += low < value < high
    for which, count in inside.items():
        assert 0.925 <= count / 400 <= 0.985, which


def test_trials_that_differ_widen_the_interval_however_many_samples_they_have():
    rng = np.random.default_rng(5)
    equal, apart = (gap_of(*drawn(rng, bias=1.0, spread=s)) for s in (0.0, 0.5))
    width = [np.diff(one.before.interval95)[0] for one in (equal, apart)]
    assert width[1] > 2.0 * width[0]


@pytest.mark.parametrize(("repeats", "expected"), [(1, (False, False)), (2, (False, True)),
                                               (3, (True, True))])  # fmt: skip
def test_too_few_repeats_give_no_interval(repeats, expected):
    one = gap_of(*drawn(np.random.default_rng(1), repeats=repeats))
    assert (one.floor.interval95 is not None, one.before.interval95 is not None) == expected


def test_a_channel_without_held_out_trials_is_left_out():
    residuals, protocol_of = drawn(np.random.default_rng(1))
    floor = NoiseFloor(sd={"force_1": 1.0}, variance={}, repeats=4, assumed=False)
    assert gaps(residuals, {}, floor, protocol_of, tuple(protocol_of)) == ()
