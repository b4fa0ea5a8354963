"""Which continuous model is fitted: poles, zeros, integrators, dead time, start and drift."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import factorial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.held_input import chain_derivatives, chain_modes
from pamsim.identification.records import Data, FrequencyRecord, SignalRecord, time_range
from pamsim.identification.separable import Held, Separable, check_held

HIGHEST_ORDER = 6  # more than records of one output show
MOST_INTEGRATORS = 2  # from a force to a position
LEAST_DAMPING = 1e-3
"""Bound of a search: a record shows no smaller one, over which an oscillation hardly decays."""
BEYOND = 10.0  # how far beyond measured frequencies a pole may lie


@dataclass(frozen=True)
class ContinuousStructure:
    """``G(s) = (b0 + b1 s + ... + bm s^m) exp(-L s) / (s^q D(s))``, ``D(0) = 1``, D stable.

    Several inputs share the denominator; each has a numerator and a dead time of its own.

    Coordinates: one logarithm per pole coordinate, then L [s] of every input if there are dead
    times, then b0..bm of every input. Pole coordinates are ``ln T`` of each lag, or ``ln wn, ln
    zeta`` of each pair followed by ``ln T`` if the order is odd. Before a record its input is taken
    to have been ``input[0]``. With integrators and a free start the last coordinate is the
    derivative of order q that the output has where all inputs are 0; of one input it is
    ``-b0 u0``: the input at which the output does not run away is u0.

    Raises:
        InputError: for an order, a number of zeros or integrators out of range.
    """

    order: int  # n of D, 0 to 6
    # m, at most n + q; with as many zeros as poles the input reaches the output at once. Of inputs
    # that differ in it, the largest.
    zeros: int = 0
    dead_time: bool = False  # whether every L is free; otherwise all are 0
    real_lags: bool = True  # whether all poles are real
    start: str = "rest"  # of every trial: at ``rest``, or in a ``free`` state that is fitted
    integrators: int = 0  # q, 0 to 2
    drift: bool = False  # whether each output drifts along a line of its own
    inputs: int = 1
    # places of inputs whose L is 0 although those of others are free
    undelayed: tuple[int, ...] = ()
    zeros_each: tuple[int, ...] = ()  # m of each input; empty if they do not differ
    kind: ClassVar[str] = "continuous"

    def __post_init__(self) -> None:
        for name, most in (("order", HIGHEST_ORDER), ("integrators", MOST_INTEGRATORS)):
            count = getattr(self, name)
            if not 0 <= count <= most:
                raise InputError(f"{name} = {count}; give 0 to {most}")
        most = self.order + self.integrators
        if not 0 <= self.zeros <= most:
            raise InputError(f"zeros = {self.zeros} of {most} poles; give 0 to {most}")
        if len(set(self.zeros_each)) == 1:  # so that equal structures are equal
            object.__setattr__(self, "zeros_each", ())

    @property
    def pairs(self) -> int:
        """Number of (wn, zeta) pairs."""
        return 0 if self.real_lags else self.order // 2

    @property
    def searched(self) -> int:
        """Number of coordinates in which the output is not linear."""
        return self.order + len(self.delayed)

    @property
    def delayed(self) -> tuple[int, ...]:
        """Places of the inputs whose dead time is a coordinate."""
        if not self.dead_time:
            return ()
        return tuple(i for i in range(self.inputs) if i not in self.undelayed)

    @property
    def delay_places(self) -> dict[int, int]:
        """Place of each dead time among the coordinates -> its input."""
        return dict(enumerate(self.delayed, start=self.order))

    @property
    def marks(self) -> tuple[str, ...]:
        """What the names of each input's parameters end in: ``[1]``, ``[2]`` of several inputs."""
        return ("",) if self.inputs == 1 else tuple(f"[{i + 1}]" for i in range(self.inputs))

    @property
    def per_trial(self) -> int:
        """Number of coefficients that each trial has of its own."""
        return 1 + self._degree + (self.order if self.start == "free" else 0)

    @property
    def _degree(self) -> int:
        """Of the polynomial in time that each trial has of its own."""
        free = self.start == "free"
        return int(self.drift) + (max(self.integrators - 1, 0) if free else 0)

    @property
    def biased(self) -> bool:
        """Whether the input at which an integrating output rests is a coordinate."""
        return self.integrators > 0 and self.start == "free"

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return self.searched + sum(self.numerator_zeros) + self.inputs + int(self.biased)

    def counted(self, trials: int) -> int:
        """Return the number of coefficients of a fit to some trials, their own included."""
        return self.unknowns + self.per_trial * trials

    @property
    def numerator_zeros(self) -> tuple[int, ...]:
        """Number of zeros of each input."""
        return self.zeros_each or (self.zeros,) * self.inputs

    def coefficients(self, given: int = 0) -> slice:
        """Places of b0..bm of an input among the coordinates."""
        first = self.searched + sum(self.numerator_zeros[:given]) + given
        return slice(first, first + self.numerator_zeros[given] + 1)

    def static_gains(self, coordinates: FloatArray) -> FloatArray:
        """Return b0 of every input, shape ``(inputs,)`` [output per input]."""
        return coordinates[[self.coefficients(i).start for i in range(self.inputs)]]

    def channel(self, given: int) -> tuple[ContinuousStructure, NDArray[np.intp]]:
        """Return the structure from one input alone, and the places of its coordinates."""
        places = list(range(self.order))
        places += [self.order + self.delayed.index(given)] if given in self.delayed else []
        places += range(self.unknowns)[self.coefficients(given)]
        places += [self.unknowns - 1] if self.biased else []
        alone = replace(
            self,
            zeros=self.numerator_zeros[given],
            dead_time=given in self.delayed,
            inputs=1,
            undelayed=(),
            zeros_each=(),
        )
        return alone, np.array(places)

    @property
    def sentence(self) -> str:
        """The model in words."""
        counts = (
            (self.order, "real lag" if self.real_lags else "pole"),
            (self.integrators, "integrator"),
            (0 if self.zeros_each else self.zeros, "zero"),
        )
        parts = [f"{n} {what}{'s' if n > 1 else ''}" for n, what in counts if n]
        if self.zeros_each:
            parts.append(f"{' and '.join(map(str, self.zeros_each))} zeros")
        elif self.zeros and self.inputs > 1:
            parts[-1] += " of each input"
        if self.dead_time and self.undelayed:
            parts.append(f"dead time of input {' and '.join(str(i + 1) for i in self.delayed)}")
        elif self.dead_time:
            parts.append("dead time" if self.inputs == 1 else "dead times")
        parts += ["drift"] if self.drift else []
        return ", ".join(parts or ["a gain"])

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

    def delays(self, coordinates: FloatArray) -> FloatArray:
        """Return L of every input, shape ``(inputs,)`` [s]."""
        result = np.zeros(self.inputs)
        result[list(self.delayed)] = coordinates[self.order : self.searched]
        return result

    def delay(self, coordinates: FloatArray) -> float:
        """Return L of the only input [s]."""
        self._require_one_input()
        return float(self.delays(coordinates)[0])

    def _require_one_input(self) -> None:
        if self.inputs > 1:
            raise InputError(
                f"the model has {self.inputs} inputs where one is expected; take one by channel(i)"
            )

    def denominator(self, coordinates: FloatArray) -> FloatArray:
        """Return the coefficients of s^q D, highest power first, shape ``(n + q + 1,)``."""
        result: NDArray[Any] = np.array([1.0])
        for constant in self.constants(coordinates):
            result = np.convolve(result, [constant, 1.0])
        return np.append(np.real(result), np.zeros(self.integrators))

    def numerator(self, coordinates: FloatArray) -> FloatArray:
        """Return bm..b0 of the only input, shape ``(m + 1,)``."""
        self._require_one_input()
        return coordinates[self.coefficients()][::-1]

    def poles(self, coordinates: FloatArray) -> tuple[complex, ...]:
        """Return the roots of the denominator, slowest first [rad/s]."""
        roots = np.roots(self.denominator(coordinates))
        return tuple(complex(s) for s in roots[np.argsort(np.abs(roots), kind="stable")])

    def continuous_poles(self, coordinates: FloatArray) -> tuple[complex | None, ...]:
        """Return the poles: they are continuous already [rad/s]."""
        return self.poles(coordinates)

    def slowest(self, coordinates: FloatArray) -> float:
        """Return the longest time in which a mode decays by e; infinite with an integrator [s]."""
        if self.integrators:
            return float("inf")
        return max((1.0 / abs(pole.real) for pole in self.poles(coordinates)), default=0.0)

    def frequency_response(self, coordinates: FloatArray, frequency: FloatArray) -> NDArray[Any]:
        """Return G at frequencies, shape ``(n,)`` [rad/s] to ``(n,)`` [output per input]."""
        s = 1j * frequency
        value = np.polyval(self.numerator(coordinates), s)
        value = value / np.polyval(self.denominator(coordinates), s)
        return value * np.exp(-s * self.delay(coordinates))

    def step_response(self, coordinates: FloatArray, samples: int, interval: float) -> FloatArray:
        """Return the unit-step response at 0, interval, ... [s], shape ``(samples,)``."""
        columns = chain_derivatives(
            self.constants(coordinates),
            np.append(0.0, np.ones(samples)),
            interval,
            count=self.zeros + 1,
            dead_time=self.delay(coordinates),
            integrators=self.integrators,
        )
        return (columns @ coordinates[self.coefficients()])[1:]

    def responses(self, coordinates: FloatArray, record: SignalRecord) -> FloatArray:
        """Return the outputs for b = 1 of each numerator power of each input, from rest.

        Columns of length N; with a ``biased`` structure ``t^q / q!`` follows.
        """
        constants, delays = self.constants(coordinates), self.delays(coordinates)
        given = record.inputs if self.biased else record.inputs - record.inputs[0]
        columns = [
            chain_derivatives(
                constants,
                np.ascontiguousarray(given[:, i]),
                record.sample_time,
                count=self.numerator_zeros[i] + 1,
                dead_time=float(delays[i]),
                hold=record.holds[i],
                integrators=self.integrators,
            )
            for i in range(self.inputs)
        ]
        if self.biased:
            along = record.time - record.time[0]
            columns.append(along[:, np.newaxis] ** self.integrators / factorial(self.integrators))
        return columns[0] if len(columns) == 1 else np.hstack(columns)

    def trial_columns(self, coordinates: FloatArray, record: SignalRecord) -> FloatArray:
        """Return what each trial adds of its own: an offset, a drift, the modes of a free start."""
        samples = record.output.size
        polynomial = np.vander(np.linspace(0.0, 1.0, samples), 1 + self._degree, increasing=True)
        if self.start == "rest":
            return polynomial
        modes = chain_modes(self.constants(coordinates), samples, record.sample_time)
        return np.hstack([polynomial, modes])

    def free_run(
        self,
        coordinates: FloatArray,
        record: SignalRecord,
        since: int = 0,
        offset: float | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Simulate a record from a sample on, its offset (and initial state) fitted to its output.

        It moves at a later sample, so that a state there is fitted whatever the start. With an
        offset [output unit] the run starts at rest there and nothing is fitted. Returned are the
        output, shape ``(N - since,)``, and the trial's own coefficients, offset first.
        """
        forced = (self.responses(coordinates, record) @ coordinates[self.searched :])[since:]
        if offset is not None:
            return forced + offset, np.array([offset])
        rest = record.part(slice(since, None), held_out=True) if since else record
        own = (self.moving if since else self).trial_columns(coordinates, rest)
        coefficients: Any = np.linalg.lstsq(own, rest.output - forced, rcond=None)[0]
        return forced + own @ coefficients, coefficients

    @property
    def moving(self) -> ContinuousStructure:
        """The structure of a trial that does not begin at rest."""
        return replace(self, start="free")

    def _bounds(
        self, lags: tuple[float, float], least_damping: float, delays: tuple[float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Bounds of x, by those of ``ln T`` and of a dead time; a damping is at most 100."""
        lower, upper = (
            np.append(np.full(self.order, lag), np.full(len(self.delayed), delay))
            for lag, delay in zip(lags, delays, strict=True)
        )
        rates, dampings = slice(0, 2 * self.pairs, 2), slice(1, 2 * self.pairs, 2)
        lower[rates], upper[rates] = -lags[1], -lags[0]
        lower[dampings], upper[dampings] = np.log(least_damping), np.log(1e2)
        return lower, upper

    def problem(self, data: Data) -> Separable:
        """Return the least-squares problem: x is poles and dead times, theta the rest.

        Of trials the error of the free run counts: time constants lie between a tenth of the
        shortest sample and a hundred times the longest record, a dead time below half the shortest
        record. Of a frequency response the relative error counts, with equal weight for every
        frequency, as its real and imaginary part.
        """
        if isinstance(data, FrequencyRecord):
            return self._problem_of_response(data)
        shortest, longest = time_range(data)
        lags = np.log(0.1 * shortest), np.log(100.0 * longest)
        # One sample below 0, so that a search for a small delay does not crawl along a bound.
        delays = -shortest, 0.5 * min(record.duration for record in data)
        lower, upper = self._bounds(lags, LEAST_DAMPING, delays)
        return Separable(
            outputs=tuple(record.output for record in data),
            shared=lambda x, i: self.responses(x, data[i]),
            own=lambda x, i: self.trial_columns(x, data[i]),
            lower=lower,
            upper=upper,
            sample_times=tuple(record.sample_time for record in data),
        )

    def _problem_of_response(self, data: FrequencyRecord) -> Separable:
        w, weight = data.frequency, 1.0 / np.abs(data.response)
        parts = (np.real, np.imag)

        def columns(x: FloatArray, part: int) -> FloatArray:
            s = 1j * w
            below = np.polyval(self.denominator(x), s) * np.exp(s * self.delay(x))
            powers = s[:, np.newaxis] ** np.arange(self.zeros + 1)
            return parts[part](powers * (weight / below)[:, np.newaxis])

        # Somewhat wider than what is believed, so that the search does not end on it.
        lags = np.log(1.0 / (BEYOND * w[-1])) - 1.0, np.log(BEYOND / w[0]) + 1.0
        delays = -0.1 / w[-1], 1.1 * data.dead_times(self.zeros)[-1]
        lower, upper = self._bounds(lags, 1e-4, delays)
        none = np.zeros((w.size, 0))
        return Separable(
            outputs=tuple(part(weight * data.response) for part in parts),
            shared=columns,
            own=lambda x, part: none,
            lower=lower,
            upper=upper,
            sample_times=(1.0, 1.0),  # both parts: from one frequency to the next
        )

    def held(self, values: Mapping[str, float]) -> Held:
        """Return what values say of the coordinates: of ``offset``, and of the gain ``K``.

        Of several inputs ``K[1]`` ....

        Raises:
            InputError: for another name.
        """
        gains = {f"K{mark}": self.coefficients(i).start for i, mark in enumerate(self.marks)}
        check_held(values, [*gains, "offset"])
        count = self.unknowns - self.searched
        origin, free = np.zeros(count), np.ones(count, bool)
        for name, place in gains.items():
            if name in values:
                origin[place - self.searched], free[place - self.searched] = values[name], False
        return Held(origin, np.eye(count)[:, free], values.get("offset"))
