"""What encoder and converter make of a signal."""

from __future__ import annotations

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
from tests.unit.recordings.drawn_recording import drawn_recording

# Matiskova 2021, sections 2.3 and 2.4: 2500 increments, 14 bits over 20 V, 100 kPa/V
CHAIN = MeasurementChain(
    encoder_increments=2500.0, converter_bits=14.0, converter_span=20.0, transducer_gain=1e5
)


def test_the_papers_chain_has_the_papers_steps():
    assert CHAIN.pressure_step == pytest.approx(122.0703125, rel=1e-15)  # 0.12207 kPa
    increment = 2.0 * math.pi / CHAIN.encoder_increments
    assert math.degrees(increment) == pytest.approx(0.144, rel=1e-14)
    reported = encode_angle([0.5 * increment, 1.5 * increment], CHAIN.encoder_increments)
    assert np.degrees(reported) == pytest.approx([0.0, 0.144])


@pytest.mark.parametrize("increments", [4.0, 360.0, 2500.0, 1e7])
def test_encoder_reports_whole_increments_at_most_one_below(increments):
    angle = np.random.default_rng(2).uniform(-7.0, 7.0, 5000)
    step = 2.0 * math.pi / increments
    reported = encode_angle(angle, increments)
    lag = (angle - reported) / step
    assert np.all(lag > -1e-7)  # 1e-7: rounding of an angle that is an increment itself
    assert np.all(lag < 1.0 + 1e-7)
    assert lag.min() < 0.1 < 0.9 < lag.max()
    counts = reported / step
    assert counts == pytest.approx(np.round(counts), abs=1e-7)


@pytest.mark.parametrize("step", [CHAIN.pressure_step, 610.0])
def test_converter_is_at_most_half_a_step_off(step):
    pressure = np.random.default_rng(3).uniform(0.0, 7e5, 5000)
    reported = convert_pressure(pressure, step)
    error = (reported - pressure) / step
    assert np.all(np.abs(error) <= 0.5 + 1e-9)
    assert error.min() < -0.45
    assert error.max() > 0.45
    assert reported / step == pytest.approx(np.round(reported / step), abs=1e-9)


def recording() -> Recording:
    names = SignalNames(joints={"shaft": "angle"}, muscles=("muscle_1", "muscle_2"))
    return drawn_recording(names)


def test_a_measured_recording_differs_only_in_what_the_rig_measures():
    true = recording()
    seen = measured(true, CHAIN)
    assert np.array_equal(seen.angle, encode_angle(true.angle, 2500.0))
    assert np.array_equal(seen.pressure, convert_pressure(true.pressure, CHAIN.pressure_step))
    assert not np.array_equal(seen.angle, true.angle)
    for field in dataclasses.fields(Recording):
        if field.name not in ("positions", "pressure"):
            assert getattr(seen, field.name) is getattr(true, field.name)


def test_instruments_that_do_not_err_give_the_signals_themselves():
    true = recording()
    seen = distorted(true, MeasurementChain())
    assert seen.positions is true.positions
    assert seen.pressure is true.pressure
    assert np.array_equal(measured(true, MeasurementChain()).angle, true.angle)  # nothing rounds
    half = measured(true, MeasurementChain(encoder_increments=2500.0))
    assert np.array_equal(half.angle, encode_angle(true.angle, 2500.0))
    assert np.array_equal(half.pressure, true.pressure)


