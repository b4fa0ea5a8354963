"""Experiments refuse what no rig can do, and hold their commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pamsim.core.errors import ParameterError
from pamsim.recordings.experiment import Experiment, pressure_step
from tests.unit.core.refusals import all_refused, refused


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


def last(*row, first=0.0):
    return {"command_value": [[first, 0.0], [0.0, 0.0], row]}


BAD_INPUTS = {
    "unknown": ({"drive": "presure_set"}, ("'presure_set'", "did you mean 'pressure_set'")),
    "nan time": ({"command_time": [0.0, NAN, 1.0]}, ("command time", "nan", "entry 1")),
    "infinite value": (last(0.0, INF), ("command value", "inf", "entry 5")),
    "negative start": ({"start_pressure": [-2e3, 0.0]}, ("-2 kPa", "negative")),
    "negative set point": (last(0.0, 0.0, first=-3e3), ("-3 kPa", "negative")),
    "repeated time": ({"command_time": [0.0, 0.5, 0.5]}, "increase"),
    "late start": ({"command_time": [0.1, 0.5, 1.5]}, "start at 0"),
    "too few rows": ({"command_value": [[1e5, 2e5]]}, ("(1, 2)", "(3, 2)")),
    "too many axes": ({"command_value": np.zeros((3, 2, 1))}, ("(3, 2, 1)", "(3, 2)")),
    "too far open": ({"drive": "valve"} | last(0.0, -1.2), ("-1.2", "[-1, 1]")),
    "duty too large": ({"drive": "pulse"} | last(0, 1.5), "1.5"),
    "no command": ({"command_time": [], "command_value": np.zeros((0, 2))}, "command"),
}


def test_pressures_in_kpa_are_said_to_be_pascals():
    with pytest.warns(UserWarning, match="for 400 kPa, write 400e3"):
        pressure_step([300, 300], [400, 200], duration=1.0)
    pressure_step([0.0, 0.0], [0.0, 0.0], duration=1.0)
    pressure_step([0.0, 0.0], [312.4, 0.0], duration=1.0)  # as a sensor reads


def test_what_no_rig_can_do_is_refused_in_one_line():
    all_refused(BAD_INPUTS, lambda changes: experiment(**changes))
    with refused("negative"):
        pressure_step([1e5, 2e5], [-1.0, 0.0], duration=1.0)
    with refused("1 start pressures and 2 final ones"):
        pressure_step([1e5], [1e5, 2e5], duration=1.0)
    for field, bad in (
        ("duration", (0.0, -1.0, NAN, INF, "2", True)),
        ("sample_rate", (0.0, -500.0, NAN, 1e9)),
        ("load", (-0.1, NAN, INF)),
        ("settle", (-1.0, NAN)),
    ):
        for value in bad:
            with refused(f"experiment.{field}", error=ParameterError):
                experiment(**{field: value})
    for rate in (1e-320, 1e-10, 0.2):  # one sample alone, from which nothing follows
        with refused("end before the second sample"):
            experiment(sample_rate=rate)


def test_a_value_is_held_until_the_next():
    made = experiment()
    for row, (start, end) in enumerate([(0.0, 0.5), (0.5, 1.5), (1.5, 4.0)]):
        for time in (start, start + 1e-6, 0.5 * (start + end), end - 1e-6):
            assert np.array_equal(made.command_at([time])[0], made.command_value[row])
    made = pressure_step([1e5, 2e5], [3e5, 0.0], duration=1.0, load=1.2, name="row 1")
    assert (made.drive, made.load, made.name) == ("pressure_set", 1.2, "row 1")
    assert np.array_equal(made.command_at([0.0, 0.3, 1.0]), [[3e5, 0.0]] * 3)
    assert np.array_equal(made.start_pressure, [1e5, 2e5])


def test_break_points_fall_on_their_own_sample_of_a_500_hz_grid():
    """However a time is spelt, k * 0.002 or k / 500, sample k takes the k-th value."""
    count = 5000
    k = np.arange(count)
    assert np.any(k * 0.002 != k / 500.0)
    value = np.stack([k, k], axis=1) * 10.0
    for written in (k * 0.002, k / 500.0):
        made = experiment(command_time=written, command_value=value, duration=10.0)
        for grid in (k * 0.002, k / 500.0, np.linspace(0.0, (count - 1) / 500.0, count)):
            assert np.array_equal(made.command_at(grid)[:, 0], 10.0 * k)
