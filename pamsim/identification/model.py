"""The result of every fit of a linear model: numbers with intervals, scores, noise, status."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure, Structure
from pamsim.identification.optimum import Optimum
from pamsim.identification.records import SignalRecord
from pamsim.inference.estimate import Estimate, Interval, without_intervals


class FitStatus(StrEnum):
    """Whether the numbers of a fit can be trusted."""

    CONVERGED = "converged"
    AT_BOUND = "at_bound"
    NOT_CONVERGED = "not_converged"
    DEGENERATE = "degenerate"


@dataclass(frozen=True, kw_only=True)
class TrialScore:
    """How well a model's free run matches one trial."""

    name: str  # the record's name
    samples: int
    offset: float  # output at rest under the first input value, estimated [output unit]
    fit_percent: float  # normalised RMS fit of the free run [%]
    rms: float  # root mean square of measured minus simulated [output unit]
    residual_lag1: float  # autocorrelation of the residual at one sample; near 0 if it is white [-]
    # of the output from the first sample to the last, along a line; None of a model without drift
    # [output unit]
    drift: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentifiedModel(Optimum):
    """A linear model fitted to one or several trials.

    The intervals hold if the structure is right: test that with
    :func:`pamsim.identification.residual_tests.residual_independence`. They allow for stationary
    noise that is independent of the input, coloured or white; those of ARX, and where that was
    asked for, take the residuals as white.

    Attributes:
        structure: which model, and what its coordinates are. Of a coordinate that was held the
            rows of the covariance are zero.
        estimates: the user's parameters with 95 % intervals: ``K``; ``T`` or ``T1``, ``T2`` ...
            rising, or ``wn``, ``zeta``; ``Tz`` (one zero) or ``c1`` ...; ``L``; of several inputs
            ``K[1]`` ..., ``Tz[1]`` ..., ``L[1]`` ...; of a discrete model also ``a1`` ... and
            ``b1`` ....
        trials: free run against each fitted trial.
        held_out: free run against each trial that was not fitted.
        fit_percent: of the free run, pooled over the fitted trials, each about its own mean [%].
        fit_percent_held_out: pooled over the held-out trials; None without any [%].
        fit_percent_one_step: of the one-step prediction; of ARX only [%].
        status: whether to trust the numbers; quote them only if it is ``converged``.
        sentence: the same for a person.
        refuted: whether a scan passes the structure over, however well it fits.
        level: output at rest without any input, mean of the fitted trials; None of a model that has
            none: it integrates, drifts, or was fitted to no trial [output unit].
        units_input: of each input.
        unit_output: of the output.
    """

    structure: Structure
    estimates: tuple[Estimate, ...]
    trials: tuple[TrialScore, ...]
    held_out: tuple[TrialScore, ...] = ()
    fit_percent: float
    fit_percent_held_out: float | None = None
    fit_percent_one_step: float | None = None
    status: FitStatus
    sentence: str
    refuted: bool = False
    level: float | None = None
    units_input: tuple[str, ...] = ("-",)
    unit_output: str = "-"

    def __post_init__(self) -> None:
        """State no interval where the search did not converge."""
        if self.status is FitStatus.NOT_CONVERGED:
            object.__setattr__(self, "estimates", without_intervals(self.estimates))

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate called ``name``, such as ``T1``."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        known = ", ".join(estimate.name for estimate in self.estimates)
        raise InputError(f"no parameter {name!r} in this fit; it has {known}")

    @property
    def gain(self) -> float:
        """Static gain K of the only input [output unit per input unit]."""
        return self["K"].value

    @property
    def time_constants(self) -> tuple[float, ...]:
        """Rising time constants; empty if the poles are not those of real lags [s]."""
        return tuple(estimate.value for estimate in self._lags)

    @property
    def interval95_time_constants(self) -> tuple[Interval | None, ...]:
        """One 95 % interval per time constant [s]."""
        return tuple(estimate.interval95 for estimate in self._lags)

    @property
    def _lags(self) -> tuple[Estimate, ...]:
        return tuple(e for e in self.estimates if e.name[0] == "T" and e.name[:2] != "Tz")

    def channel(self, given: int) -> IdentifiedModel:
        """Return the model from one of several inputs alone, the others at rest.

        Its scores, noise and status are those of the whole. Places count from 0.

        Raises:
            InputError: if there is no such input.
        """
        structure = self.structure
        if not 0 <= given < len(self.units_input):
            raise InputError(f"no input {given}; give 0 to {len(self.units_input) - 1}")
        if not isinstance(structure, ContinuousStructure) or structure.inputs == 1:
            return self
        alone, places = structure.channel(given)
        number = f"[{given + 1}]"
        return replace(
            self,
            structure=alone,
            coordinates=self.coordinates[places],
            covariance=None if self.covariance is None else self.covariance[np.ix_(places, places)],
            estimates=tuple(
                replace(e, name=e.name.removesuffix(number))
                for e in self.estimates
                if "[" not in e.name or e.name.endswith(number)
            ),
            units_input=(self.units_input[given],),
        )

    @property
    def channels(self) -> tuple[IdentifiedModel, ...]:
        """The model from each input alone; of one input the model itself."""
        return tuple(self.channel(i) for i in range(len(self.units_input)))

    @property
    def dead_time(self) -> float:
        """Delay of the only input [s]."""
        return self.structure.delay(self.coordinates)

    @property
    def numerator(self) -> tuple[float, ...]:
        """Numerator coefficients of the only input, highest power of s or z first."""
        return tuple(map(float, self.structure.numerator(self.coordinates)))

    @property
    def denominator(self) -> tuple[float, ...]:
        """Denominator coefficients, highest power of s or z first."""
        return tuple(map(float, self.structure.denominator(self.coordinates)))

    @property
    def poles(self) -> tuple[complex, ...]:
        """Poles, slowest first: continuous in rad/s, discrete in the z plane."""
        return self.structure.poles(self.coordinates)

    @property
    def zeros(self) -> tuple[complex, ...]:
        """Zeros from the only input: continuous in rad/s, discrete in the z plane."""
        return tuple(complex(root) for root in np.roots(self.numerator))

    @property
    def continuous_poles(self) -> tuple[complex | None, ...]:
        """Poles in rad/s; None for a discrete pole that no continuous one is sampled to."""
        return self.structure.continuous_poles(self.coordinates)

    def simulate(self, record: SignalRecord, offset: float | None = None) -> FloatArray:
        """Run the model freely on the inputs of any record in the units of the fit [output unit].

        The offset, and with ``start = "free"`` the initial state, are fitted to the record's
        output: nothing else of it is used. With an ``offset``, the output at rest under the first
        inputs, the run starts there at rest and nothing of the record's output is used.

        Raises:
            InputError: for a record that is sampled otherwise than a discrete model.
        """
        return self.structure.free_run(self.coordinates, record, offset=offset)[0]

    def predict(self, record: SignalRecord) -> FloatArray:
        """Predict the output of a record from its inputs alone [output unit].

        At first it rests under its first inputs. Without any input it would rest where the fitted
        trials would, on average.

        Raises:
            InputError: for a model without an output at rest: it integrates or drifts. Or as
                `simulate`.
        """
        if self.level is None:
            raise InputError(
                f"a model of {self.structure.sentence} has no output at rest to predict from; use"
                " simulate, or fit one without integrators or drift"
            )
        gains = self.structure.static_gains(self.coordinates)
        return self.simulate(record, self.level + float(record.inputs[0] @ gains))