def test_lag_scale_and_bias_act_on_their_own_signal_in_that_order():
    true = recording()
    angle = {"angle_lag": 0.03, "angle_scale": 1.1, "angle_bias": 0.02}
    pressure = {"pressure_lag": 0.01, "pressure_scale": 0.9, "pressure_bias": -4e3}
    seen = distorted(true, MeasurementChain(**angle, **pressure))
    np.testing.assert_allclose(
        seen.angle, 0.02 + 1.1 * lagged(true.time, true.angle, 0.03), rtol=1e-13
    )
    np.testing.assert_allclose(
        seen.pressure, 0.9 * lagged(true.time, true.pressure, 0.01) - 4e3, rtol=1e-13
    )
    assert distorted(true, MeasurementChain(**angle)).pressure is true.pressure
    assert distorted(true, MeasurementChain(**pressure)).positions is true.positions
    seen = measured(true, dataclasses.replace(CHAIN, angle_bias=0.02))
    assert np.array_equal(seen.angle, encode_angle(true.angle + 0.02, 2500.0))  # erring, then round


def test_a_bent_scale_changes_over_the_range_and_is_undone_exactly():
    bent = MeasurementChain(
        angle_scale=1.1, angle_bend=-0.2, angle_bias=0.02, pressure_scale=0.9, pressure_bend=3e-7
    )
    angle, pressure = np.linspace(-0.6, 0.6, 7), np.linspace(0.0, 6e5, 7)
    seen = read_at_rest(angle, bent, "angle")
    np.testing.assert_allclose(seen, 0.02 + 1.1 * angle - 0.2 * angle**2, rtol=1e-13)
    np.testing.assert_allclose(true_at_rest(seen, bent, "angle"), angle, atol=1e-14)
    shown = read_at_rest(pressure, bent, "pressure")
    np.testing.assert_allclose(shown, 0.9 * pressure + 3e-7 * pressure**2, rtol=1e-13)
    back = true_at_rest(shown, bent, "pressure")
    np.testing.assert_allclose(back, pressure, rtol=1e-12, atol=1e-9)
    assert true_at_rest(9.0, bent, "angle") == pytest.approx(2.0 * 8.98 / 1.1)  # none reads so much


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


def test_a_ramp_is_seen_later_by_the_lag_and_a_step_falls_short_by_an_e_th():
    time = np.linspace(0.0, 2.0, 401)
    assert lagged(time, 3.0 * time, 0.05)[-1] == pytest.approx(3.0 * (2.0 - 0.05), rel=1e-12)
    jump = np.column_stack([np.ones(401), np.zeros(401)])
    jump[0] = 0.0, 1.0
    seen = lagged(np.concatenate([[-1e-9], time[:-1]]), jump, 0.1)
    at = 21  # 0.1 s after the jump
    assert seen[at] == pytest.approx([1.0 - math.exp(-1.0), math.exp(-1.0)], rel=1e-6)


def test_an_angle_behind_backlash_stays_at_each_reversal_for_all_of_it():
    there = np.array([0.0, 0.3, 1.0, 0.9, 0.8, 0.75, 0.0, 0.1, 0.3])
    seen = through_backlash(there, 0.2)
    np.testing.assert_allclose(seen, [0.0, 0.2, 0.9, 0.9, 0.9, 0.85, 0.1, 0.1, 0.2], atol=1e-15)
    assert through_backlash(there, 0.0) is there
    both = np.column_stack([there, -there])
    np.testing.assert_array_equal(through_backlash(both, 0.2), np.column_stack([seen, -seen]))


def test_backlash_that_is_seen_depends_on_turning_points_alone_and_small_swings_show_none_of_it():
    way = np.concatenate([np.linspace(0.0, 0.5, 40), np.linspace(0.5, -0.2, 90)])
    seen = through_backlash(way, 0.1)
    coarse = through_backlash(way[[0, 39, 129]], 0.1)
    np.testing.assert_allclose(seen[[0, 39, 129]], coarse, atol=1e-15)
    assert np.ptp(through_backlash(0.04 * np.sin(np.arange(50.0)), 0.1)) == 0.0


