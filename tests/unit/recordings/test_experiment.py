"""Experiments refuse what no rig can do, and hold their commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pamsim.core.errors import ParameterError
from pamsim.recordings.experiment import Experiment, pressure_step
from tests.unit.core.refusals import cases, refused


def experiment(**changes: Any) -> Experiment:
    """Three levels for two muscles, valid but for what the caller changes."""
    fields: dict[str, Any] = {
        "drive": "pressure_set",
        "command_time": np.array([0.0, 0.5, 1.5]),
        "command_value": np.array([[1e5, 2e5], [3e5, 0.0], [0.0, 6e5]]),
        "start_pressure": np.array([1e5, 2e5]),
        "duration": 2.0,
    }
    return Experiment(**(fields | changes))


NAN, INF = math.nan, math.inf
BAD_INPUTS = {
    "unknown command": ({"drive": "presure_set"}, ("'presure_set'", "did you mean 'pressure_set'")),
    "nan time": ({"command_time": [0.0, NAN, 1.0]}, ("command time", "nan", "entry 1")),
    "infinite value": (
        {"command_value": [[1e5, 2e5], [0.0, 0.0], [0.0, INF]]},
        ("command value", "inf", "entry 5"),
    ),
    "negative start": ({"start_pressure": [-2e3, 0.0]}, ("-2 kPa", "negative")),
    "negative set point": (
        {"command_value": [[1e5, 2e5], [-3e3, 0.0], [0.0, 0.0]]},
        ("-3 kPa", "negative"),
    ),
    "repeated time": ({"command_time": [0.0, 0.5, 0.5]}, ("increase",)),
    "late start": ({"command_time": [0.1, 0.5, 1.5]}, ("start at 0",)),
    "too few rows": ({"command_value": [[1e5, 2e5]]}, ("(1, 2)", "(3, 2)")),
    "too many axes": ({"command_value": np.zeros((3, 2, 1))}, ("(3, 2, 1)", "(3, 2)")),
    "valve too far open": (
        {"drive": "valve", "command_value": [[0.0, 0.0], [-1.2, 0.0], [0.0, 1.0]]},
        ("-1.2", "[-1, 1]"),
    ),
    "duty too large": ({"drive": "pulse", "command_value": [[0, 0], [0, 1.5], [0, 1]]}, ("1.5",)),
    "no command at all": (
        {"command_time": np.zeros(0), "command_value": np.zeros((0, 2))},
        ("command",),
    ),
}


@pytest.mark.parametrize(("changes", "words"), cases(BAD_INPUTS))
def test_bad_input_is_refused_in_one_line(changes, words):
    with refused(*words):
        experiment(**changes)


@pytest.mark.parametrize(
    ("field", "bad"),
    [
        ("duration", (0.0, -1.0, NAN, INF, "2", True)),
        ("sample_rate", (0.0, -500.0, NAN, 1e9)),
        ("load", (-0.1, NAN, INF)),
        ("settle", (-1.0, NAN)),
    ],
)
def test_numbers_out_of_range_are_refused_by_name(field, bad):
    for value in bad:
        with refused(f"experiment.{field}", error=ParameterError):
            experiment(**{field: value})


def test_value_is_held_until_the_next():
    made = experiment()
    for row, (start, end) in enumerate([(0.0, 0.5), (0.5, 1.5), (1.5, 4.0)]):
        for time in (start, start + 1e-6, 0.5 * (start + end), end - 1e-6):
            assert np.array_equal(made.command_at([time])[0], made.command_value[row])


def test_break_points_fall_on_their_own_sample_of_a_500_hz_grid():
    """However a time is spelt, k * 0.002 or k / 500, sample k takes the k-th value."""
    count = 5000
    k = np.arange(count)
    assert np.any(k * 0.002 != k / 500.0)
    for written in (k * 0.002, k / 500.0):
        made = experiment(
            command_time=written, command_value=np.stack([k, k], axis=1) * 10.0, duration=10.0
        )
        for grid in (k * 0.002, k / 500.0, np.linspace(0.0, (count - 1) / 500.0, count)):
            assert np.array_equal(made.command_at(grid)[:, 0], 10.0 * k)


def test_pressure_step_is_one_level_from_time_zero():
    made = pressure_step([1e5, 2e5], [3e5, 0.0], duration=1.0, load=1.2, name="row 1")
    assert (made.drive, made.load, made.name) == ("pressure_set", 1.2, "row 1")
    assert np.array_equal(made.command_at([0.0, 0.3, 1.0]), [[3e5, 0.0]] * 3)
    assert np.array_equal(made.start_pressure, [1e5, 2e5])
    with refused("negative"):
        pressure_step([1e5, 2e5], [-1.0, 0.0], duration=1.0)
