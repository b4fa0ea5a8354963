"""What every structure of a linear model answers, a continuous and a discrete one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.identification.records import Data, SignalRecord
from pamsim.identification.separable import Held, Separable


class Structure(Protocol):
    """Which model is fitted, and what its coordinates mean.

    The coordinates are x, which a search finds, then theta, in which the prediction is linear.
    """

    @property
    def kind(self) -> str:
        """``continuous``, ``arx`` or ``oe``."""
        ...

    @property
    def sentence(self) -> str:
        """The model in words."""
        ...

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        ...

    @property
    def searched(self) -> int:
        """Number of coordinates in x."""
        ...

    @property
    def per_trial(self) -> int:
        """Number of coefficients that each trial has of its own."""
        ...

    def problem(self, data: Data) -> Separable:
        """Return the least-squares problem in (x, theta) that fits it to data."""
        ...

    def held(self, values: Mapping[str, float]) -> Held:
        """Return what known values, such as of ``K``, say of the coordinates [SI]."""
        ...

    def numerator(self, coordinates: FloatArray) -> FloatArray:
        """Return the coefficients of the only input, highest power of s or z first."""
        ...

    def denominator(self, coordinates: FloatArray) -> FloatArray:
        """Return the coefficients, highest power of s or z first."""
        ...

    def delay(self, coordinates: FloatArray) -> float:
        """Return the dead time of the only input [s]."""
        ...

    def poles(self, coordinates: FloatArray) -> tuple[complex, ...]:
        """Return the poles, slowest first: in rad/s, or in the z plane."""
        ...

    def continuous_poles(self, coordinates: FloatArray) -> tuple[complex | None, ...]:
        """Return the poles in rad/s; None where no continuous pole is sampled to one."""
        ...

    def slowest(self, coordinates: FloatArray) -> float:
        """Return the longest time in which a mode decays by a factor of e [s]."""
        ...

    def frequency_response(self, coordinates: FloatArray, frequency: FloatArray) -> NDArray[Any]:
        """Return G at frequencies, shape ``(n,)`` [rad/s] to ``(n,)`` [output per input]."""
        ...

    def step_response(self, coordinates: FloatArray, samples: int, interval: float) -> FloatArray:
        """Return the unit-step response at 0, interval, ... [s], shape ``(samples,)``."""
        ...

    def free_run(
        self,
        coordinates: FloatArray,
        record: SignalRecord,
        since: int = 0,
        offset: float | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Simulate a record from a sample on; return the output and the trial's own numbers.

        These are fitted to the record's output, the offset first, unless an offset is given.
        """
        ...
