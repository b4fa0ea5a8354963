"""Repeats of an input are one group, whose mean is simulated once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pamsim.comparison.repeats import repeats
from pamsim.recordings.trial import Trial

TIME = np.arange(5) / 100.0


def trial(name, protocol="steps", **changes):
    made = Trial(
        name=name,
        protocol=protocol,
        drive="pressure_set",
        load=0.0,
        time=TIME,
        command=np.full((5, 2), 1e5),
        measured={"angle": np.zeros(5)},
        muscle_names=(),
    )
    return replace(made, **changes)


def names(groups):
    return [[t.name for t in group.trials] for group in groups]


def test_repeats_have_one_protocol_command_load_and_clock():
    other = np.full((5, 2), 1.1e5)
    found = repeats(
        [
            trial("a"),
            trial("b"),
            trial("ramps", protocol="ramps"),
            trial("loaded", load=1.0),
            trial("commanded", command=other),
            trial("slower", time=2.0 * TIME),
            trial("c"),
        ]
    )
    assert names(found) == [["a", "b", "c"], ["ramps"], ["loaded"], ["commanded"], ["slower"]]


def test_measured_pressures_that_drive_may_differ_by_their_noise():
    noisy = np.full((5, 2), 1e5) + np.arange(10.0).reshape(5, 2)
    found = repeats([trial("a", drive="measured"), trial("b", drive="measured", command=noisy)])
    assert names(found) == [["a", "b"]]


def test_the_mean_is_that_of_what_was_measured_and_of_what_was_imposed():
    (group,) = repeats(
        [
            trial("a", drive="measured", measured={"angle": np.zeros(5)}),
            trial(
                "b",
                drive="measured",
                command=np.full((5, 2), 3e5),
                measured={"angle": np.full(5, 0.4)},
            ),
        ]
    )
    mean = group.mean()
    assert mean.name == group.name == "a"
    np.testing.assert_allclose(mean.command, 2e5)
    np.testing.assert_allclose(mean.measured["angle"], 0.2)
