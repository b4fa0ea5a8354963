"""One log as several trials, and on an even clock."""

import numpy as np
import pytest

import pamsim
from pamsim.comparison.experiments import at_times, experiment_of
from pamsim.core.toml_tables import check_table
from pamsim.recordings import segments
from tests.unit.core.refusals import all_refused
from tests.unit.recordings.made_trial import made_trial

TIME = np.arange(1001) / 100.0


def cut(trial, entry):
    stated = check_table(entry, segments.ENTRIES, "here")
    return segments.trials_of(trial, stated, "here")


def log(**changes):
    """A square wave of 2 s on the set points; the angle counts the samples."""
    wave = 5e4 * np.sign(np.sin(np.pi * TIME))
    given = {
        "command": np.column_stack([3e5 + wave, 3e5 - wave]),
        "measured": {"angle": np.arange(TIME.size) * 1.0, "pressure_1": 2e5 + TIME},
    }
    return made_trial(**{"name": "log", "protocol": "square", **given, **changes})


def ends(trial):
    return trial.measured["angle"][[0, -1]].tolist()


def test_periods_are_repeats_of_each_other_and_begin_after_the_lead_in():
    trials = cut(log(), {"period": "2 s", "lead_in": "1 s"})
    assert [trial.name for trial in trials] == ["log_1", "log_2", "log_3", "log_4"]
    assert {trial.protocol for trial in trials} == {"square"}
    for k, trial in enumerate(trials):
        assert trial.time[0] == 0.0
        assert ends(trial) == [100 + 200 * k, 299 + 200 * k]
        assert trial.lead_in.duration == pytest.approx(1.0)
        assert trial.lead_in.time.size == 100
        assert trial.lead_in.start_pressure[0] == pytest.approx(2e5 + 2.0 * k)
        assert np.isnan(trial.lead_in.start_pressure[1])


def test_segments_are_where_they_are_stated_to_be():
    first, second = cut(log(), {"segments": [[0, 1.5], [6.0, 10.0]], "lead_in": 2})
    assert first.lead_in is None  # the log begins there
    assert (ends(first), ends(second)) == ([0, 149], [600, 999])
    assert second.lead_in.duration == pytest.approx(2.0)
    whole = log()
    assert cut(whole, {}) == (whole,)
    (rest,) = cut(whole, {"lead_in": "3 s"})
    assert (rest.name, ends(rest)) == ("log", [300, 1000])


def test_segments_at_other_levels_are_inputs_of_their_own():
    """Two levels in turn, the second row late once: a row more or less makes no other input."""
    level = np.where((TIME % 4.0) < 2.0, 1e4, 3e4)
    level[400] = 3e4
    command = np.column_stack([level, level])
    spans = {"segments": [[0, 2], [2, 4], [4, 6], [6, 8]], "lead_in": 0}
    for protocol, wanted in (("hold", "hold_{}"), ("hold_check", "hold_{}_check")):
        trials = cut(log(command=command, protocol=protocol), spans)
        assert [t.protocol for t in trials] == [wanted.format(k) for k in (1, 2, 1, 2)]
    measured = log(command=command + np.arange(1001)[:, None], drive="measured")
    assert {t.protocol for t in cut(measured, spans)} == {"square"}


def test_a_lead_in_back_to_rest_repeats_the_log_and_a_longer_one_comes_nearer():
    """Of a rig with creep."""
    rig = pamsim.load_rig("mas20_arm").with_parameters({"creep.stiffness": 600.0})
    whole = experiment_of(log(measured={"pressure_1": np.full(1001, 3.5e5)}))
    recorded = log(measured=pamsim.simulate(rig, whole).completed().signals())
    errors = []
    for lead in (0.5, 1.0, 4.0):
        (trial,) = cut(recorded, {"segments": [[4.0, 8.0]], "lead_in": lead})
        found = at_times(pamsim.simulate(rig, experiment_of(trial)), trial)["angle"]
        errors.append(np.abs(found - trial.measured["angle"]).max())
    assert errors[0] > errors[1] > 1e-4
    assert errors[2] < 1e-6


def uneven(drive="pressure_set"):
    time = np.cumsum(np.random.default_rng(2).uniform(0.008, 0.012, 400))
    time -= time[0]
    command = np.where(time < 1.234, 1e4, 3e4)[:, None]
    return log(drive=drive, time=time, command=command, measured={"angle": 0.3 * time})


def test_on_an_even_clock_measurements_are_interpolated_and_a_step_stays_one():
    whole, (even,) = uneven(), cut(uneven(), {"rate": "50 Hz"})
    np.testing.assert_allclose(np.diff(even.time), 0.02)
    assert whole.time[-1] - 0.02 < even.time[-1] <= whole.time[-1]
    np.testing.assert_allclose(even.measured["angle"], 0.3 * even.time, atol=1e-12)
    assert set(even.command.ravel()) == {1e4, 3e4}
    step = even.time[np.flatnonzero(np.diff(even.command[:, 0]))[0] + 1]
    assert abs(step - 1.234) < 0.02
    (driven,) = cut(uneven("measured"), {"rate": "90 Hz"})
    assert len(set(driven.command.ravel())) > 2


def test_what_is_not_in_the_log_is_refused():
    bad = {
        "both": ({"period": "2 s", "segments": [[0, 1]]}, "not both"),
        "long": ({"period": "20 s"}, "no period of 20 s fits into 10 s"),
        "no length": ({"period": "0 s"}, "no period"),
        "no rows": ({"period": "1e-9 s"}, "of periods of 1e-09 s, some have fewer than the 8 rows"),
        "negative": ({"lead_in": "-1 s"}, "0 s or more"),
        "backwards": ({"segments": [[5, 4]]}, "write the earlier time first"),
        "no pair": ({"segments": [[5]]}, "pairs of times"),
        "beyond": ({"segments": [[8, 12]]}, "ends at 10 s"),
        "few rows": ({"segments": [[5, 5.02]]}, "has 2 rows"),
    }
    for rate in (50, "50 s", "0 Hz", "-5 Hz", "200 Hz", "nan Hz", "0.05 Hz"):
        bad[f"rate {rate}"] = ({"rate": rate}, "here")
    all_refused(bad, lambda entry: cut(log(), entry))
