"""Alraouf 2025, its sensors: equations (5) and (6), resolutions, accuracies, critical angle."""

from __future__ import annotations

import math
from typing import TypeVar

from pamsim.core.parameters import ParameterGroup, Sourced, specs
from pamsim.core.units import DEG_PER_RAD, PA_PER_KPA
from pamsim.papers.alraouf2025.loop import measured_width
from pamsim.papers.claim import Recomputed, recomputes
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
from pamsim.store.printed import printed_document

Group = TypeVar("Group", bound=ParameterGroup)

_LABORATORY = (20.0, 30.0)  # deg C, printed
_METRE_TO_CM = 100.0


def _instrument(group: type[Group]) -> Group:
    units = {name: spec.unit for name, spec in specs(group)}
    where = f"alraouf2025.toml, {group.group}"
    entries = printed_document("alraouf2025.toml")[group.group]
    return group(
        **{name: Sourced(where=where, **entry).si(units[name]) for name, entry in entries.items()}
    )


@recomputes("alraouf2025-54")
def _ends() -> Recomputed:
    found = transducer_pressure([0.5, 4.5], _instrument(VoltageTransducer)) / PA_PER_KPA
    return Recomputed([float(value) for value in found])


@recomputes("alraouf2025-55")
def _step() -> Recomputed:
    transducer, converter = _instrument(VoltageTransducer), _instrument(Converter)
    found = pressure_resolution(transducer, converter) / PA_PER_KPA
    others = {
        bits: pressure_resolution(transducer, Converter(bits=bits, span=converter.span))
        / PA_PER_KPA
        for bits in (8.0, 12.0)
    }
    listed = ", ".join(f"{bits:.0f} bits {step:.2f}" for bits, step in others.items())
    return Recomputed(found, bits=converter.bits, span=converter.span, listed=listed)


@recomputes("alraouf2025-56")
def _limit() -> Recomputed:
    return Recomputed(transducer_limit(_instrument(VoltageTransducer)) / PA_PER_KPA)


@recomputes("alraouf2025-57")
def _expanded() -> Recomputed:
    limit = transducer_limit(_instrument(VoltageTransducer))
    found = expanded_uncertainty(uncertainty_of_limit(limit)) / PA_PER_KPA
    return Recomputed(found, twice=2.0 * limit / PA_PER_KPA)


@recomputes("alraouf2025-58")
def _echo() -> Recomputed:
    ranger = _instrument(UltrasonicRanger)
    found = ranger_temperature(ranger) - ICE_POINT
    low, high = _LABORATORY
    return Recomputed(found, holds=low <= found <= high, speed=2.0 / ranger.echo_time_per_length)


@recomputes("alraouf2025-59")
def _range_accuracy() -> Recomputed:
    accuracy = _instrument(UltrasonicRanger).accuracy
    wave = float(speed_of_sound(ICE_POINT + _LABORATORY[0])) / 40e3
    return Recomputed(None, share=accuracy / wave)


@recomputes("alraouf2025-60")
def _per_kelvin() -> Recomputed:
    low, high = (ICE_POINT + value for value in _LABORATORY)
    found = 100.0 * sound_temperature_coefficient(low)
    return Recomputed(
        found, warm=100.0 * sound_temperature_coefficient(high), rule=100.0 * 0.6 / 343.0
    )


@recomputes("alraouf2025-61")
def _laboratory() -> Recomputed:
    ranger = _instrument(UltrasonicRanger)
    cold, warm = (
        float(ranger_reading(0.30, ICE_POINT + value, ranger)) * _METRE_TO_CM
        for value in _LABORATORY
    )
    width = measured_width()
    return Recomputed(
        cold - warm, holds=cold - warm <= 0.1 * width, tolerance=0.1 * width, width=width
    )


@recomputes("alraouf2025-62")
def _critical_angle() -> Recomputed:
    return Recomputed(math.acos(1.0 / math.sqrt(3.0)) * DEG_PER_RAD)


@recomputes("alraouf2025-64")
def _noise_floor() -> Recomputed:
    transducer, converter = _instrument(VoltageTransducer), _instrument(Converter)
    share = pressure_resolution(transducer, converter) / transducer_limit(transducer)
    return Recomputed(share, holds=share <= 0.1)
