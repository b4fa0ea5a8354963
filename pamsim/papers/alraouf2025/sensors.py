"""Alraouf 2025, its sensors: equations (5) and (6), resolutions, accuracies, critical angle."""

from __future__ import annotations

import math
from typing import TypeVar

from pamsim.core.parameters import ParameterGroup, specs
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.claim import Claim, Verdict, compare, half_unit, holds
from pamsim.papers.loop_fits import measured_width
from pamsim.signals.instruments import (
    ICE_POINT,
    Converter,
    UltrasonicRanger,
    VoltageTransducer,
    expanded_uncertainty,
    pressure_resolution,
    ranger_reading,
    ranger_temperature,
    sound_temperature_coefficient,
    speed_of_sound,
    transducer_limit,
    transducer_pressure,
    uncertainty_of_limit,
)
from pamsim.store.printed_loop import loop_instrument

Group = TypeVar("Group", bound=ParameterGroup)

_LABORATORY = (20.0, 30.0)  # deg C, printed
_METRE_TO_CM = 100.0


def claims() -> list[Claim]:
    """Claims B-54 to B-64."""
    return [
        _ends(),
        _step(),
        _limit(),
        _expanded(),
        _echo(),
        _range_accuracy(),
        _per_kelvin(),
        _laboratory(),
        _critical_angle(),
        _other_sizes(),
        _noise_floor(),
    ]


def _instrument(group: type[Group]) -> Group:
    units = {name: spec.unit for name, spec in specs(group)}
    entries = loop_instrument(group.group)
    return group(**{name: entry.si(units[name]) for name, entry in entries.items()})


def _ends() -> Claim:
    found = transducer_pressure([0.5, 4.5], _instrument(VoltageTransducer)) / PA_PER_KPA
    return compare(
        "B-54",
        "(5): 0.5 V mean 0 kPa and 4.5 V mean 500 kPa",
        (0.0, 500.0),
        [float(value) for value in found],
        half_unit(0),
        unit="kPa",
        reason="(V - 0.5) / 4.0 * 500 at both ends",
        otherwise=Verdict.INCONSISTENT,
    )


def _step() -> Claim:
    transducer, converter = _instrument(VoltageTransducer), _instrument(Converter)
    found = pressure_resolution(transducer, converter) / PA_PER_KPA
    others = {
        bits: pressure_resolution(transducer, Converter(bits=bits, span=converter.span))
        / PA_PER_KPA
        for bits in (8.0, 12.0)
    }
    listed = ", ".join(f"{bits:.0f} bits {step:.2f}" for bits, step in others.items())
    return compare(
        "B-55",
        "one step of the converter is 0.61 kPa",
        0.61,
        found,
        half_unit(2),
        unit="kPa",
        reason=f"{converter.bits:.0f} bits over {converter.span:g} V, the converter of the Arduino"
        f" Mega 2560 by its data sheet; the paper names neither (others: {listed} kPa)",
    )


def _limit() -> Claim:
    return compare(
        "B-56",
        "+-2 % of full scale is about +-10 kPa",
        10.0,
        transducer_limit(_instrument(VoltageTransducer)) / PA_PER_KPA,
        half_unit(0),
        unit="kPa",
        reason="2 % of 500 kPa",
        otherwise=Verdict.INCONSISTENT,
    )


def _expanded() -> Claim:
    limit = transducer_limit(_instrument(VoltageTransducer))
    found = expanded_uncertainty(uncertainty_of_limit(limit)) / PA_PER_KPA
    return compare(
        "B-57",
        "expanded uncertainty at 95 % (k = 2) is about +-20 kPa",
        20.0,
        found,
        half_unit(0),
        unit="kPa",
        reason=f"twice the standard uncertainty of a maker's limit, limit / sqrt(3) (GUM 4.3.7)."
        f" Printed is twice the limit itself, {2.0 * limit / PA_PER_KPA:.0f} kPa, right only if"
        " +-2 % were one standard deviation, while the text calls it the sensor's accuracy",
    )