def estimates_of(
    structure: Structure,
    at: Optimum,
    unit_output: str = "-",
    units_input: Sequence[str] = ("-",),
    latest: Mapping[int, float] | None = None,
) -> tuple[Estimate, ...]:
    """Return the user's parameters with 95 % intervals.

    Of a continuous model K, time constants or (wn, zeta), zeros and dead times. Of several inputs
    K, zeros and dead time carry the input's number: ``K[1]``. Of an integrating model K is the gain
    from the input to the output's rate (or its rate), and ``u0`` the input at which the output does
    not run away; of several inputs ``r0`` is that rate where all are 0.

    Of a discrete model K, the time constants if all poles are those of lags, a1..., b1....

    Intervals of positive parameters are symmetric in the logarithm. ``latest`` holds the upper ends
    of the intervals of dead times that were estimated as 0 and held there, by input [s]: 0 where
    the output leads the input.
    """
    if isinstance(structure, DiscreteStructure):
        return _of_discrete(structure, at, gain_unit(unit_output, units_input[0]))
    x = at.coordinates
    marks = structure.marks
    firsts = [structure.coefficients(i).start for i in range(structure.inputs)]
    per_time = ("", "/s", "/s^2")[structure.integrators]
    result: list[Estimate] = []
    for mark, first, unit in zip(marks, firsts, units_input, strict=True):
        unit_gain = gain_unit(unit_output, unit) + per_time
        result.append(at.estimate(f"K{mark}", unit_gain, float(x[first]), at.unit(first)))
    for name, unit, i in pole_names(structure, x):
        result.append(at.estimate(name, unit, float(np.exp(x[i])), at.unit(i), positive=True))
    for mark, first, zeros in zip(marks, firsts, structure.numerator_zeros, strict=True):
        for power in range(1, zeros + 1):
            name = "Tz" if zeros == 1 else f"c{power}"
            unit = "s" if power == 1 else f"s^{power}"
            result.append(at.estimate(name + mark, unit, *at.ratio(first + power, first)))
    if structure.biased:
        last = x.size - 1
        if structure.inputs > 1:
            unit = unit_output + per_time
            result.append(at.estimate("r0", unit, float(x[last]), at.unit(last)))
        else:
            ratio, gradient = at.ratio(last, firsts[0])
            result.append(at.estimate("u0", units_input[0], -ratio, -gradient))
    for place, i in structure.delay_places.items():
        delay, half = float(x[place]), at.half_width(at.unit(place))
        sides: Interval | None = None
        if latest and i in latest:
            sides = (0.0, latest[i])
        elif half is not None:
            sides = (max(delay - half, 0.0), max(delay + half, 0.0))
        result.append(Estimate(name=f"L{marks[i]}", unit="s", value=delay, interval95=sides))
    return tuple(result)


