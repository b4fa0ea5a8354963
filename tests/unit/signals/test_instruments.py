"""Instruments: conversions invert, steps count, uncertainties are those of drawn errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pamsim.core.errors import ParameterError
from pamsim.signals.instruments import (
    ICE_POINT,
    Converter,
    IncrementalEncoder,
    UltrasonicRanger,
    VoltageTransducer,
    converter_step,
    encoder_step,
    expanded_uncertainty,
    pressure_resolution,
    ranged_length,
    ranger_reading,
    ranger_temperature,
    sound_temperature_coefficient,
    speed_of_sound,
    transducer_limit,
    transducer_pressure,
    uncertainty_of_limit,
    uncertainty_of_resolution,
)

TRANSDUCER = VoltageTransducer(zero_voltage=0.5, span_voltage=4.0, full_scale=5e5, accuracy=0.02)
RANGER = UltrasonicRanger(echo_time_per_length=58e-6 / 0.01, accuracy=3e-3)


def test_transducer_is_linear_through_both_ends():
    assert transducer_pressure([0.5, 2.5, 4.5], TRANSDUCER) == pytest.approx([0.0, 2.5e5, 5e5])
    assert transducer_limit(TRANSDUCER) == pytest.approx(1e4)


@pytest.mark.parametrize(("bits", "span"), [(10.0, 5.0), (14.0, 20.0), (8.0, 1.0)])
def test_converter_has_two_to_the_bits_steps_in_its_span(bits, span):
    converter = Converter(bits=bits, span=span)
    assert converter_step(converter) * 2.0**bits == span
    volts = converter_step(converter)
    step = transducer_pressure(1.0 + volts, TRANSDUCER) - transducer_pressure(1.0, TRANSDUCER)
    assert pressure_resolution(TRANSDUCER, converter) == pytest.approx(float(step), rel=1e-9)


def test_encoder_step_times_increments_is_a_turn():
    assert 2500.0 * encoder_step(IncrementalEncoder(increments=2500.0)) == pytest.approx(math.tau)


def test_speed_of_sound_and_its_temperature_coefficient_belong_together():
    assert float(speed_of_sound(293.15)) == pytest.approx(343.2, abs=0.1)  # textbooks, 20 deg C
    h = 1e-3
    for temperature in (250.0, 293.15, 320.0):
        logs = np.log(speed_of_sound([temperature - h, temperature + h]))
        slope = (logs[1] - logs[0]) / (2.0 * h)
        assert sound_temperature_coefficient(temperature) == pytest.approx(slope, rel=1e-7)


def test_ranger_reads_true_at_its_own_temperature_and_short_in_warm_air():
    own = ranger_temperature(RANGER)
    lengths = np.array([0.02, 0.3, 4.0])
    assert ranger_reading(lengths, own, RANGER) == pytest.approx(lengths, rel=1e-12)
    assert 20.0 < own - ICE_POINT < 25.0
    warm = ranger_reading(lengths, own + 1.0, RANGER)
    assert warm / lengths - 1.0 == pytest.approx(-sound_temperature_coefficient(own), rel=5e-3)


def test_printed_rule_is_58_microseconds_per_centimetre():
    assert float(ranged_length(580e-6, RANGER)) == pytest.approx(0.1)


def test_uncertainties_are_the_scatter_of_uniform_errors():
    rng = np.random.default_rng(5)
    drawn = rng.uniform(-1e4, 1e4, 200_000)
    assert uncertainty_of_limit(1e4) == pytest.approx(drawn.std(), rel=0.01)
    values = rng.uniform(0.0, 1e5, 200_000)
    rounded = np.round(values / 610.0) * 610.0
    assert uncertainty_of_resolution(610.0) == pytest.approx((rounded - values).std(), rel=0.01)
    assert expanded_uncertainty(3.0, 4.0) == pytest.approx(10.0)


def test_impossible_instruments_are_refused_by_name():
    with pytest.raises(ParameterError, match=r"transducer\.full_scale"):
        VoltageTransducer(zero_voltage=0.5, span_voltage=4.0, full_scale=0.0, accuracy=0.02)
    with pytest.raises(ParameterError, match=r"ranger\.echo_time_per_length"):
        UltrasonicRanger(echo_time_per_length=0.0, accuracy=3e-3)
