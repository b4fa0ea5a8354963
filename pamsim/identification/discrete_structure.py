"""Which discrete model is fitted: ARX or output error, its orders, delay and sample time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any, ClassVar

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.separable_fit import Linearised, Separable, linearise
from pamsim.identification.signal_record import SignalRecord
from pamsim.inference.record_checks import finite_samples
from pamsim.inference.trial_noise import WHITE, TrialNoise

_lfilter: Any = scipy.signal.lfilter


@dataclass(frozen=True)
class DiscreteStructure:
    """``y = B(q)/A(q) u`` with noise ``1/A e`` (ARX) or plainly ``e`` (output error).

    Coordinates are a1..a_na, then b1..b_nb. Of output error, A is usually called F. Every trial
    starts at rest under its first input value and has an offset of its own.

    Attributes:
        kind: ``arx`` or ``oe``.
        na: number of poles.
        nb: number of input coefficients.
        nk: samples between the input and its first effect.
        sample_time: Ts [s].
    """

    per_trial: ClassVar[int] = 1

    kind: str
    na: int
    nb: int
    nk: int
    sample_time: float

    @property
    def sentence(self) -> str:
        """The model in words."""
        if self.kind == "arx":
            return f"ARX na={self.na}, nb={self.nb}, nk={self.nk}"
        return f"output error nb={self.nb}, nf={self.na}, nk={self.nk}"

    @property
    def reach(self) -> int:
        """How many samples back the regression vector of ARX reaches."""
        return max(self.na, self.nk + self.nb - 1)

    def delay(self, coordinates: FloatArray) -> float:
        """Return the dead time nk Ts, whatever the coordinates [s]."""
        return self.nk * self.sample_time

    def denominator(self, coordinates: FloatArray) -> FloatArray:
        """Return ``1, a1, ..., a_na``: powers of 1/z rising, or of z falling."""
        return np.append(1.0, coordinates[: self.na])

    def numerator(self, coordinates: FloatArray) -> FloatArray:
        """Return ``b1, ..., b_nb``, the delay left out."""
        return coordinates[self.na :]

    def poles(self, coordinates: FloatArray) -> tuple[complex, ...]:
        """Return the roots of A by falling magnitude [-]."""
        roots = np.roots(self.denominator(coordinates))
        return tuple(complex(z) for z in roots[np.argsort(-np.abs(roots), kind="stable")])

    def static_gain(self, coordinates: FloatArray) -> float:
        """Return ``sum(b) / (1 + sum(a))`` [output per input]; inf or nan for an integrator."""
        a, b = np.split(coordinates, [self.na])
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.divide(np.sum(b), 1.0 + float(np.sum(a))))

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
        return self.forced(coordinates, np.ones(samples))

    def free_run(
        self, coordinates: FloatArray, record: SignalRecord
    ) -> tuple[FloatArray, FloatArray]:
        """Simulate a record from rest at its first input; return the output and ``[offset]``.

        The offset is fitted to the record's output.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            forced = self.forced(coordinates, record.input - record.input[0])
            offset = float(np.mean(record.output - forced))
        return forced + offset, np.array([offset])

    def forced(self, coordinates: FloatArray, given: FloatArray) -> FloatArray:
        """Simulate an input that is 0 before the record, from rest; not finite on an explosion."""
        numerator = np.append(np.zeros(self.nk), self.numerator(coordinates))
        return _lfilter(numerator, self.denominator(coordinates), given)

    def problem(self, records: Sequence[SignalRecord]) -> Separable:
        """Return the least-squares problem of output error: theta is b1..b_nb.

        x determines F as `from_differences` says.
        """
        inputs = [record.input - record.input[0] for record in records]
        constant, matrix = from_differences(self.na)

        def shared(x: FloatArray, i: int) -> FloatArray:
            with np.errstate(over="ignore", invalid="ignore"):
                through = _lfilter([1.0], np.append(1.0, constant + matrix @ x), inputs[i])
            n = through.size
            delayed = np.concatenate([np.zeros(self.nk + self.nb - 1), through])
            return np.column_stack([delayed[k : k + n] for k in range(self.nb - 1, -1, -1)])

        return Separable(
            outputs=tuple(record.output for record in records),
            shared=shared,
            own=lambda _, i: np.ones((records[i].output.size, 1)),
            lower=np.full(self.na, -np.inf),
            upper=np.full(self.na, np.inf),
            sample_times=(self.sample_time,) * len(records),
        )

    def linearised(
        self, coordinates: FloatArray, records: Sequence[SignalRecord], noise: TrialNoise
    ) -> Linearised:
        """Return residuals and Jacobian at the coordinates, whitened by a model of the noise.

        ARX assumes a white equation error: whitening it would test another model.
        """
        a, b = np.split(coordinates, [self.na])
        if self.kind == "oe":
            constant, matrix = from_differences(self.na)
            x: Any = np.linalg.solve(matrix, a - constant)
            return linearise(self.problem(records), x, b, noise)
        blocks = [
            centred_regression(r.output, r.input, na=self.na, nb=self.nb, delay=self.nk)
            for r in records
        ]
        residuals = tuple(target - phi @ coordinates for phi, target in blocks)
        return Linearised(residuals, tuple(phi for phi, _ in blocks), len(blocks), WHITE)


def regression(
    output: ArrayLike, command: ArrayLike, *, na: int, nb: int, delay: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Stack the regression vectors ``phi(t)`` of ARX, shape ``(m, na + nb)``, and ``y(t)``.

    Only times whose whole regression vector lies inside the record are used: nothing is assumed
    about what went before it.

    Source: Matiskova 2021, equations (25), (26).
    """
    if na < 0 or nb < 1 or delay < 0:
        raise InputError(
            f"ARX orders na={na}, nb={nb}, delay={delay}; give na >= 0, nb >= 1, delay >= 0"
        )
    y = finite_samples(output, "output")
    u = finite_samples(command, "input")
    if y.size != u.size:
        raise InputError(f"output has {y.size} samples but input has {u.size}; give one length")
    start = max(na, delay + nb - 1)
    if y.size - start <= na + nb:
        raise InputError(
            f"record too short: {y.size} samples for ARX na={na}, nb={nb}, delay={delay}; "
            f"at least {start + na + nb + 1} are needed, record longer or lower the order"
        )
    past_y = [-y[start - i : y.size - i] for i in range(1, na + 1)]
    past_u = [u[start - i : u.size - i] for i in range(delay, delay + nb)]
    return np.column_stack([*past_y, *past_u]), y[start:]


def centred_regression(
    output: ArrayLike, command: ArrayLike, *, na: int, nb: int, delay: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Stack as `regression` does and subtract means: that fits an offset of the record's own."""
    phi, target = regression(output, command, na=na, nb=nb, delay=delay)
    return phi - phi.mean(axis=0), target - target.mean()


def from_differences(nf: int) -> tuple[FloatArray, FloatArray]:
    """Return c, M of ``f = c + M x``, x the first coefficients of F in powers of ``1 - 1/q``.

    Of a system sampled fast all poles are near 1 and f1..fnf nearly cancel; x do not.
    """
    powers = np.array([[(-1) ** j * comb(i, j) for i in range(nf + 1)] for j in range(1, nf + 1)])
    # F's leading 1 fixes the last coefficient: they sum to 1.
    last = powers[:, -1].astype(np.float64)
    return last, powers[:, :-1] - last[:, np.newaxis]
