"""Which continuous model is fitted: order, zeros, dead time, real or any stable poles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.linear.held_input import chain_derivatives, chain_modes
from pamsim.linear.signal_record import SignalRecord

FloatArray = NDArray[np.float64]

HIGHEST_ORDER = 5
STARTS = ("rest", "free")


@dataclass(frozen=True)
class ContinuousStructure:
    """``G(s) = (b0 + b1 s + ... + bm s^m) exp(-L s) / D(s)``, ``D(0) = 1``, all poles stable.

    Coordinates: one logarithm per pole coordinate, then L [s] if there is a dead time, then
    b0..bm. Pole coordinates are ``ln T`` of each lag, or ``ln wn, ln zeta`` of each pair followed
    by ``ln T`` if the order is odd.

    Attributes:
        order: n, 1 to 5.
        zeros: m < n, so that no input reaches the output at once.
        dead_time: whether L is free; otherwise it is 0.
        real_lags: whether all poles are real and negative.
    """

    order: int
    zeros: int = 0
    dead_time: bool = False
    real_lags: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.order <= HIGHEST_ORDER:
            raise InputError(f"order = {self.order}; give 1 to {HIGHEST_ORDER}")
        if not 0 <= self.zeros < self.order:
            raise InputError(
                f"zeros = {self.zeros} of order {self.order}; give 0 to {self.order - 1}"
            )

    @property
    def pairs(self) -> int:
        """Number of (wn, zeta) pairs."""
        return 0 if self.real_lags else self.order // 2

    @property
    def searched(self) -> int:
        """Number of coordinates the output is not linear in."""
        return self.order + int(self.dead_time)

    @property
    def sentence(self) -> str:
        """The model in words."""
        poles = f"{self.order} real lag(s)" if self.real_lags else f"order {self.order}"
        zeros = f", {self.zeros} zero(s)" if self.zeros else ""
        return poles + zeros + (", dead time" if self.dead_time else "")

    def constants(self, coordinates: FloatArray) -> NDArray[Any]:
        """Return T_1..T_n of ``D = prod(T_i s + 1)``, complex where a pair oscillates [s]."""
        values = np.exp(coordinates[: self.order])
        if not self.pairs:
            return values
        result: list[complex] = []
        for wn, zeta in values[: 2 * self.pairs].reshape(-1, 2):
            root = np.sqrt(complex(zeta**2 - 1.0))
            # zeta - root cancels for zeta >> 1; the product of both roots is 1.
            result += [(zeta + root) / wn, 1.0 / (zeta + root) / wn]
        result += list(values[2 * self.pairs :])
        constants: Any = np.array(result)
        return constants.real if np.all(constants.imag == 0.0) else constants

    def delay(self, coordinates: FloatArray) -> float:
        """Return L [s]."""
        return float(coordinates[self.order]) if self.dead_time else 0.0

    def denominator(self, coordinates: FloatArray) -> FloatArray:
        """Return D's coefficients, highest power first, shape ``(n + 1,)``."""
        result: NDArray[Any] = np.array([1.0])
        for constant in self.constants(coordinates):
            result = np.convolve(result, [constant, 1.0])
        return np.real(result)

    def numerator(self, coordinates: FloatArray) -> FloatArray:
        """Return bm..b0, shape ``(m + 1,)``."""
        return coordinates[self.searched :][::-1]

    def responses(self, coordinates: FloatArray, record: SignalRecord) -> FloatArray:
        """Return the outputs for b = 1 of each numerator power, from rest, shape ``(N, m + 1)``."""
        return chain_derivatives(
            self.constants(coordinates),
            record.input - record.input[0],
            record.sample_time,
            count=self.zeros + 1,
            dead_time=self.delay(coordinates),
            hold=record.hold,
        )

    def unknown_start(
        self, coordinates: FloatArray, record: SignalRecord, start: str
    ) -> FloatArray:
        """Return what each trial adds of its own: an offset, and the modes if it starts free.

        Returns:
            Shape ``(N, 1)`` for ``rest``, ``(N, 1 + n)`` for ``free``.
        """
        offset = np.ones((record.output.size, 1))
        if start == "rest":
            return offset
        modes = chain_modes(self.constants(coordinates), record.output.size, record.sample_time)
        return np.hstack([offset, modes])

    def free_run(
        self, coordinates: FloatArray, record: SignalRecord, start: str
    ) -> tuple[FloatArray, FloatArray]:
        """Simulate a record, its offset (and initial state) fitted to its output.

        Args:
            coordinates: shape ``(k,)``.
            record: the trial.
            start: ``rest`` or ``free``.

        Returns:
            Output, shape ``(N,)``, and the trial's own coefficients, offset first.
        """
        forced = self.responses(coordinates, record) @ coordinates[self.searched :]
        own = self.unknown_start(coordinates, record, start)
        coefficients: Any = np.linalg.lstsq(own, record.output - forced, rcond=None)[0]
        return forced + own @ coefficients, coefficients
