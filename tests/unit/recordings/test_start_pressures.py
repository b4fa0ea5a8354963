"""Where a trial begins: its first reading, or all readings until something moves."""

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.start_pressures import resting_rows, start_pressures
from tests.unit.recordings.made_trial import made_trial

RATE, NOISE, START = 100.0, 300.0, np.array([2e5, 1e5])


def trial(command, drive, *, leak=0.0, seed=0):
    """Two muscles at rest as long as the command does not change; one leaks [Pa/s]."""
    command = np.asarray(command, dtype=float)
    rng, time = np.random.default_rng(seed), np.arange(len(command)) / RATE
    pressure = START + NOISE * rng.standard_normal((time.size, 2))
    pressure[:, 0] -= leak * time
    measured = {"pressure_1": pressure[:, 0], "pressure_2": pressure[:, 1]}
    return made_trial(command, measured, drive=drive)


def errors(count, drive, rows, **more):
    command = np.zeros((200, 2))
    command[rows:, 1] = 1.0
    return np.array(
        [start_pressures(trial(command, drive, seed=k, **more)) - START for k in range(count)]
    )


@pytest.mark.parametrize("drive", ["valve", "pulse", "sealed"])
@pytest.mark.parametrize("leak", [0.0, 2e3])
def test_readings_at_rest_give_the_start_together_also_of_air_that_leaks(drive, leak):
    found = errors(200, drive, 80, leak=leak)
    assert np.abs(found.mean(axis=0)) == pytest.approx(0.0, abs=4.0 * 90.0 / np.sqrt(200))
    assert found.std(axis=0) == pytest.approx(2.0 * NOISE / np.sqrt(50), rel=0.2)


def test_rows_count_until_a_command_changes_and_few_are_no_rest():
    command = np.zeros((200, 2))
    for rows, expected in ((10, 1), (20, 20), (80, 50)):
        command[:] = 0.0
        command[rows:, 1] = -1.0
        assert resting_rows(trial(command, "valve")) == expected
    assert resting_rows(trial(np.zeros((200, 2)), "sealed")) == 50


@pytest.mark.parametrize("drive", ["valve", "pressure_set", "measured"])
def test_where_air_flows_from_the_first_row_on_the_first_reading_is_the_start(drive):
    one = trial(np.full((200, 2), 0.5), drive)
    assert resting_rows(one) == 1
    first = [one.measured[f"pressure_{i}"][0] for i in (1, 2)]
    assert start_pressures(one) == pytest.approx(first)


def test_air_that_nothing_shows_is_asked_for_in_words_that_can_be_followed():
    """A shut muscle has no command that could give its pressure."""
    for drive, words in (("sealed", "record p2_kpa$"), ("valve", "record p2_kpa, or command")):
        bare = trial(np.zeros((200, 2)), drive)
        bare.measured.pop("pressure_2")
        with pytest.raises(InputError, match=f"start pressure of muscle 2: {words}"):
            start_pressures(bare)
