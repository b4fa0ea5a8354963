"""Signals as the rig's instruments report them: their errors, encoder and converter."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
from numpy.typing import ArrayLike

from pamsim.core.errors import InputError, ParameterError
from pamsim.core.parameters import ParameterGroup, quantity
from pamsim.core.units import FloatArray
from pamsim.physics.hysteresis.maxwell_slip import play
from pamsim.physics.spline import shares
from pamsim.recordings.recording import Recording

CONTROLS = 8
"""Control values of a learned error of the angle: bends in a seventh of the range."""

_SETTLED, _ROUNDS = 1e-12, 60
"""Change of a true angle [rad or m] at which a search for it ends, and its rounds at most: an error
that grows by half as much as the angle takes 40."""

_ON_INCREMENT = 0.02
"""Share of an increment by which written angles may miss it, as rounded in a file."""


class MeasurementChain(ParameterGroup, group="sensor"):
    """Encoder and pressure conversion of a rig, and their errors."""

    encoder_increments: float = quantity(
        "[0, 1e7]", "encoder increments per revolution; 0 if unknown", 0.0
    )
    converter_bits: float = quantity("[0, 32]", "bits of the converter; 0 if unknown", 0.0)
    converter_span: float = quantity("[0, 100] V", "width of the converter's input range", 0.0)
    transducer_gain: float = quantity("[0, 1e7] Pa/V", "pressure per volt of the transducer", 0.0)
    angle_bias: float = quantity("[-3.2, 3.2] rad", "reported minus true angle at zero", 0.0)
    angle_scale: float = quantity("[0.1, 10]", "reported per true change of angle", 1.0)
    angle_bend: float = quantity(
        "[-10, 10] 1/rad", "half of the change of that scale per true angle", 0.0
    )
    angle_lag: float = quantity("[0, 10] s", "time constant of the reported angle", 0.0)
    angle_backlash: float = quantity(
        "[0, 1] rad", "travel that a reversing joint makes before its encoder follows", 0.0
    )
    clock_offset: float = quantity(
        "[-10, 10] s", "time by which the log of angles is late against that of pressures", 0.0
    )
    angle_dead_share: float = quantity(
        "[0, 1]",
        "share of a recording, up to its end, in which the reported angles stand still",
        0.0,
    )
    learned_low: float = quantity("[-100, 100] rad", "true angle at which its curve begins", 0.0)
    learned_high: float = quantity("[-100, 100] rad", "true angle at which it ends", 0.0)
    learned_1: float = quantity(
        "[-3.2, 3.2] rad", "control value of a further error over the true angle, first", 0.0
    )
    learned_2: float = quantity("[-3.2, 3.2] rad", "second", 0.0)
    learned_3: float = quantity("[-3.2, 3.2] rad", "third", 0.0)
    learned_4: float = quantity("[-3.2, 3.2] rad", "fourth", 0.0)
    learned_5: float = quantity("[-3.2, 3.2] rad", "fifth", 0.0)
    learned_6: float = quantity("[-3.2, 3.2] rad", "sixth", 0.0)
    learned_7: float = quantity("[-3.2, 3.2] rad", "seventh", 0.0)
    learned_8: float = quantity("[-3.2, 3.2] rad", "eighth", 0.0)
    pressure_bias: float = quantity("[-1e6, 1e6] Pa", "reported minus true pressure at zero", 0.0)
    pressure_scale: float = quantity("[0.1, 10]", "reported per true change of pressure", 1.0)
    pressure_bend: float = quantity(
        "[-1e-5, 1e-5] 1/Pa", "half of the change of that scale per true pressure", 0.0
    )
    pressure_lag: float = quantity("[0, 10] s", "time constant of the reported pressures", 0.0)
    pressure_dead_share: float = quantity(
        "[0, 1]",
        "share of a recording, up to its end, in which the reported pressures stand still",
        0.0,
    )

    def __post_init__(self) -> None:
        """Check every field, and that a converter is stated whole; ParameterError names what."""
        super().__post_init__()
        names = ("converter_bits", "converter_span", "transducer_gain")
        missing = [name for name in names if getattr(self, name) == 0.0]
        if 0 < len(missing) < len(names):
            raise ParameterError(
                f"sensor.{missing[0]} is missing: a converter is stated by {', '.join(names)}, all"
                " above 0, or by none of them"
            )

    @property
    def pressure_step(self) -> float:
        """Resolution of the converter as a pressure [Pa]; 0 if unknown."""
        return self.converter_span / 2.0**self.converter_bits * self.transducer_gain

    @property
    def learns(self) -> bool:
        """Whether there is a learned error of the angle."""
        return self.learned_high > self.learned_low

    @property
    def learned(self) -> tuple[float, ...]:
        """Ends and control values of a learned error of the angle, see `pamsim.physics.spline`."""
        values = [getattr(self, f"learned_{k}") for k in range(1, CONTROLS + 1)]
        return self.learned_low, self.learned_high, *values


def lagged(time: ArrayLike, signal: ArrayLike, lag: float) -> FloatArray:
    """A signal (n,) or (n, m) behind a first-order lag [s], at rest before its first sample.

    Exact at the given times (n,) [s], uniform or not, for a signal that is straight between them;
    a lag of 0 gives the signal itself.
    """
    true = np.asarray(signal, dtype=float)
    if lag == 0.0 or len(true) == 0:
        return true
    ratio = np.diff(np.asarray(time, dtype=float)) / lag
    done = -np.expm1(-ratio)  # share of a jump that is made up within an interval
    along = 1.0 - done / ratio  # share of a change that is spread evenly over it
    reported = np.empty_like(true)
    reported[0] = held = true[0]
    for k, (share, part) in enumerate(zip(done.tolist(), along.tolist(), strict=True)):
        held = held + share * (true[k] - held) + part * (true[k + 1] - true[k])
        reported[k + 1] = held
    return reported


def ahead_of_lag(time: ArrayLike, reading: ArrayLike, lag: float) -> FloatArray:
    """The signal (k,) that a first-order lag [s] has turned into a reading (k,).

    The reading, at times (k,) [s], has to be smooth, without noise; a lag of 0 gives it itself.
    """
    read = np.asarray(reading, dtype=float)
    return read + lag * np.gradient(read, np.asarray(time, dtype=float)) if lag else read


def through_backlash(signal: ArrayLike, backlash: float) -> FloatArray:
    """A signal (n,) or (n, m) behind a coupling with backlash, in whose middle it begins.

    The play operator of half the backlash, whose output depends on the turning points alone. They
    have to be among the samples. The backlash is the dead travel at a reversal, in the signal's
    unit; 0 gives the signal itself.
    """
    true = np.asarray(signal, dtype=float)
    if backlash == 0.0 or len(true) == 0:
        return true
    columns = [
        list(itertools.accumulate(column, lambda held, x: play(x, held, 0.5 * backlash)))
        for column in true.reshape(len(true), -1).T.tolist()
    ]
    return np.array(columns).T.reshape(true.shape)


def shifted(time: ArrayLike, signal: ArrayLike, offset: float) -> FloatArray:
    """A signal (n,) or (n, m) as a clock that is late by a constant offset [s] logs it.

    It is straight between its samples (n,) [s], and holds its first and last value beyond them.
    """
    at = np.asarray(time, dtype=float)
    return _at(at - offset, at, signal) if offset else np.asarray(signal, dtype=float)


def dying(time: ArrayLike, signal: ArrayLike, share: float) -> FloatArray:
    """A signal (n,) or (n, m) of a channel that stands still in the last share of its time.

    It is straight between its samples (n,) [s], so that the rest depends smoothly on when it dies;
    a share of 1 is all of it.
    """
    at = np.asarray(time, dtype=float)
    if share == 0.0 or len(at) == 0:
        return np.asarray(signal, dtype=float)
    return _at(np.minimum(at, at[-1] - share * (at[-1] - at[0])), at, signal)


def _at(when: FloatArray, time: FloatArray, signal: ArrayLike) -> FloatArray:
    """A signal (n,) or (n, m), straight between its samples, at other times (n,)."""
    true = np.asarray(signal, dtype=float)
    if len(true) == 0:
        return true
    columns = true.reshape(len(true), -1).T
    return np.array([np.interp(when, time, one) for one in columns]).T.reshape(true.shape)


def encode_angle(angle: ArrayLike, increments: float) -> FloatArray:
    """Angle (...) [rad], in whole increments, so many per revolution, up to the true one (...)."""
    step = 2.0 * math.pi / increments
    return np.floor(np.asarray(angle, dtype=float) / step) * step


def encoder_offset(reading: ArrayLike, increments: float, *, turned: bool = False) -> float:
    """Mean of reported less true angle of an encoder that counts whole increments [rad].

    Half an increment below, whatever the sensor's zero, and as much above where its sign has been
    ``turned``: what is left of the steps has mean 0, as has the error of a converter that rounds.
    It is 0 for readings (n,) [rad] that do not come in
    whole increments, such as simulated ones, and if the increments per revolution are stated as 0.
    """
    if increments == 0.0:
        return 0.0
    step = 2.0 * math.pi / increments
    counts = np.asarray(reading, dtype=float) / step
    whole = np.abs(counts - np.round(counts)) <= _ON_INCREMENT
    if not whole.all() or np.ptp(np.round(counts)) == 0.0:
        return 0.0
    return 0.5 * step if turned else -0.5 * step


def convert_pressure(pressure: ArrayLike, step: float) -> FloatArray:
    """Pressure (...) [Pa] behind a converter that rounds to its step [Pa]."""
    return np.round(np.asarray(pressure, dtype=float) / step) * step


def quantised(recording: Recording, chain: MeasurementChain) -> Recording:
    """A recording in whole steps of a rig's encoder and converter, where they are known."""
    positions, pressure = recording.positions, recording.pressure
    if chain.encoder_increments > 0.0:
        turns = np.array([kind == "angle" for kind in recording.joints.values()])
        positions = np.where(turns, encode_angle(positions, chain.encoder_increments), positions)
    if chain.pressure_step > 0.0:
        pressure = convert_pressure(pressure, chain.pressure_step)
    return dataclasses.replace(recording, positions=positions, pressure=pressure)


