"""From trials to one input and one output: expressions, units, rest, clocks."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.identification.signals import (
    default_input,
    default_output,
    signal,
    table_of,
    used_trial,
)
from pamsim.recordings.trial import Trial
from tests.unit.linear.planted import refuses

N = 100
TIME = np.arange(N) / 100.0


def trial(kind="pressure_set", command=None, **changes):
    step = np.where(TIME < 0.3, 0.0, 1e5)
    pressures = np.column_stack([3e5 + step, 3e5 - step])
    valves = np.column_stack([step / 1e5, -step / 1e5])
    given = {
        "name": "step_1",
        "protocol": "step",
        "drive": kind,
        "load": 1.0,
        "time": TIME,
        "command": (pressures if kind == "pressure_set" else valves)
        if command is None
        else command,
        "measured": {
            "pressure_1": pressures[:, 0] + 50.0,
            "pressure_2": pressures[:, 1] - 50.0,
            "angle": np.sin(TIME),
        },
    }
    return Trial(**(given | changes))


def record(given, text=None, output="angle_deg"):
    table = table_of(given)
    into = signal(text or default_input([table]), [table])
    trial_used, note = used_trial(table, [into], signal(output, [table]))
    return trial_used.record, note


def test_the_default_is_the_difference_of_what_was_commanded():
    assert default_input([table_of(trial())]) == "p1_set_kpa-p2_set_kpa"
    assert default_input([table_of(trial("valve"))]) == "u1-u2"
    assert default_output([table_of(trial())]) == "angle_deg"


def test_values_are_si_and_units_are_those_of_the_columns():
    used, note = record(trial())
    assert note == ""
    assert (used.units_input, used.unit_output, used.holds) == (("Pa",), "rad", ("zoh",))
    assert (used.input[0], used.input[-1]) == (0.0, 2e5)
    np.testing.assert_allclose(used.output, np.sin(TIME))
    table = table_of(trial())
    shown = signal("p1_kpa", [table])
    assert (shown.unit, shown.si_unit, shown.factor) == ("kPa", "Pa", 1e3)
    assert signal("angle_deg", [table]).factor == pytest.approx(np.pi / 180.0)


def test_a_sum_and_a_leading_minus_are_read():
    used, _ = record(trial(), "-p1_set_kpa + p2_set_kpa")
    assert used.input[-1] == -2e5


def test_a_measured_input_runs_straight_between_samples():
    used, _ = record(trial(), "p1_kpa-p2_kpa")
    assert used.holds == ("foh",)
    assert used.time.size == N


@pytest.mark.parametrize("kind", ["pressure_set", "valve"])
def test_a_step_at_time_0_is_a_change_from_where_the_trial_rests(kind):
    late = np.tile({"pressure_set": [4e5, 2e5], "valve": [1.0, -1.0]}[kind], (N, 1))
    rest = {"pressure_1": np.linspace(3e5, 4e5, N), "pressure_2": np.linspace(3e5, 2e5, N)}
    given = trial(kind, late, measured={**rest, "angle": np.sin(TIME)})
    used, _ = record(given)
    jump = {"pressure_set": 2e5, "valve": 2.0}[kind]
    before = used.time < -1e-9
    assert 0 < np.count_nonzero(before) == used.time.size - N
    assert used.input[before] == pytest.approx(0.0, abs=1e-9 * jump)
    assert np.all(used.input[~before] == jump)
    assert np.all(used.output[before] == used.output[~before][0])


@pytest.mark.parametrize("noise", [500.0, -1500.0])
def test_sensor_noise_of_the_first_row_is_no_step(noise):
    given = trial()
    measured = {**given.measured, "pressure_1": given.measured["pressure_1"] + noise}
    assert record(trial(measured=measured))[0].time.size == N
    held = np.tile([3e5, 3e5], (N, 1))
    refuses("input is constant", record, trial(command=held, measured=measured))


def test_an_uneven_clock_is_made_uniform_and_a_held_command_stays_held():
    time = TIME.copy()
    time[1:-1] += np.random.default_rng(1).uniform(-2e-3, 2e-3, N - 2)
    given = trial(time=time, measured={"angle": 2.0 * time})
    used, note = record(given)
    assert "interpolated to a uniform step" in note
    np.testing.assert_allclose(np.diff(used.time), used.sample_time, rtol=1e-9)
    np.testing.assert_allclose(used.output, 2.0 * used.time, atol=1e-12)
    assert set(used.input) == {0.0, 2e5}
    changes = used.time[np.flatnonzero(np.diff(used.input)) + 1]
    assert 0.0 <= changes[0] - time[30] < used.sample_time


BAD = {
    "unknown": ("p1_bar", "no column 'p1_bar'; did you mean 'p1_kpa'"),
    "mixed units": ("p1_kpa-angle_deg", "adds deg and kPa"),
    "product": ("p1_kpa*2", "is no signal"),
    "nothing": ("", "is no signal"),
    "trailing": ("p1_kpa-", "is no signal"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_expression_is_one_clear_line(name):
    text, expected = BAD[name]
    with pytest.raises(InputError) as refused:
        signal(text, [table_of(trial())])
    assert expected in str(refused.value)


def test_a_column_that_one_trial_is_without_is_named_with_the_trial():
    tables = [table_of(trial()), table_of(trial(name="step_2", measured={"angle": TIME}))]
    refuses("'p1_kpa' is not in trial 'step_2'", signal, "p1_kpa", tables)
    refuses("give `output`", default_output, [table_of(trial(measured={}))])
