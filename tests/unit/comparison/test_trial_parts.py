"""Trials cut into parts: nothing lost, nothing fitted that is judged, p-values as stated."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_parts import cut_trials
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.method.evidence import compare_trials, losses
from pamsim.inference.residual_block import ResidualBlock
from pamsim.recordings.trial import Trial

INTERVAL = 0.02


def trial(name, seconds, protocol=None):
    time = INTERVAL * np.arange(round(seconds / INTERVAL))
    return Trial(
        name=name,
        protocol=protocol or name,
        drive="pressure_set",
        load=0.0,
        time=time,
        command=np.zeros((time.size, 1)),
        measured={"angle": np.zeros(time.size), "pressure_1": np.zeros(time.size)},
    )


def blocks(trials, rng):
    return [
        ResidualBlock(
            trial=t.name,
            protocol=t.protocol,
            channel=channel,
            residual=rng.standard_normal(t.time.size),
            sample_interval=INTERVAL,
        )
        for t in trials
        for channel in t.measured
    ]


@pytest.mark.parametrize(("seconds", "parts"), [(1.0, 4), (8.0, 8), (11.0, 10), (90.0, 24)])
def test_half_of_a_trial_is_held_out_in_parts_that_cover_it(seconds, parts):
    one = trial("log", seconds)
    cut = cut_trials([one], [], True)
    rows = list(cut.rows["log"].values())
    assert len(rows) == parts
    assert (rows[0].start, rows[-1].stop) == (0, one.time.size)
    assert all(a.stop == b.start for a, b in pairwise(rows))
    assert len(cut.held_out) == parts / 2
    assert cut.held_out_trials == ()
    held = np.array([name in cut.held_out for name in cut.rows["log"]])
    assert np.unique(np.diff(held.astype(int))).size > 2 or parts == 4  # not every second one


def test_a_repeat_that_is_held_out_is_so_whole_and_its_protocol_keeps_the_others():
    trials = [trial("a_1", 4.0, "a"), trial("a_2", 4.0, "a"), trial("b_1", 4.0, "b")]
    cut = cut_trials(trials, ["a_2"], True)
    assert cut.held_out_trials == ("a_2",)
    assert not cut.held_out & set(cut.rows["a_1"])
    assert len(cut.held_out & set(cut.rows["b_1"])) == 2
    assert not cut_trials(trials, ["a_2"], False).held_out & set(cut.rows["b_1"])


def test_a_simulator_gives_a_fit_the_other_parts_alone_and_can_put_trials_together():
    trials = [trial("a", 4.0), trial("b", 6.0)]
    cut = cut_trials(trials, [], True)
    whole = blocks(trials, np.random.default_rng(0))
    simulator = TrialSimulator(lambda sets, **_: [whole] * len(sets), parts=cut)
    residual = simulator.fine({})
    assert residual is not None
    np.testing.assert_array_equal(residual, np.concatenate([b.residual for b in whole]))
    (fitted,) = simulator.fit_rows([{}])
    np.testing.assert_array_equal(fitted, residual[simulator.fitted])
    places = simulator.layout
    assert set(places.trials(held_out=True)) == cut.held_out
    together = places.uncut(places.places)
    assert [(p.block.trial, p.block.channel) for p in together] == [
        (b.trial, b.channel) for b in whole
    ]
    for place, block in zip(together, whole, strict=True):
        np.testing.assert_array_equal(residual[place.rows], block.residual)
        np.testing.assert_array_equal(place.block.residual, block.residual)
    quantities = cut.signals({t.name: {"elapsed": t.time} for t in trials})
    assert sum(part["elapsed"].size for part in quantities.values()) == 500


@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_p_is_uniform_where_neither_of_two_models_is_better(drift):
    """Two models as far off, one to either side: what decides between them is noise alone."""
    rng = np.random.default_rng(4)
    one = trial("log", 16.0)
    cut = cut_trials([one], [], True)
    off = 0.2 * np.sin(2.0 * np.pi * one.time / 3.0)
    floor = NoiseFloor(sd={"angle": 1.0}, variance={}, repeats=1, assumed=True)
    keep = np.exp(-INTERVAL / drift) if drift else 0.0
    p = []
    for _ in range(400):
        white = rng.standard_normal(one.time.size + 200)
        noise = np.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], white)[200:]
        block = ResidualBlock(
            trial="log", protocol="log", channel="angle", residual=noise, sample_interval=INTERVAL
        )
        simulator = TrialSimulator(lambda _sets, b=block, **_: [[b]], parts=cut)
        simulator.fine({})
        places = simulator.layout
        before, after = (losses(places, noise + s * off, floor, held_out=True) for s in (1, -1))
        p.append(compare_trials(before, after, places.protocol_of).p_value)
    assert kstest(p, "uniform").pvalue > 0.01
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=2.6 * np.sqrt(0.0475 / 400))
