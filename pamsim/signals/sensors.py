"""What the rig's instruments make of a signal: incremental encoder, transducer and converter."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.core.recording import Recording


@dataclass(frozen=True, kw_only=True)
class MeasurementChain(ParameterGroup):
    """Encoder and pressure conversion of a rig."""

    group: ClassVar[str] = "sensor"
    encoder_increments: float = parameter(
        unit="1", low=4.0, high=1e7, doc="encoder increments per revolution"
    )
    converter_bits: float = parameter(unit="1", low=4.0, high=32.0, doc="bits of the converter")
    converter_span: float = parameter(
        unit="V", low=0.0, high=100.0, low_open=True, doc="width of the converter's input range"
    )
    transducer_gain: float = parameter(
        unit="Pa/V", low=0.0, high=1e7, low_open=True, doc="pressure per volt of the transducer"
    )

    @property
    def pressure_step(self) -> float:
        """Smallest difference of pressure the converter tells apart [Pa]."""
        return self.converter_span / 2.0**self.converter_bits * self.transducer_gain


def encode_angle(angle: ArrayLike, increments: float) -> NDArray[np.float64]:
    """Angle an incremental encoder reports: whole increments, counted towards zero-crossing edges.

    Args:
        angle: (...) true angle [rad].
        increments: per revolution.

    Returns:
        (...) reported angle [rad], at most one increment below the true one.
    """
    step = 2.0 * math.pi / increments
    return np.floor(np.asarray(angle, dtype=float) / step) * step


def convert_pressure(pressure: ArrayLike, step: float) -> NDArray[np.float64]:
    """Pressure behind a converter that rounds to its step.

    Args:
        pressure: (...) true pressure [Pa].
        step: smallest difference told apart [Pa].

    Returns:
        (...) reported pressure [Pa], at most half a step off.
    """
    return np.round(np.asarray(pressure, dtype=float) / step) * step


def measured(recording: Recording, chain: MeasurementChain | None) -> Recording:
    """A recording as the rig's instruments would have taken it.

    Args:
        recording: of the true signals.
        chain: encoder and converter.

    Returns:
        A copy with angle and pressures as reported; velocity and tension, which the rig does not
        measure, stay as they are.

    Raises:
        InputError: if the rig declares no measurement chain.
    """
    if chain is None:
        raise InputError("this rig declares no sensors; add a [sensor] table to its params.toml")
    return dataclasses.replace(
        recording,
        angle=encode_angle(recording.angle, chain.encoder_increments),
        pressure=convert_pressure(recording.pressure, chain.pressure_step),
    )