def _echo() -> Claim:
    ranger = _instrument(UltrasonicRanger)
    found = ranger_temperature(ranger) - ICE_POINT
    low, high = _LABORATORY
    return Claim(
        id="B-58",
        what="(6): L = t / 58, true in the laboratory at 20 to 30 deg C",
        printed=_LABORATORY,
        recomputed=found,
        unit="degC",
        verdict=holds(low <= found <= high, Verdict.INCONSISTENT),
        reason="temperature at which 58 us/cm, there and back, is the speed of sound in dry air,"
        f" {2.0 / ranger.echo_time_per_length:.1f} m/s",
    )


def _range_accuracy() -> Claim:
    accuracy = _instrument(UltrasonicRanger).accuracy
    wave = float(speed_of_sound(ICE_POINT + _LABORATORY[0])) / 40e3
    return Claim(
        id="B-59",
        what="accuracy of the distance sensor is about 3 mm",
        printed=1e3 * accuracy,
        recomputed=None,
        unit="mm",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="quoted from a data sheet; no repeated readings of a known length are printed. It is"
        f" {accuracy / wave:.2f} of a wavelength at 40 kHz, the usual frequency of such sensors",
    )


def _per_kelvin() -> Claim:
    low, high = (ICE_POINT + value for value in _LABORATORY)
    found = 100.0 * sound_temperature_coefficient(low)
    return compare(
        "B-60",
        "+-0.175 % of the distance per kelvin, from the speed of sound",
        0.175,
        found,
        half_unit(3),
        unit="%/K",
        reason="1 / (2 T) of an ideal gas at 20 deg C,"
        f" {100.0 * sound_temperature_coefficient(high):.4f} at 30 deg C; the rule of"
        f" thumb 0.6 m/s per kelvin over 343 m/s gives {100.0 * 0.6 / 343.0:.4f}",
    )


def _laboratory() -> Claim:
    ranger = _instrument(UltrasonicRanger)
    cold, warm = (
        float(ranger_reading(0.30, ICE_POINT + value, ranger)) * _METRE_TO_CM
        for value in _LABORATORY
    )
    width = measured_width()
    return Claim(
        id="B-61",
        what="the loop was measured at 20 to 30 deg C: change of a 30 cm reading over that range",
        printed="20 to 30 deg C",
        recomputed=cold - warm,
        unit="cm",
        verdict=holds(cold - warm <= 0.1 * width, Verdict.NOT_REPRODUCIBLE),
        reason="fall of the ultrasonic reading of 30 cm of air between both temperatures, more than"
        f" the whole loop of Table 2 is wide ({width:.3f} cm); the temperature during the runs is"
        " not printed, so the loop cannot be told from a drift. Harmless: a tenth of the width",
        tolerance=0.1 * width,
    )


def _critical_angle() -> Claim:
    return compare(
        "B-62",
        "critical braid angle between contracting and lengthening muscles",
        54.7,
        math.acos(1.0 / math.sqrt(3.0)) * DEG_PER_RAD,
        half_unit(1),
        unit="deg",
        reason="angle at which the volume of a braid of inextensible fibres is largest, dV/dl = 0:"
        " cos^2 = 1/3",
    )


def _other_sizes() -> Claim:
    return Claim(
        id="B-63",
        what="the model can be used for muscles of other sizes of the same materials",
        printed="can be used with different sizes",
        recomputed=None,
        unit="",
        verdict=Verdict.NOT_REPRODUCIBLE,
        reason="one muscle was measured; a0 and a3 of (3) and (4) are lengths in cm of that"
        " muscle, and no rule that scales them is given",
    )


def _noise_floor() -> Claim:
    transducer, converter = _instrument(VoltageTransducer), _instrument(Converter)
    share = pressure_resolution(transducer, converter) / transducer_limit(transducer)
    return Claim(
        id="B-64",
        what="the converter's step is negligible beside the sensor's accuracy; their ratio",
        printed="negligible",
        recomputed=share,
        unit="1",
        verdict=holds(share <= 0.1, Verdict.INCONSISTENT),
        reason="step over the limit of +-2 % of full scale; at most a tenth counted as negligible",
        tolerance=0.1,
    )
