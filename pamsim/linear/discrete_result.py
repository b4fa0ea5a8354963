"""The result of an ARX or output-error fit to general inputs, several trials at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.inference.coloured_noise import ArNoise
from pamsim.linear.arx import ArxModel
from pamsim.linear.estimate import (
    Estimate,
    TrialScore,
    complex_list,
    estimates_as_dict,
    safe,
)
from pamsim.linear.step_fit import FitStatus

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DiscreteFit:
    """A fitted ``y = B(q)/A(q) u`` with its noise as ARX (``1/A e``) or output error has it.

    Attributes:
        kind: ``arx`` or ``oe``; of ``oe``, A is usually called F.
        model: the discrete model, shared by all trials.
        covariance: of (a1..., b1...), shape ``(k, k)``; None if the data do not determine them.
        estimates: a1..., b1..., and static gain ``K`` with 95 % intervals.
        trials: free run against each fitted trial.
        fit_percent: free run, pooled over trials, each about its own mean [%].
        fit_percent_one_step: one-step prediction, pooled; of ``oe`` the same as the free run [%].
        continuous_poles: ``log(z)/Ts`` per pole; None where no continuous pole exists (on the
            negative real axis or at 0) [rad/s].
        noise: model of the residuals.
        weighted: whether the estimates minimise the whitened error.
        status: whether to trust the numbers.
        sentence: the same for a person.
        unit_input: of the input.
        unit_output: of the output.
    """

    kind: str
    model: ArxModel
    covariance: FloatArray | None
    estimates: tuple[Estimate, ...]
    trials: tuple[TrialScore, ...]
    fit_percent: float
    fit_percent_one_step: float
    continuous_poles: tuple[complex | None, ...]
    noise: ArNoise
    weighted: bool
    status: FitStatus
    sentence: str
    unit_input: str
    unit_output: str

    @property
    def poles(self) -> tuple[complex, ...]:
        """Discrete poles, by falling magnitude [-]."""
        return self.model.poles

    @property
    def gain(self) -> float:
        """Static gain [output unit per input unit]."""
        return self.model.static_gain

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-safe values; keys carry their unit."""
        return {
            "kind": self.kind,
            "status": self.status.value,
            "sentence": self.sentence,
            "delay_samples": self.model.delay,
            "sample_time_s": self.model.sample_time,
            "unit_gain": f"{self.unit_output}/{self.unit_input}",
            "a": list(self.model.a),
            "b": list(self.model.b),
            **estimates_as_dict(self.estimates),
            "poles": complex_list(self.poles),
            "continuous_poles_rad_per_s": [
                None if s is None else [s.real, s.imag] for s in self.continuous_poles
            ],
            "fit_percent": safe(self.fit_percent),
            "fit_percent_one_step": safe(self.fit_percent_one_step),
            "trials": [trial.as_dict() for trial in self.trials],
            "noise": self.noise.as_dict(),
            "weighted": self.weighted,
        }