def distorted(recording: Recording, chain: MeasurementChain) -> Recording:
    """A recording as instruments with errors report it.

    A coupling's backlash comes first, then the lag, then the scale with its bend, the bias and what
    was learned, then the clock that the angles are logged by, while commands and pressures share
    the other one, and last what is dead of a channel. Instruments without errors report the same
    arrays.
    """
    turned = through_backlash(recording.positions, chain.angle_backlash)
    turned = read_at_rest(lagged(recording.time, turned, chain.angle_lag), chain, "angle")
    turned = shifted(recording.time, turned, chain.clock_offset)
    pressed = lagged(recording.time, recording.pressure, chain.pressure_lag)
    pressed = read_at_rest(pressed, chain, "pressure")
    return dataclasses.replace(
        recording,
        positions=dying(recording.time, turned, chain.angle_dead_share),
        pressure=dying(recording.time, pressed, chain.pressure_dead_share),
    )


def read_at_rest(true: FloatArray, chain: MeasurementChain, of: str) -> FloatArray:
    """Reading (...) at rest of a true ``pressure`` [Pa] or ``angle`` [rad or m] (...)."""
    scale, bend, bias = _errors(chain, of)
    read = true
    if (scale, bend, bias) != (1.0, 0.0, 0.0):
        read = (scale + bend * true) * true + bias
    return read + _learned_error(true, chain) if of == "angle" and chain.learns else read