def test_a_clock_that_is_off_shows_the_angle_later_and_the_pressures_as_they_are():
    true = recording()  # sampled every 4 ms
    seen = distorted(true, MeasurementChain(clock_offset=12e-3))
    np.testing.assert_allclose(seen.angle[3:], true.angle[:-3], atol=1e-12)
    assert np.array_equal(seen.angle[:3], np.full(3, true.angle[0]))
    assert seen.pressure is true.pressure
    early = distorted(true, MeasurementChain(clock_offset=-6e-3))
    halfway = 0.5 * (true.angle[1:-1] + true.angle[2:])
    np.testing.assert_allclose(early.angle[:-2], halfway, atol=1e-12)
    assert shifted(true.time, true.positions, 0.0) is true.positions


def test_backlash_lies_before_lag_and_scale_and_the_clock_behind_them():
    true = recording()
    wrong = {"angle_backlash": 0.2, "angle_lag": 0.03, "angle_scale": 1.1, "clock_offset": 8e-3}
    seen = distorted(true, MeasurementChain(**wrong))
    turned = 1.1 * lagged(true.time, through_backlash(true.angle, 0.2), 0.03)
    np.testing.assert_allclose(seen.angle[2:], turned[:-2], atol=1e-12)
    assert seen.pressure is true.pressure


def test_a_dead_channel_stands_still_from_its_time_on_and_from_the_first_sample_if_it_is_all_dead():
    true = recording()
    seen = distorted(true, MeasurementChain(angle_dead_share=0.4, pressure_dead_share=1.0))
    last = 0.6 * true.time[-1]
    alive = true.time <= last
    assert np.array_equal(seen.angle[alive], true.angle[alive])
    np.testing.assert_allclose(seen.angle[~alive], np.interp(last, true.time, true.angle))
    assert np.array_equal(seen.pressure, np.tile(true.pressure[0], (30, 1)))
    assert dying(true.time, true.positions, 0.0) is true.positions
    wrong = {"clock_offset": 4e-3, "angle_dead_share": 0.5}  # it is logged by its own clock
    late = shifted(true.time, true.angle, 4e-3)
    seen = distorted(true, MeasurementChain(**wrong))
    np.testing.assert_allclose(seen.angle, dying(true.time, late, 0.5), atol=1e-15)
    # A search needs the derivative by when it dies, which is the signal's.
    time = np.linspace(0.0, 2.0, 21)
    one, other = (dying(time, 3.0 * time, share)[-1] for share in (0.3, 0.301))
    assert one - other == pytest.approx(3.0 * 2.0 * 0.001, rel=1e-9)


def test_a_rig_without_sensors_measures_nothing_and_half_a_converter_is_refused():
    with refused("[sensor]"):
        measured(recording(), None)
    with refused("sensor.converter_span", error=ParameterError):
        MeasurementChain(converter_bits=14.0, transducer_gain=1e5)


def test_the_offset_of_an_encoder_is_the_mean_of_its_error():
    rng = np.random.default_rng(3)
    true = 0.2 * np.sin(np.linspace(0.0, 9.0, 4000)) + 1e-3 * rng.standard_normal(4000)
    reading = np.round(encode_angle(true, 2500.0), 6)  # as in a file
    offset = encoder_offset(reading, 2500.0)
    assert offset == pytest.approx(-math.pi / 2500.0, rel=1e-12)
    assert np.mean(reading - true) == pytest.approx(offset, abs=0.02 * abs(offset))
    assert encoder_offset(true, 2500.0) == 0.0  # not in steps
    assert encoder_offset(np.zeros(50), 2500.0) == 0.0  # no steps to see
    assert encoder_offset(reading, 0.0) == 0.0


def test_a_lag_is_taken_off_a_smooth_signal():
    time, lag = np.arange(0.0, 3.0, 0.002), 0.04
    true = 2e5 + 1e5 * np.sin(5.0 * time)
    late = lagged(time, true, lag)
    settled = time > 10.0 * lag
    np.testing.assert_allclose(ahead_of_lag(time, late, lag)[settled], true[settled], rtol=5e-3)
    assert np.max(np.abs(late - true)[settled]) > 0.15e5
    np.testing.assert_array_equal(ahead_of_lag(time, late, 0.0), late)
