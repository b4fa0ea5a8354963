"""The result of a continuous-time fit to general inputs: numbers, intervals, scores, status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.inference.coloured_noise import ArNoise
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.estimate import (
    Estimate,
    TrialScore,
    complex_list,
    estimates_as_dict,
    safe,
)
from pamsim.linear.signal_record import SignalRecord
from pamsim.linear.step_fit import FitStatus, Interval

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContinuousFit:
    """A fitted ``G(s) = K (1 + c1 s + ...) exp(-L s) / D(s)`` with ``D(0) = 1``.

    The intervals hold for noise that is stationary, independent of the input and coloured or
    white (see :mod:`pamsim.inference.coloured_noise`), and for a structure that is right: ask
    :func:`pamsim.linear.residual_independence.residual_independence` about the latter.

    Attributes:
        structure: order, zeros, dead time, real or any poles.
        coordinates: what the search moves: poles as logarithms, L [s], then b0..bm of the
            numerator, shape ``(k,)``.
        covariance: of the coordinates, shape ``(k, k)``; None if the data do not determine them.
            Rows of a coordinate that was held (a dead time found to be 0) are zero.
        estimates: the user's parameters with 95 % intervals: ``K``; ``T`` or ``T1``, ``T2`` ...
            rising; ``wn``, ``zeta``; ``Tz`` (one zero) or ``c1`` ...; ``L``.
        trials: free run against each fitted trial.
        held_out: free run against each trial that was not fitted.
        fit_percent: pooled over the fitted trials, each about its own mean [%].
        fit_percent_held_out: pooled over the held-out trials; None without any [%].
        noise: model of the residuals.
        weighted: whether the estimates minimise the whitened error; otherwise they minimise the
            plain simulation error, and only the intervals use the noise model.
        start: ``rest`` or ``free``.
        status: whether to trust the numbers.
        sentence: the same for a person.
        evaluations: model evaluations over all starts.
        unit_input: of the input.
        unit_output: of the output.
    """

    structure: ContinuousStructure
    coordinates: FloatArray
    covariance: FloatArray | None
    estimates: tuple[Estimate, ...]
    trials: tuple[TrialScore, ...]
    held_out: tuple[TrialScore, ...]
    fit_percent: float
    fit_percent_held_out: float | None
    noise: ArNoise
    weighted: bool
    start: str
    status: FitStatus
    sentence: str
    evaluations: int
    unit_input: str
    unit_output: str

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate called ``name``, such as ``T1``."""
        for item in self.estimates:
            if item.name == name:
                return item
        known = ", ".join(item.name for item in self.estimates)
        raise InputError(f"no parameter {name!r} in this fit; it has {known}")

    @property
    def gain(self) -> float:
        """Static gain K [output unit per input unit]."""
        return self["K"].value

    @property
    def interval95_gain(self) -> Interval | None:
        """95 % interval of K [output unit per input unit]."""
        return self["K"].interval95

    @property
    def time_constants(self) -> tuple[float, ...]:
        """Rising time constants; empty if the poles were not asked to be real lags [s]."""
        return tuple(item.value for item in self._lags)

    @property
    def interval95_time_constants(self) -> tuple[Interval | None, ...]:
        """One 95 % interval per time constant [s]."""
        return tuple(item.interval95 for item in self._lags)

    @property
    def _lags(self) -> tuple[Estimate, ...]:
        return tuple(e for e in self.estimates if e.name[0] == "T" and e.name != "Tz")

    @property
    def dead_time(self) -> float:
        """L, 0 unless it was freed [s]."""
        return self["L"].value if self.structure.dead_time else 0.0

    @property
    def numerator(self) -> tuple[float, ...]:
        """Numerator coefficients, highest power of s first."""
        return tuple(map(float, self.structure.numerator(self.coordinates)))

    @property
    def denominator(self) -> tuple[float, ...]:
        """Denominator coefficients, highest power of s first, the last one 1."""
        return tuple(map(float, self.structure.denominator(self.coordinates)))

    @property
    def poles(self) -> tuple[complex, ...]:
        """Roots of the denominator, slowest first [rad/s]."""
        roots = np.roots(self.denominator)
        return tuple(complex(s) for s in roots[np.argsort(np.abs(roots), kind="stable")])

    @property
    def zeros(self) -> tuple[complex, ...]:
        """Roots of the numerator [rad/s]."""
        return tuple(complex(s) for s in np.roots(self.numerator))

    def simulate(self, record: SignalRecord) -> FloatArray:
        """Run the model freely on a record's input.

        The offset, and with ``start = "free"`` the initial state, are fitted to the record's
        output: nothing else of it is used.

        Args:
            record: any trial in the units of the fit.

        Returns:
            The simulated output, shape ``(n,)`` [output unit].
        """
        return self.structure.free_run(self.coordinates, record, self.start)[0]

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-safe values; keys carry their unit."""
        return {
            "model": self.structure.sentence,
            "order": self.structure.order,
            "zeros": self.structure.zeros,
            "status": self.status.value,
            "sentence": self.sentence,
            "unit_gain": f"{self.unit_output}/{self.unit_input}",
            **estimates_as_dict(self.estimates),
            "poles_rad_per_s": complex_list(self.poles),
            "zeros_rad_per_s": complex_list(self.zeros),
            "fit_percent": safe(self.fit_percent),
            "fit_percent_held_out": safe(self.fit_percent_held_out),
            "trials": [trial.as_dict() for trial in self.trials],
            "held_out": [trial.as_dict() for trial in self.held_out],
            "noise": self.noise.as_dict(),
            "weighted": self.weighted,
            "start": self.start,
            "evaluations": self.evaluations,
        }