def true_at_rest(reading: ArrayLike, chain: MeasurementChain, of: str) -> FloatArray:
    """Invert a sensor at rest: the ``pressure`` [Pa] or ``angle`` [rad or m] behind a reading.

    Readings and results have one shape, any. Of two true values with one reading it is the one on
    the branch that holds zero.
    """
    read = np.asarray(reading, dtype=float)
    true = _without_learned(read, chain, of)
    if of != "angle" or not chain.learns:
        return true
    # Each round takes off the error at the last one's angle.
    for _ in range(_ROUNDS):
        before = true
        true = _without_learned(read - _learned_error(before, chain), chain, of)
        if np.all(np.abs(true - before) <= _SETTLED):
            break
    return true


def _without_learned(reading: FloatArray, chain: MeasurementChain, of: str) -> FloatArray:
    scale, bend, bias = _errors(chain, of)
    read = reading - bias
    if bend == 0.0:
        return read / scale
    # Beyond the turning point of the parabola no true value has such a reading: that point.
    return 2.0 * read / (scale + np.sqrt(np.maximum(scale * scale + 4.0 * bend * read, 0.0)))


def _learned_error(true: FloatArray, chain: MeasurementChain) -> FloatArray:
    low, high, *values = chain.learned
    return (shares(true.ravel(), low, high, CONTROLS) @ values).reshape(true.shape)


def _errors(chain: MeasurementChain, of: str) -> tuple[float, float, float]:
    """Scale, bend and bias of a sensor."""
    scale, bend, bias = (getattr(chain, f"{of}_{name}") for name in ("scale", "bend", "bias"))
    return scale, bend, bias


def measured(recording: Recording, chain: MeasurementChain | None) -> Recording:
    """A recording as the rig's instruments would have measured it.

    Positions and pressures are as reported, and unrounded by an encoder or converter that is not
    known; velocities and tensions, which the rig does not measure, stay as they are.

    Raises:
        InputError: if the rig declares no measurement chain.
    """
    if chain is None:
        raise InputError("this rig declares no sensors; add a [sensor] table to its params.toml")
    return quantised(distorted(recording, chain), chain)
