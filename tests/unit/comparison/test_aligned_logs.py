"""Logs of one input that are started and stopped by hand, or command a few rows late."""

from dataclasses import replace

import numpy as np
import pytest

from pamsim.comparison.aligned_logs import aligned
from pamsim.comparison.repeats import repeats
from pamsim.recordings.trial import TrialLead
from tests.unit.recordings.made_trial import made_trial

LEVELS = np.array([[1e5, 3e5], [2e5, 2e5], [3e5, 1e5], [2e5, 3e5]])
RNG = np.random.default_rng(0)


def log(name, *, before, after=0, late=(0, 0), drive="pressure_set", protocol="levels"):
    """Rows before the first command, then levels of 40 rows, each some rows late."""
    ends = np.cumsum([before + 40, 40, 40, 40 + after]) + np.array([0, *late, 0])
    rows = np.searchsorted(ends, np.arange(ends[-1]), side="right")
    command = LEVELS[rows] / (1e6 if drive == "valve" else 1.0)
    angle = np.convolve(command[:, 0], np.exp(-np.arange(30) / 8.0))[: len(command)] / 1e6
    read = {"angle": angle + RNG.normal(0.0, 1e-4, len(command))}
    return made_trial(command, read, name=name, protocol=protocol, drive=drive)


def test_logs_are_cut_to_the_rows_that_all_have_from_as_long_before_their_first_command():
    logs = [log("a", before=5), log("b", before=14, after=6), log("c", before=9)]
    other = log("d", before=7, protocol="more")
    trials, notes = aligned([logs[0], other, *logs[1:]])
    assert [trial.name for trial in trials] == ["a", "d", "b", "c"]
    assert trials[0] is logs[0]
    assert trials[1] is other
    assert [len(group.trials) for group in repeats(trials)] == [3, 1]
    for whole, trial, begin in zip(logs[1:], trials[2:], (9, 4), strict=True):
        assert trial.time[0] == 0.0
        np.testing.assert_array_equal(trial.command, logs[0].command)
        np.testing.assert_array_equal(
            trial.measured["angle"], whole.measured["angle"][begin:][:165]
        )
    assert notes == (
        "repeats begin or end at other rows, and are cut to those of all: levels (165 rows)",
    )


def test_repeats_as_they_are_stay_as_they_are():
    trials = [log("a", before=5), log("b", before=5), log("c", before=8, protocol="other")]
    found, notes = aligned(trials)
    assert all(new is old for new, old in zip(found, trials, strict=True))
    assert notes == ()


def test_a_command_may_be_a_few_rows_late_and_each_trial_keeps_its_own():
    exact, late = log("a", before=5), log("b", before=5, late=(1, 3))
    (group,) = repeats([exact, late])
    assert not np.array_equal(*(trial.command for trial in group.trials))
    sine = 2e5 + 1e5 * np.sin(np.arange(165)[:, np.newaxis] / [12.0, 20.0])
    both = [replace(one, command=sine.copy()) for one in (exact, late)]
    both[1].command[2:-2:3] = sine[1:-3:3]  # rows that were written late replace others
    assert len(repeats(both)) == 1
    assert len(repeats([both[0], replace(late, command=np.roll(sine, 8, axis=0))])) == 2
    for wrong in (log("c", before=5, late=(4, 0)), replace(late, command=late.command * 1.001)):
        assert len(repeats([exact, wrong])) == 2


def test_what_follows_the_last_change_of_the_shorter_may_change_in_its_last_rows():
    def ends(rows):
        return replace(log("a", before=5), command=np.repeat(LEVELS[:2], [165 - rows, rows], 0))

    assert len(repeats([ends(3), replace(ends(0), name="b")])) == 1
    assert len(repeats([ends(4), replace(ends(0), name="b")])) == 2


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"command": np.roll(log("b", before=5).command, 1, axis=1)}, "commands differ from 0.03"),
        ({"time": np.arange(165) / 50.0}, "clocks differ"),
        ({"measured": {}}, "not the same signals"),
        ({"lead_in": TrialLead(time=np.zeros(1), duration=1.0, command=LEVELS[:1],
                               start_pressure=LEVELS[0])}, "if each begins at rest, state lead_in"),
    ],
)  # fmt: skip
def test_it_is_stated_why_trials_of_one_protocol_are_no_repeats(changed, why):
    trials = [log("a", before=5), replace(log("b", before=5), **changed)]
    found, (note,) = aligned(trials)
    assert all(new is old for new, old in zip(found, trials, strict=True))
    assert note.startswith("no repeats though of one protocol: a and b: ")
    assert why in note


def test_the_clock_is_why_logs_of_other_lengths_are_no_repeats_once_cut():
    jittered = log("b", before=14, after=6)
    jittered = replace(jittered, time=jittered.time + RNG.normal(0.0, 3e-4, jittered.time.size))
    _, (note,) = aligned([log("a", before=5), jittered])
    assert note.endswith("a and b: their clocks differ; state the same `rate` in every [[trial]]")


def test_a_log_that_moves_from_its_first_row_on_or_stops_much_earlier_is_not_cut():
    opened = [log(name, before=rows, drive="valve") for name, rows in (("a", 5), ("b", 9))]
    short = log("c", before=5)
    short = short.rows(slice(120))
    for trials in (opened, [log("a", before=5), short]):
        found, notes = aligned(trials)
        assert all(new is old for new, old in zip(found, trials, strict=True))
        assert notes[0].startswith("no repeats though of one protocol: a and ")


def test_a_row_that_holds_what_was_commanded_before_is_no_first_command():
    stale = log("b", before=5, after=2)
    stale.command[0] = LEVELS[3]
    trials, _ = aligned([log("a", before=5), stale])
    (group,) = repeats(trials)
    assert [trial.time.size for trial in group.trials] == [165, 165]


def test_periods_of_a_log_are_cut_at_their_ends():
    lead = TrialLead(
        time=np.arange(2) / 100.0, duration=0.02, command=LEVELS[:2], start_pressure=LEVELS[0]
    )
    whole, last = (replace(log(name, before=5), lead_in=lead) for name in "ab")
    last = last.rows(slice(-1))
    trials, _ = aligned([whole, last])
    assert [trial.time.size for trial in trials] == [164, 164]
    assert trials[1] is last
    (group,) = repeats(trials)
    assert len(group.trials) == 2
