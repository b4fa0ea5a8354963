"""Which discrete model is fitted: ARX or output error, its orders, delay and sample time.

ARX least squares minimises the one-step prediction error. It is unbiased only if the noise enters
through 1/A(z); a sensor's white noise on the output, or a model order below the system's, biases
the poles. Output error has neither bias.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.records import Data, FrequencyRecord, SignalRecord
from pamsim.identification.separable import Held, Separable, check_held

_lfilter: Any = scipy.signal.lfilter

_SAME_RATE = 1e-3  # relative difference of two sample times that is rounding


@dataclass(frozen=True)
class DiscreteStructure:
    """``y = B(q)/A(q) u`` with noise ``1/A e`` (ARX) or plainly ``e`` (output error).

    Of output error, A is usually called F. Every trial has an offset of its own. A simulated trial
    starts at rest under its first input value, or in a state that is fitted; the prediction of ARX
    assumes nothing about what went before.

    Coordinates of ARX are a1..a_na, b1..b_nb. Those of output error begin with the first na
    coefficients of A in powers of ``1 - 1/q``: of a system sampled fast all poles are near 1, and
    a1..a_na nearly cancel.

    Raises:
        InputError: for orders out of range.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equations (25)-(29), of ARX.
    """

    kind: str  # ``arx`` or ``oe``
    na: int  # number of poles, >= 0; of output error >= 1
    nb: int  # number of input coefficients, >= 1
    nk: int  # samples between the input and its first effect, >= 0
    sample_time: float  # Ts [s]
    start: str = "rest"  # of every simulated trial: at ``rest``, or in a ``free`` state

    def __post_init__(self) -> None:
        least = 1 if self.kind == "oe" else 0
        if self.na < least or self.nb < 1 or self.nk < 0:
            raise InputError(
                f"orders {self.sentence}; give {'nf >= 1' if least else 'na >= 0'}, nb >= 1,"
                " nk >= 0"
            )

    @property
    def sentence(self) -> str:
        """The model in words."""
        if self.kind == "arx":
            return f"ARX na={self.na}, nb={self.nb}, nk={self.nk}"
        return f"output error nb={self.nb}, nf={self.na}, nk={self.nk}"

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return self.na + self.nb

    @property
    def searched(self) -> int:
        """Number of coordinates in which the prediction is not linear."""
        return self.na if self.kind == "oe" else 0

    def counted(self, trials: int) -> int:
        """Return the number of coefficients of a fit to some trials, what is their own included."""
        moving = self.kind == "oe" and self.start == "free"
        return self.unknowns + trials * (1 + self.reach * moving)

    @property
    def reach(self) -> int:
        """How many samples back the regression vector of ARX reaches: the order of the state."""
        return max(self.na, self.nk + self.nb - 1)

    def from_differences(self) -> tuple[FloatArray, FloatArray]:
        """Return c, M of ``a = c + M x``: a1..a_na of the first na coordinates x."""
        if self.kind == "arx":
            return np.zeros(self.na), np.eye(self.na)
        n = range(1, self.na + 1)
        powers = np.array([[(-1) ** j * comb(i, j) for i in (0, *n)] for j in n])
        # A's leading 1 fixes the last coefficient: they sum to 1.
        last = powers[:, -1].astype(np.float64)
        return last, powers[:, :-1] - last[:, np.newaxis]

    def delay(self, coordinates: FloatArray) -> float:
        """Return the dead time nk Ts, whatever the coordinates [s]."""
        return self.nk * self.sample_time

    def denominator(self, coordinates: FloatArray) -> FloatArray:
        """Return ``1, a1, ..., a_na``: powers of 1/z rising, or of z falling."""
        origin, matrix = self.from_differences()
        return np.append(1.0, origin + matrix @ coordinates[: self.na])

    def numerator(self, coordinates: FloatArray) -> FloatArray:
        """Return ``b1, ..., b_nb``, the delay left out."""
        return coordinates[self.na :]

    def poles(self, coordinates: FloatArray) -> tuple[complex, ...]:
        """Return the roots of A by falling magnitude [-]."""
        roots = np.roots(self.denominator(coordinates))
        return tuple(complex(z) for z in roots[np.argsort(-np.abs(roots), kind="stable")])

    def static_gains(self, coordinates: FloatArray) -> FloatArray:
        """Return ``sum(b) / (1 + sum(a))``, shape ``(1,)``; inf or nan for an integrator."""
        above, below = self.numerator(coordinates), self.denominator(coordinates)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.divide([np.sum(above)], np.sum(below))

    def continuous_poles(self, coordinates: FloatArray) -> tuple[complex | None, ...]:
        """Return ``log(z) / Ts`` of each pole [rad/s].

        None for a pole on the negative real axis or at 0: no continuous pole is sampled to it.
        """
        return tuple(
            None if z.imag == 0.0 and z.real <= 0.0 else complex(np.log(z) / self.sample_time)
            for z in self.poles(coordinates)
        )

    def slowest(self, coordinates: FloatArray) -> float:
        """Return the longest time in which a mode decays by a factor of e [s]."""
        sizes = [abs(z) for z in self.poles(coordinates) if 0.0 < abs(z) < 1.0]
        return -self.sample_time / float(np.log(max(sizes))) if sizes else self.sample_time

    def frequency_response(self, coordinates: FloatArray, frequency: FloatArray) -> NDArray[Any]:
        """Return G at frequencies, shape ``(n,)`` [rad/s] to ``(n,)`` [output per input]."""
        back = np.exp(-1j * frequency * self.sample_time)
        below = np.polyval(self.denominator(coordinates)[::-1], back)
        return np.polyval(self.numerator(coordinates)[::-1], back) / below * back**self.nk

    def step_response(self, coordinates: FloatArray, samples: int, interval: float) -> FloatArray:
        """Return the unit-step response at the model's own samples, shape ``(samples,)``."""
        return self._forced(coordinates, np.ones(samples))

    def free_run(
        self, coordinates: FloatArray, record: SignalRecord, *, offset: float | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Simulate a record, its offset (and initial state) fitted to its output.

        With an offset [output unit] the run starts at rest there and nothing is fitted. Returned
        are the output, shape ``(N,)``, and the trial's own coefficients, offset first.

        Raises:
            InputError: for another sample time.
        """
        self._require_rate(record)
        with np.errstate(over="ignore", invalid="ignore"):
            forced = self._forced(coordinates, record.input - record.input[0])
            if offset is not None:
                return forced + offset, np.array([offset])
            own = self.trial_columns(coordinates, forced.size)
            if not (np.isfinite(own).all() and np.isfinite(forced).all()):  # it explodes
                return forced, np.array([np.nan])
        coefficients: Any = np.linalg.lstsq(own, record.output - forced, rcond=None)[0]
        return forced + own @ coefficients, coefficients

    def trial_columns(self, coordinates: FloatArray, samples: int) -> FloatArray:
        """Return what each simulated trial adds of its own: an offset, the modes of a free start.

        What went before leaves impulses at the first samples, as many as the state has numbers.
        """
        constant = np.ones((samples, 1))
        if self.start == "rest" or not self.reach:
            return constant
        impulse = np.eye(1, samples)[0]
        with np.errstate(over="ignore", invalid="ignore"):
            run = _lfilter([1.0], self.denominator(coordinates), impulse)
        return np.hstack([constant, _delayed(run, range(self.reach))])

    def _forced(self, coordinates: FloatArray, given: FloatArray) -> FloatArray:
        """Simulate an input that is 0 before the record, from rest; not finite on an explosion."""
        above = np.append(np.zeros(self.nk), self.numerator(coordinates))
        return _lfilter(above, self.denominator(coordinates), given)

    def problem(self, data: Data) -> Separable:
        """Return the least-squares problem: of ARX the one-step prediction, else the free run.

        Raises:
            InputError: for a frequency response, another sample time, or too short a record.
        """
        if isinstance(data, FrequencyRecord):
            raise InputError(f"{self.sentence} is discrete; fit a continuous model to a response")
        for record in data:
            self._require_rate(record)
        if self.kind == "arx":
            blocks = [self._regression(record) for record in data]
            outputs = tuple(output for _, output in blocks)
        else:
            blocks, outputs = [], tuple(record.output for record in data)
        inputs = [record.input - record.input[0] for record in data]

        def through(x: FloatArray, i: int) -> FloatArray:
            with np.errstate(over="ignore", invalid="ignore"):
                run = _lfilter([1.0], self.denominator(x), inputs[i])
            return _delayed(run, range(self.nk, self.nk + self.nb))

        def own(x: FloatArray, i: int) -> FloatArray:
            samples = outputs[i].size
            return np.ones((samples, 1)) if blocks else self.trial_columns(x, samples)

        return Separable(
            outputs=outputs,
            shared=(lambda _, i: blocks[i][0]) if blocks else through,
            own=own,
            lower=np.full(self.searched, -np.inf),
            upper=np.full(self.searched, np.inf),
            sample_times=(self.sample_time,) * len(data),
        )

    def _require_rate(self, record: SignalRecord) -> None:
        if abs(record.sample_time - self.sample_time) > _SAME_RATE * self.sample_time:
            raise InputError(
                f"record {record.name} is sampled every {record.sample_time:g} s but the model"
                f" every {self.sample_time:g} s; resample, or fit a continuous model"
            )

    def _regression(self, record: SignalRecord) -> tuple[FloatArray, FloatArray]:
        """Regression vectors ``phi(t)`` of ARX, shape ``(m, na + nb)``, and ``y(t)``.

        Only times whose whole regression vector lies inside the record are used.

        Source: Matiskova 2021, equations (25), (26).
        """
        y, u, start = record.output, record.input, self.reach
        if y.size - start <= self.unknowns:
            raise InputError(
                f"record too short: {y.size} samples for {self.sentence}; at least"
                f" {start + self.unknowns + 1} are needed, record longer or lower the order"
            )
        past_y = [-y[start - i : y.size - i] for i in range(1, self.na + 1)]
        past_u = [u[start - i : u.size - i] for i in range(self.nk, self.nk + self.nb)]
        return np.column_stack([*past_y, *past_u]), y[start:]

    def held(self, values: Mapping[str, float]) -> Held:
        """Return what values say of the coordinates: of ``offset``, and of ARX ``K``.

        A gain g is ``sum(b) / (1 + sum(a)) = g`` (the printed G1 and G2 have g = 1).

        Raises:
            InputError: for another name.
        """
        check_held(values, ["K", "offset"] if self.kind == "arx" else ["offset"])
        count = self.unknowns - self.searched
        origin, directions = np.zeros(count), np.eye(count)
        if "K" in values:
            # sum(b) - g sum(a) = g is linear in theta: its solutions are a point and a null space.
            gain = values["K"]
            row = np.concatenate([np.full(self.na, -gain), np.ones(self.nb)])
            origin = row * (gain / float(row @ row))
            directions = np.linalg.svd(row[np.newaxis, :])[2][1:].T
        return Held(origin, directions, values.get("offset"))


def _delayed(run: FloatArray, samples: range) -> FloatArray:
    """A signal (n,) by some numbers of samples later, 0 before, as columns."""
    padded = np.concatenate([np.zeros(samples[-1]), run])
    return np.column_stack([padded[samples[-1] - k :][: run.size] for k in samples])


Structure = ContinuousStructure | DiscreteStructure
"""Which model is fitted. Its coordinates are x, which a search finds, then theta, in which the
prediction is linear; both kinds have the same methods."""
