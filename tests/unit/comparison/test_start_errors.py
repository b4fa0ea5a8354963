"""Starts read from noisy samples: which trials share one, and what is put right."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pamsim.comparison.start_errors import start_error, start_groups
from pamsim.recordings.start_pressures import start_pressures
from tests.unit.recordings.made_trial import made_trial

COUNT, NOISE = 400, 500.0
TIME = 0.01 * np.arange(COUNT)


def trial(seed=0, *, start=(2e5, 3e5), noise=NOISE, drift=0.0, name="one", load=0.0, kind="valve"):
    rng = np.random.default_rng(seed)
    slow = np.exp(-TIME)[:, np.newaxis] * np.array(start)
    white = rng.normal(0.0, noise, slow.shape)
    measured = slow + lfilter([np.sqrt(1.0 - drift**2)], [1.0, -drift], white, axis=0)
    one, two = measured.T
    read = {"pressure_1": one, "pressure_2": two, "angle": 1e-6 * (one - two)}
    return made_trial(np.zeros((COUNT, 2)), read, name=name, drive=kind, load=load)


def model(start):
    """The plant of `trial` without noise, from a start: signals and their sensitivity."""
    slow = np.exp(-TIME)
    signals = {
        "pressure_1": slow * start[0],
        "pressure_2": slow * start[1],
        "angle": 1e-6 * slow * (start[0] - start[1]),
    }
    none = np.zeros(COUNT)
    sensitivities = {
        "pressure_1": np.column_stack([slow, none]),
        "pressure_2": np.column_stack([none, slow]),
        "angle": 1e-6 * np.column_stack([slow, -slow]),
    }
    return signals, sensitivities


BOTH = np.array([2e5, 3e5])


def adjusted(one, read, channels):
    """What a model that starts as read has, put right; and what it has from the true start."""
    for muscle, start in enumerate(read, start=1):
        one.measured[f"pressure_{muscle}"][0] = start
    signals, sensitivities = model(read)
    found = start_error(one, read, signals).adjusted(one, signals, sensitivities, channels)
    return found, signals, model(BOTH)[0]


def test_a_wrong_start_is_put_right_to_a_fraction_of_the_noise():
    one = trial(4)
    off = np.array([1.6, -1.2]) * NOISE
    found, signals, exact = adjusted(one, BOTH + off, tuple(one.measured))
    for name in ("pressure_1", "pressure_2", "angle"):
        left = np.abs(found[name] - exact[name]).max()
        assert left < 0.2 * np.abs(signals[name] - exact[name]).max()
    # Of a drifting sensor, a first value is off by all of what is small from sample to sample.
    drifts = trial(4, drift=0.9)
    found, _, exact = adjusted(drifts, BOTH + np.array([2.0, -2.0]) * NOISE, tuple(one.measured))
    for name in ("pressure_1", "pressure_2"):
        assert np.abs(found[name] - exact[name]).max() < 0.5 * NOISE


def test_what_the_sensor_cannot_be_wrong_by_stays():
    """A misfit far beyond the noise is the model's, and must not be blamed on the start."""
    one = trial(1)
    signals, sensitivities = model((2e5, 3e5))
    wrong = {name: values * 0.8 for name, values in signals.items()}
    found = start_error(one, np.array([2e5, 3e5]), wrong).adjusted(
        one, wrong, sensitivities, ("pressure_1",)
    )
    moved = abs(found["pressure_1"][0] - wrong["pressure_1"][0])
    assert moved < 5.0 * NOISE < 0.1 * (0.2 * 2e5)


def test_channels_that_are_not_compared_have_no_say():
    one = trial(2)
    signals, sensitivities = model((2e5, 3e5))
    spoilt = {**signals, "angle": signals["angle"] + 1.0}
    known = start_error(one, np.array([2e5, 3e5]))
    pressures = ("pressure_1", "pressure_2")
    with_angle, without = (
        known.adjusted(one, s, sensitivities, pressures)["pressure_1"] for s in (spoilt, signals)
    )
    assert np.array_equal(with_angle, without)


def test_a_start_without_noise_is_taken_as_read_and_rounding_is_noise():
    one = trial(noise=0.0)
    assert np.all(start_error(one, BOTH).spread < 1e-3 * BOTH)
    set_point = made_trial(np.full((COUNT, 2), 1e5), {"angle": np.zeros(COUNT)})
    assert np.array_equal(start_error(set_point, np.array([1e5, 1e5])).spread, [0.0, 0.0])
    signals, sensitivities = model(BOTH)
    found = start_error(set_point, BOTH).adjusted(set_point, signals, sensitivities, ("angle",))
    assert all(np.array_equal(found[name], signals[name]) for name in signals)
    digit = 1200.0
    rounded = {name: np.round(v / digit) * digit for name, v in one.measured.items()}
    coarse = replace(one, measured={**rounded, "angle": one.measured["angle"]})
    assert np.all(start_error(coarse, BOTH).spread >= digit / np.sqrt(12.0))


def test_repeats_share_a_start_if_their_first_samples_differ_by_noise_only():
    repeats = [trial(seed, name=str(seed)) for seed in range(3)]
    ((start, members),) = start_groups(repeats)
    assert members == [0, 1, 2]
    assert start == pytest.approx(np.mean([start_pressures(t) for t in repeats], axis=0))
    drifting = [trial(seed, drift=0.95, name=str(seed)) for seed in range(6)]
    assert [m for _, m in start_groups(drifting)] == [[0, 1, 2, 3, 4, 5]]
    other = trial(9, start=(2.2e5, 3e5), name="9")
    loaded = trial(10, load=1.0, name="10")
    assert [m for _, m in start_groups([*repeats, other, loaded])] == [[0, 1, 2], [3], [4]]
