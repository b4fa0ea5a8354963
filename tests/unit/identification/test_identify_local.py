"""A staircase is cut where its input is held long enough, and repeats share an operating point."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pamsim.identification.local import fit_operating_points
from pamsim.identification.signals import signal, table_of, used_trial
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.recordings.trial import Trial

TS = 0.02
LEVELS = (2e5, 3e5, 4e5, 3e5, 2e5)


def staircase(gain, seed, hold=2.5, load=1.0, protocol="staircase", constant=0.3):
    """A lag whose gain depends on the higher level of a step."""
    per = round(hold / TS)
    level = np.repeat(LEVELS, per)
    difference = 0.5 * level
    time = np.arange(level.size) * TS
    settled = 0.0
    parts = [np.zeros(per)]
    for before, after in itertools.pairwise(LEVELS):
        change = gain(max(before, after)) * 0.5 * (after - before)
        parts.append(settled + change * -np.expm1(-time[:per] / constant))
        settled += change
    angle = np.concatenate(parts)
    draw = np.random.default_rng(seed)
    command = np.column_stack([level + difference / 2, level - difference / 2])
    trial = Trial(
        name=f"{protocol}_{seed}",
        protocol=protocol,
        drive="pressure_set",
        load=load,
        time=time,
        command=command,
        measured={
            "angle": angle + 1e-4 * draw.normal(size=time.size),
            "pressure_1": command[:, 0],
            "pressure_2": command[:, 1],
        },
    )
    table = table_of(trial)
    into = signal("p1_set_kpa-p2_set_kpa", [table])
    return used_trial(table, [into], signal("angle_deg", [table]))[0]


def mapped(*trials):
    """Local models and notes, by the first order that fits all trials best."""
    return fit_operating_points(trials, fit_continuous([trial.record for trial in trials], order=1))


def test_every_step_is_a_point_and_repeats_share_it():
    local, notes = mapped(*(staircase(lambda p: 1e-6, seed) for seed in (1, 2)))
    assert notes == []
    points = [model.point for model in local.models]
    assert [point.direction for point in points] == [1, 1, -1, -1]
    assert [len(model.fit.trials) for model in local.models] == [2, 2, 2, 2]
    # Mean over the step and the fifth of the plateau before it that it starts from.
    for point, (before, after) in zip(points, itertools.pairwise(LEVELS), strict=True):
        assert point.pressure == pytest.approx((0.2 * before + after) / 1.2, rel=0.01)
        assert point.amplitude == pytest.approx(0.25 * abs(after - before))
    for model in local.models:
        assert model.fit["T"].value == pytest.approx(0.3, rel=0.02)


def test_a_gain_that_falls_with_the_level_is_found():
    local, _ = mapped(staircase(lambda p: 1e-6 * (1.0 - (p - 3e5) / 4e5), 1))
    gains = [model.fit.gain for model in local.models]
    assert gains == pytest.approx([1e-6, 0.75e-6, 0.75e-6, 1e-6], rel=0.02)


def test_a_load_makes_points_of_its_own():
    local, _ = mapped(*(staircase(lambda p: 1e-6, seed, load=float(seed)) for seed in (1, 2)))
    assert len(local.models) == 8


def test_an_input_that_changes_too_fast_stays_whole():
    trials = [
        staircase(lambda p: 1e-6, seed, hold=0.4, protocol=name)
        for seed, name in enumerate(("a", "b"))
    ]
    local, _ = mapped(*trials)
    assert [model.point.direction for model in local.models] == [0, 0]
    assert mapped(trials[0])[0] is None


def test_of_very_many_points_some_are_drawn_and_that_is_said(monkeypatch):
    monkeypatch.setattr("pamsim.identification.local._MOST", 3)
    local, notes = mapped(staircase(lambda p: 1e-6, 1))
    assert notes == ["of 4 operating points 3, drawn at random, have a model"]
    assert len(local.models) == 3