def gain_unit(unit_output: str, unit_input: str) -> str:
    """Unit of a gain."""
    below = f"({unit_input})" if re.search(r"[/*]", unit_input) else unit_input
    return "-" if unit_output == unit_input == "-" else f"{unit_output}/{below}"


def _of_discrete(
    structure: DiscreteStructure, searched: Optimum, unit_gain: str
) -> tuple[Estimate, ...]:
    """K, the time constants if all poles are those of lags, a1..., b1...."""
    na, nb = structure.na, structure.nb
    origin, matrix = structure.from_differences()
    to_a = np.eye(na + nb)
    to_a[:na, :na] = matrix
    at = searched.moved(np.append(origin, np.zeros(nb)), to_a)
    a, b = np.split(at.coordinates, [na])
    static, gain = 1.0 + float(np.sum(a)), float(structure.static_gains(searched.coordinates)[0])
    if np.isfinite(gain):
        gradient = np.concatenate([np.full(na, -gain / static), np.full(nb, 1.0 / static)])
        result = [at.estimate("K", unit_gain, gain, gradient)]
    else:
        result = [Estimate(name="K", unit=unit_gain, value=gain, interval95=None)]
    poles = structure.poles(searched.coordinates)
    lags = all(z.imag == 0.0 and 0.0 < z.real < 1.0 for z in poles)
    if lags and len(set(poles)) == na:
        below = np.append(1.0, a)
        for k, z in enumerate(sorted(z.real for z in poles)):
            # d ln T / dz = -1 / (z ln z), and A(z) = 0 gives dz/da.
            to_pole = -(z ** np.arange(na - 1, -1, -1)) / np.polyval(np.polyder(below), z)
            gradient = np.concatenate([-to_pole / (z * np.log(z)), np.zeros(nb)])
            constant = -structure.sample_time / float(np.log(z))
            name = f"T{k + 1}" if na > 1 else "T"
            result.append(at.estimate(name, "s", constant, gradient, positive=True))
    result += [at.estimate(f"a{i + 1}", "-", float(a[i]), at.unit(i)) for i in range(na)]
    result += [at.estimate(f"b{i + 1}", unit_gain, float(b[i]), at.unit(na + i)) for i in range(nb)]
    return tuple(result)


def pole_names(structure: ContinuousStructure, x: FloatArray) -> list[tuple[str, str, int]]:
    """Return name, unit and coordinate of each pole parameter; lags rise, pairs by rising wn."""
    pairs = sorted(range(structure.pairs), key=lambda pair: float(x[2 * pair]))
    number = [str(k + 1) if structure.pairs > 1 else "" for k in range(structure.pairs)]
    result: list[tuple[str, str, int]] = []
    for suffix, pair in zip(number, pairs, strict=True):
        result += [(f"wn{suffix}", "rad/s", 2 * pair), (f"zeta{suffix}", "-", 2 * pair + 1)]
    lags = sorted(range(2 * structure.pairs, structure.order), key=lambda i: float(x[i]))
    for k, i in enumerate(lags):
        result.append((f"T{k + 1}" if len(lags) > 1 else "T", "s", i))
    return result
