"""What encoder and converter make of a signal."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pamsim.core.errors import ParameterError
from pamsim.recordings.recording import Recording
from pamsim.recordings.sensors import (
    MeasurementChain,
    ahead_of_lag,
    convert_pressure,
    distorted,
    dying,
    encode_angle,
    encoder_offset,
    lagged,
    measured,
    read_at_rest,
    shifted,
    through_backlash,
    true_at_rest,
)
from pamsim.recordings.signals import SignalNames
from tests.unit.core.refusals import refused
from tests.unit.physics.splines import by_scipy
from tests.unit.recordings.drawn_recording import drawn_recording

# Matiskova 2021, sections 2.3 and 2.4: 2500 increments, 14 bits over 20 V, 100 kPa/V
CHAIN = MeasurementChain(
    encoder_increments=2500.0, converter_bits=14.0, converter_span=20.0, transducer_gain=1e5
)
TRUE = drawn_recording(SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2")))


def test_an_encoder_is_at_most_a_step_below_and_a_converter_half_a_step_off():
    assert CHAIN.pressure_step == pytest.approx(122.0703125, rel=1e-15)  # the paper's 0.12207 kPa
    draw = np.random.default_rng(2)
    for increments in (4.0, 360.0, 2500.0, 1e7):
        angle, step = draw.uniform(-7.0, 7.0, 5000), 2.0 * math.pi / increments
        reported = encode_angle(angle, increments)
        lag = (angle - reported) / step
        assert np.all((lag > -1e-7) & (lag < 1.0 + 1e-7))  # the rounding of an exact increment
        assert lag.min() < 0.1 < 0.9 < lag.max()
        assert reported / step == pytest.approx(np.round(reported / step), abs=1e-7)
    for step in (CHAIN.pressure_step, 610.0):
        pressure = draw.uniform(0.0, 7e5, 5000)
        reported = convert_pressure(pressure, step)
        error = (reported - pressure) / step
        assert -0.5 - 1e-9 <= error.min() < -0.45 < 0.45 < error.max() <= 0.5 + 1e-9
        assert reported / step == pytest.approx(np.round(reported / step), abs=1e-9)


def test_a_measured_recording_differs_only_in_what_the_rig_measures():
    seen = measured(TRUE, dataclasses.replace(CHAIN, angle_bias=0.02))
    # It errs first and is rounded then.
    assert np.array_equal(seen.angle, encode_angle(TRUE.angle + 0.02, 2500.0))
    assert np.array_equal(seen.pressure, convert_pressure(TRUE.pressure, CHAIN.pressure_step))
    for field in dataclasses.fields(Recording):
        if field.name not in ("positions", "pressure"):
            assert getattr(seen, field.name) is getattr(TRUE, field.name)
    half = measured(TRUE, MeasurementChain(encoder_increments=2500.0))
    assert np.array_equal(half.angle, encode_angle(TRUE.angle, 2500.0))
    assert np.array_equal(half.pressure, TRUE.pressure)
    with refused("[sensor]"):
        measured(TRUE, None)
    with refused("sensor.converter_span", error=ParameterError):
        MeasurementChain(converter_bits=14.0, transducer_gain=1e5)


def test_errors_follow_each_other_as_the_signal_passes_the_instruments():
    angle = {"angle_backlash": 0.2, "angle_lag": 0.03, "angle_scale": 1.1, "angle_bend": -0.2}
    angle |= {"angle_bias": 0.02, "clock_offset": 6e-3, "angle_dead_share": 0.4}
    pressure = {"pressure_lag": 0.01, "pressure_scale": 0.9, "pressure_bend": 3e-7}
    pressure |= {"pressure_bias": -4e3, "pressure_dead_share": 0.3}
    seen = distorted(TRUE, MeasurementChain(**angle, **pressure))
    late = lagged(TRUE.time, through_backlash(TRUE.angle, 0.2), 0.03)
    read = shifted(TRUE.time, 0.02 + 1.1 * late - 0.2 * late**2, 6e-3)  # logged by its own clock
    np.testing.assert_allclose(seen.angle, dying(TRUE.time, read, 0.4), atol=1e-12)
    late = lagged(TRUE.time, TRUE.pressure, 0.01)
    read = 0.9 * late + 3e-7 * late**2 - 4e3
    np.testing.assert_allclose(seen.pressure, dying(TRUE.time, read, 0.3), rtol=1e-12)
    assert distorted(TRUE, MeasurementChain(**angle)).pressure is TRUE.pressure
    assert distorted(TRUE, MeasurementChain(**pressure)).positions is TRUE.positions
    for same in (dying, shifted):
        assert same(TRUE.time, TRUE.positions, 0.0) is TRUE.positions
    assert through_backlash(TRUE.positions, 0.0) is TRUE.positions


def test_a_bent_scale_is_undone_exactly():
    bent = MeasurementChain(
        angle_scale=1.1, angle_bend=-0.2, angle_bias=0.02, pressure_scale=0.9, pressure_bend=3e-7
    )
    angle, pressure = np.linspace(-0.6, 0.6, 7), np.linspace(0.0, 6e5, 7)
    seen = read_at_rest(angle, bent, "angle")
    np.testing.assert_allclose(seen, 0.02 + 1.1 * angle - 0.2 * angle**2, rtol=1e-13)
    np.testing.assert_allclose(true_at_rest(seen, bent, "angle"), angle, atol=1e-14)
    back = true_at_rest(read_at_rest(pressure, bent, "pressure"), bent, "pressure")
    np.testing.assert_allclose(back, pressure, rtol=1e-12, atol=1e-9)
    assert true_at_rest(9.0, bent, "angle") == pytest.approx(2.0 * 8.98 / 1.1)  # none reads so much


def test_a_learned_error_of_the_angle_is_a_curve_over_the_true_angle_and_undone():
    numbers = np.random.default_rng(8).normal(size=8) * 0.02
    values = {f"learned_{k}": c for k, c in enumerate(numbers.tolist(), start=1)}
    plain = {"angle_scale": 1.1, "angle_bend": -0.2, "angle_bias": 0.02}
    chain = MeasurementChain(learned_low=-0.5, learned_high=0.4, **plain, **values)
    angle = np.linspace(-0.6, 0.5, 41)
    seen = read_at_rest(angle, chain, "angle")
    error = by_scipy(numbers, (-0.5, 0.4), np.clip(angle, -0.5, 0.4))
    assert seen == pytest.approx(read_at_rest(angle, MeasurementChain(**plain), "angle") + error)
    assert true_at_rest(seen, chain, "angle") == pytest.approx(angle, abs=1e-11)
    two = true_at_rest(seen.reshape(-1, 1), chain, "angle")
    assert np.array_equal(two[:, 0], true_at_rest(seen, chain, "angle"))
    assert np.array_equal(read_at_rest(angle, chain, "pressure"), angle)
    assert not MeasurementChain(**values).learns
    assert np.array_equal(distorted(TRUE, MeasurementChain(**values)).angle, TRUE.angle)


@pytest.mark.parametrize("lag", [1e-4, 0.02, 3.0])
def test_lag_is_the_differential_equation_at_any_times(lag):
    """y' = (x - y) / tau with x straight between samples, by scipy's integrator."""
    rng = np.random.default_rng(7)
    time = np.cumsum(rng.uniform(1e-3, 0.05, 8))
    true = rng.normal(size=8)

    def rate(t, y):
        return (np.interp(t, time, true) - y) / lag

    options = {"method": "Radau", "rtol": 1e-9, "atol": 1e-10, "jac": [[-1.0 / lag]]}
    expected = [true[0]]
    for one, two in pairwise(time):  # no interval hides a kink
        expected.append(solve_ivp(rate, (one, two), expected[-1:], **options).y[0, -1])
    np.testing.assert_allclose(lagged(time, true, lag), expected, atol=1e-8)
    both = lagged(time, np.column_stack([true, -true]), lag)
    np.testing.assert_allclose(both[:, 0], -both[:, 1], atol=1e-12)


def test_a_lag_is_taken_off_a_smooth_signal():
    time, lag = np.arange(0.0, 3.0, 0.002), 0.04
    true = 2e5 + 1e5 * np.sin(5.0 * time)
    late = lagged(time, true, lag)
    settled = time > 10.0 * lag
    np.testing.assert_allclose(ahead_of_lag(time, late, lag)[settled], true[settled], rtol=5e-3)
    np.testing.assert_array_equal(ahead_of_lag(time, late, 0.0), late)


def test_an_angle_behind_backlash_stays_at_each_reversal_for_all_of_it():
    there = np.array([0.0, 0.3, 1.0, 0.9, 0.8, 0.75, 0.0, 0.1, 0.3])
    seen = through_backlash(there, 0.2)
    np.testing.assert_allclose(seen, [0.0, 0.2, 0.9, 0.9, 0.9, 0.85, 0.1, 0.1, 0.2], atol=1e-15)
    both = np.column_stack([there, -there])
    np.testing.assert_array_equal(through_backlash(both, 0.2), np.column_stack([seen, -seen]))
    assert np.ptp(through_backlash(0.04 * np.sin(np.arange(50.0)), 0.1)) == 0.0  # small swings


def test_a_clock_that_is_off_shows_the_angle_later_or_earlier():
    late = shifted(TRUE.time, TRUE.angle, 12e-3)  # sampled every 4 ms
    np.testing.assert_allclose(late[3:], TRUE.angle[:-3], atol=1e-12)
    assert np.array_equal(late[:3], np.full(3, TRUE.angle[0]))
    early = shifted(TRUE.time, TRUE.angle, -6e-3)
    halfway = 0.5 * (TRUE.angle[1:-1] + TRUE.angle[2:])
    np.testing.assert_allclose(early[:-2], halfway, atol=1e-12)


def test_a_dead_channel_stands_still_from_its_time_on():
    seen, last = dying(TRUE.time, TRUE.angle, 0.4), 0.6 * TRUE.time[-1]
    alive = TRUE.time <= last
    assert np.array_equal(seen[alive], TRUE.angle[alive])
    np.testing.assert_allclose(seen[~alive], np.interp(last, TRUE.time, TRUE.angle))
    all_dead = dying(TRUE.time, TRUE.pressure, 1.0)
    assert np.array_equal(all_dead, np.tile(TRUE.pressure[0], (30, 1)))
    # A search needs the derivative by when it dies, which is the signal's.
    time = np.linspace(0.0, 2.0, 21)
    one, other = (dying(time, 3.0 * time, share)[-1] for share in (0.3, 0.301))
    assert one - other == pytest.approx(3.0 * 2.0 * 0.001, rel=1e-9)


def test_the_offset_of_an_encoder_is_the_mean_of_its_error():
    rng = np.random.default_rng(3)
    true = 0.2 * np.sin(np.linspace(0.0, 9.0, 4000)) + 1e-3 * rng.standard_normal(4000)
    reading = np.round(encode_angle(true, 2500.0), 6)  # as in a file
    offset = encoder_offset(reading, 2500.0)
    assert offset == pytest.approx(-math.pi / 2500.0, rel=1e-12)
    assert np.mean(reading - true) == pytest.approx(offset, abs=0.02 * abs(offset))
    # A log whose sign was turned counts up to the angle.
    assert encoder_offset(-reading, 2500.0, turned=True) == -offset
    assert np.mean(-reading - -true) == pytest.approx(-offset, abs=0.02 * abs(offset))
    for seen, increments in ((true, 2500.0), (np.zeros(50), 2500.0), (reading, 0.0)):
        assert encoder_offset(seen, increments) == 0.0  # no steps to see
