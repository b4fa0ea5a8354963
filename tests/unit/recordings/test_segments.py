"""One log as several trials, and on an even clock."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.core.errors import InputError
from pamsim.core.toml_tables import check_table
from pamsim.recordings import segments
from pamsim.recordings.trial import Trial

TIME = np.arange(1001) / 100.0
PERIOD = 2.0


def cut(trial, entry, where):
    stated = check_table(entry, segments.ENTRIES, where)
    return segments.trials_of(trial, stated, where)


def log(**changes):
    wave = 5e4 * np.sign(np.sin(2.0 * np.pi * TIME / PERIOD))
    given = {
        "name": "log",
        "protocol": "square",
        "drive": "pressure_set",
        "load": 0.0,
        "time": TIME,
        "command": np.column_stack([3e5 + wave, 3e5 - wave]),
        "measured": {"angle": np.arange(TIME.size) * 1.0, "pressure_1": 2e5 + TIME},
    }
    return Trial(**(given | changes))


def test_periods_are_repeats_of_each_other_and_begin_after_the_lead_in():
    trials = cut(log(), {"period": "2 s", "lead_in": "1 s"}, "log")
    assert [trial.name for trial in trials] == ["log_1", "log_2", "log_3", "log_4"]
    assert {trial.protocol for trial in trials} == {"square"}
    for k, trial in enumerate(trials):
        assert trial.time[0] == 0.0
        assert trial.measured["angle"][[0, -1]].tolist() == [100 + 200 * k, 299 + 200 * k]
        assert trial.lead_in.duration == pytest.approx(1.0)
        assert trial.lead_in.time.size == 100
        assert trial.lead_in.start_pressure[0] == pytest.approx(2e5 + 2.0 * k)
        assert np.isnan(trial.lead_in.start_pressure[1])


def test_segments_are_where_they_are_said_to_be():
    first, second = cut(log(), {"segments": [[0, 1.5], [6.0, 10.0]], "lead_in": 2}, "log")
    assert first.lead_in is None  # the log begins there
    assert first.measured["angle"][[0, -1]].tolist() == [0, 149]
    assert second.measured["angle"][[0, -1]].tolist() == [600, 999]
    assert second.lead_in.duration == pytest.approx(2.0)


def test_a_log_without_them_is_one_trial_and_may_have_a_lead_in():
    whole = log()
    assert cut(whole, {}, "log") == (whole,)
    (rest,) = cut(whole, {"lead_in": "3 s"}, "log")
    assert rest.name == "log"
    assert rest.measured["angle"][[0, -1]].tolist() == [300, 1000]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"period": "2 s", "segments": [[0, 1]]}, "not both"),
        ({"period": "20 s"}, "no period of 20 s fits into 10 s"),
        ({"period": "0 s"}, "no period"),
        ({"lead_in": "-1 s"}, "0 s or more"),
        ({"segments": [[5, 4]]}, "the later time comes last"),
        ({"segments": [[5]]}, "pairs of times"),
        ({"segments": [[8, 12]]}, "ends at 10 s"),
        ({"segments": [[5, 5.02]]}, "has 2 rows"),
    ],
)
def test_what_is_not_in_the_log_is_refused(entry, message):
    with pytest.raises(InputError, match=message):
        cut(log(), entry, "recording.toml: trial 1")


@pytest.fixture(scope="module")
def recorded():
    """A rig with creep, its own log, and the trial that the log is."""
    rig = pamsim.load_rig("mas20_arm").with_parameters({"creep.stiffness": 600.0})
    start = np.array([3.5e5, 2.5e5])
    whole = experiment_of(log(measured={"pressure_1": np.full(1001, 3.5e5)}))
    run = pamsim.simulate(rig, whole).completed()
    measured = run.signals()
    assert measured["pressure_1"][0] == pytest.approx(start[0], rel=1e-6)
    return rig, log(measured=measured)


def missed(rig, trial):
    found = at_times(pamsim.simulate(rig, experiment_of(trial)), trial)["angle"]
    return float(np.abs(found - trial.measured["angle"]).max())


def test_a_lead_in_back_to_rest_repeats_the_log_and_a_longer_one_comes_nearer(recorded):
    rig, whole = recorded
    errors = []
    for lead in (0.5, 1.0, 4.0):
        (trial,) = cut(whole, {"segments": [[4.0, 8.0]], "lead_in": lead}, "log")
        errors.append(missed(rig, trial))
    assert errors[0] > errors[1] > 1e-4
    assert errors[2] < 1e-6


def test_segments_at_other_levels_are_inputs_of_their_own():
    """Two levels in turn, the second row late once: a row more or less makes no other input."""
    level = np.where((TIME % 4.0) < 2.0, 1e4, 3e4)
    level[400] = 3e4
    command = np.column_stack([level, level])
    spans = {"segments": [[0, 2], [2, 4], [4, 6], [6, 8]], "lead_in": 0}
    for protocol, wanted in (("hold", "hold_{}"), ("hold_check", "hold_{}_check")):
        trials = cut(log(command=command, protocol=protocol), spans, "log")
        assert [t.protocol for t in trials] == [wanted.format(k) for k in (1, 2, 1, 2)]
    measured = log(command=command + np.arange(1001)[:, None], drive="measured")
    assert {t.protocol for t in cut(measured, spans, "log")} == {"square"}


def uneven(drive: str = "pressure_set") -> Trial:
    draw = np.random.default_rng(2)
    time = np.cumsum(draw.uniform(0.008, 0.012, 400))
    time -= time[0]
    return Trial(
        name="log",
        protocol="log",
        drive=drive,
        load=0.0,
        time=time,
        command=np.where(time < 1.234, 1e4, 3e4)[:, None],
        measured={"angle": 0.3 * time},
    )


def on_even_clock(rate, drive="pressure_set"):
    (trial,) = cut(uneven(drive), {"rate": rate}, "here")
    return trial


def test_on_an_even_clock_measurements_are_interpolated_and_a_step_stays_one():
    log, even = uneven(), on_even_clock("50 Hz")
    np.testing.assert_allclose(np.diff(even.time), 0.02)
    assert log.time[-1] - 0.02 < even.time[-1] <= log.time[-1]
    np.testing.assert_allclose(even.measured["angle"], 0.3 * even.time, atol=1e-12)
    assert set(even.command.ravel()) == {1e4, 3e4}
    step = even.time[np.flatnonzero(np.diff(even.command[:, 0]))[0] + 1]
    assert abs(step - 1.234) < 0.02
    driven = on_even_clock("90 Hz", "measured")
    assert len(set(driven.command.ravel())) > 2


def test_a_rate_that_means_nothing_or_more_than_there_is_is_refused():
    for rate in (50, "50 s", "0 Hz", "-5 Hz", "200 Hz", "nan Hz"):
        with pytest.raises(InputError, match="here"):
            on_even_clock(rate)
