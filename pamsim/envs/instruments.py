"""What is seen of the arms: lag, scale, bias, noise and rounding of the rig's instruments."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pamsim.envs.episode import NOISE
from pamsim.envs.settings import ArmSettings
from pamsim.signals.sensors import MeasurementChain, convert_pressure, encode_angle

FloatArray = NDArray[np.float64]


class Instruments:
    """Encoder and pressure transducers of arms that are looked at together.

    Args:
        settings: noise, and whether encoder and converter round.
        chain: of the rig; None if it states none.
        arms: how many.
        period: between samples [s].
    """

    def __init__(
        self, settings: ArmSettings, chain: MeasurementChain | None, arms: int, period: float
    ) -> None:
        own = chain or MeasurementChain()
        rounds = settings.instruments
        self._increments = own.encoder_increments if rounds else 0.0
        self._step = own.pressure_step if rounds else 0.0
        self._period = period
        self._scale, self._bias = np.ones((arms, 3)), np.zeros((arms, 3))
        self._done, self._along = np.ones((arms, 3)), np.ones((arms, 3))
        self._noise = np.array([settings.angle_noise, *[settings.pressure_noise] * 2])
        self._noisy = bool(self._noise.any())
        self._lagging = self._erring = False
        self._true, self._held = np.zeros((arms, 3)), np.zeros((arms, 3))

    def begin(self, arm: int, chain: MeasurementChain | None, true: FloatArray) -> None:
        """Begin at rest: an arm's own errors, and the true signals (3,) that its lags hold."""
        own = chain or MeasurementChain()
        self._scale[arm] = own.angle_scale, own.pressure_scale, own.pressure_scale
        self._bias[arm] = own.angle_bias, own.pressure_bias, own.pressure_bias
        for column, lag in enumerate((own.angle_lag, own.pressure_lag, own.pressure_lag)):
            ratio = self._period / lag if lag > 0.0 else math.inf
            done = -math.expm1(-ratio)
            self._done[arm, column] = done
            self._along[arm, column] = 1.0 - done / ratio
        self._true[arm] = self._held[arm] = true
        self._lagging |= own.angle_lag > 0.0 or own.pressure_lag > 0.0
        self._erring |= bool((self._scale[arm] != 1.0).any() or (self._bias[arm] != 0.0).any())

    def see(self, true: FloatArray, row: FloatArray) -> FloatArray:
        """What the instruments show one period after they were last asked.

        Args:
            true: (n, 3) angle [rad] and pressures [Pa].
            row: (n, columns) of the episodes' tables, for the noise.

        Returns:
            (n, 3) the same, measured.
        """
        if not self._lagging:
            return self.shown(true, row)
        # Exact for signals that are straight between the samples.
        held = self._held + self._done * (self._true - self._held)
        self._held = np.where(self._done == 1.0, true, held + self._along * (true - self._true))
        self._true = true
        return self.shown(self._held, row)

    def shown(self, signal: FloatArray, row: FloatArray) -> FloatArray:
        """What the instruments make of a signal (n, 3) behind their lags."""
        seen = signal
        if self._erring:
            seen = self._scale * seen + self._bias
        if self._noisy:
            seen = seen + self._noise * row[:, NOISE:]
        if self._increments > 0.0 or self._step > 0.0:
            seen = seen.copy()
            if self._increments > 0.0:
                seen[:, 0] = encode_angle(seen[:, 0], self._increments)
            if self._step > 0.0:
                seen[:, 1:] = convert_pressure(seen[:, 1:], self._step)
        return seen
