"""A log whose clock is uneven, put on an even one."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import InputError
from pamsim.recordings.even_clock import on_even_clock
from pamsim.recordings.trial import Trial


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


def test_what_was_measured_lies_on_the_line_between_rows():
    log, even = uneven(), on_even_clock(uneven(), "50 Hz", "here")
    np.testing.assert_allclose(np.diff(even.time), 0.02)
    assert log.time[-1] - 0.02 < even.time[-1] <= log.time[-1]
    np.testing.assert_allclose(even.measured["angle"], 0.3 * even.time, atol=1e-12)


def test_a_step_of_the_command_is_at_the_nearest_sample_and_stays_a_step():
    even = on_even_clock(uneven(), "50 Hz", "here")
    assert set(even.command.ravel()) == {1e4, 3e4}
    step = even.time[np.flatnonzero(np.diff(even.command[:, 0]))[0] + 1]
    assert abs(step - 1.234) < 0.02


def test_measured_pressures_that_drive_are_interpolated():
    even = on_even_clock(uneven("measured"), "90 Hz", "here")
    assert len(set(even.command.ravel())) > 2


@pytest.mark.parametrize("rate", [50, "50 s", "0 Hz", "-5 Hz", "200 Hz", "nan Hz"])
def test_a_rate_that_means_nothing_or_more_than_there_is_is_refused(rate):
    with pytest.raises(InputError, match="here"):
        on_even_clock(uneven(), rate, "here")
