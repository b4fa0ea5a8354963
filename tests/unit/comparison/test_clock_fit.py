"""Two clocks of one signal: what was planted comes back, what they do not determine is refused."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pamsim.comparison.clock_fit import fit_clock
from pamsim.core.errors import InputError


def signal(rng):
    """A signal that changes in about 2 s, and never in the same way twice."""
    at = np.arange(-60.0, 120.0, 2.0)
    return CubicSpline(at, rng.normal(size=at.size))


def two_records(seed, rate):
    """Of a signal of size 1, at 25 and 17 Hz with noise of 2 %, the second turned and scaled."""
    rng = np.random.default_rng(seed)
    offset, true = rng.uniform(-10.0, 12.0), signal(rng)
    time, other = np.arange(0.0, 40.0, 0.04), np.arange(3.0, 33.0, 1.0 / 17.0)
    first = true(time) + 0.02 * rng.normal(size=time.size)
    second = 7.0 - 3.0 * (true(offset + rate * other) + 0.02 * rng.normal(size=other.size))
    return offset + 500.0, fit_clock(time + 500.0, first, other, second)


def test_intervals_hold_the_planted_offset_and_rate():
    held = []
    for seed in range(30):
        rate = 1.0 + 8e-5 * (seed % 3 - 1)
        offset, found = two_records(seed, rate)
        assert found.offset_error < 0.02  # half a sample
        assert found.correlation > 0.99
        held.append(abs(found.offset - offset) <= found.offset_error)
        held.append(abs(found.rate - rate) <= found.rate_error)
    assert sum(held) >= 53  # of 60; fewer have a probability of 1 in 100 at 95 %


def test_what_the_logs_do_not_determine_is_refused():
    rng = np.random.default_rng(0)
    time, true = np.arange(0.0, 30.0, 0.02), signal(rng)
    noise = 0.02 * rng.normal(size=(2, time.size))
    for seen, why in (
        (np.sin(2.0 * np.pi * (time - 0.4) / 5.0) + noise[1], "record something that happens once"),
        (rng.normal(size=time.size), "the logs share no such signal"),
        (np.ones_like(time), "stands still"),
    ):
        first = (
            np.sin(2.0 * np.pi * time / 5.0)
            if why == "record something that happens once"
            else true(time)
        )
        with pytest.raises(InputError, match=why):
            fit_clock(time, first + noise[0], time, seen)
    gap = np.where(time > 15.0, time + 1e5, time)
    with pytest.raises(InputError, match="cut the log"):
        fit_clock(gap, true(time), time, true(time))
