"""What ``pamsim identify`` hands back, in the units of screens and files: kPa, deg, s."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.encoding import to_dict
from pamsim.core.finite import safe
from pamsim.core.units import PA_PER_KPA
from pamsim.core.versions import versions
from pamsim.identification.choice import Recommendation
from pamsim.identification.curves import Curves, curves_of
from pamsim.identification.data import IdentifyData
from pamsim.identification.models import Candidate, Fitted
from pamsim.identification.signals import Signal, SignalTable
from pamsim.linear.estimate import Estimate
from pamsim.linear.identified_model import IdentifiedModel, TrialScore
from pamsim.linear.local_models import Dependence, LocalModelMap
from pamsim.linear.signal_record import SignalRecord

FloatArray = NDArray[np.float64]
SCHEMA = "pamsim-identify/1"


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Linear models of one input and one output.

    Attributes:
        data: where the trials came from.
        given: the input.
        output: the output.
        used: trials that were fitted, with their records.
        held_out: trials that were not.
        fitted: the models.
        recommendation: which to use, and why.
        local: models at the operating points, or None.
        notes: what a reader should know.
        seconds: wall time [s].
    """

    data: IdentifyData
    given: Signal
    output: Signal
    used: tuple[tuple[SignalTable, SignalRecord], ...]
    held_out: tuple[tuple[SignalTable, SignalRecord], ...]
    fitted: Fitted
    recommendation: Recommendation
    local: LocalModelMap | None
    notes: tuple[str, ...]
    seconds: float

    @property
    def shown(self) -> Candidate:
        """The recommended model; if there is none, the continuous one that simulates best."""
        continuous = [c for c in self.fitted.candidates if c.fit.structure.kind == "continuous"]
        for candidate in continuous:
            if candidate.name == self.recommendation.name:
                return candidate
        return max(continuous, key=lambda candidate: candidate.fit.fit_percent)

    def curves(self) -> Curves:
        """Signals, residuals and responses of the shown model, for figures."""
        return curves_of(self.shown, self.used, self.held_out, self.given, self.output)

    def as_dict(self) -> dict[str, Any]:
        """Everything but the curves, JSON-safe, units in the key names."""
        return {
            "schema": SCHEMA,
            "data": self.data.source,
            "rig": self.data.rig,
            "input": self._signal(self.given, self.used[0][1].hold),
            "output": self._signal(self.output, None),
            "trials": [
                *(self._trial(pair, "fitted") for pair in self.used),
                *(self._trial(pair, "held_out") for pair in self.held_out),
            ],
            "models": [self._model(candidate) for candidate in self.fitted.candidates],
            "skipped": dict(self.fitted.skipped),
            "recommended": self.recommendation.name or None,
            "shown": self.shown.name,
            "reason": self.recommendation.reason,
            "effective_samples": safe(self.recommendation.effective_samples),
            "local": None if self.local is None else self._local(self.local),
            "notes": list(self.notes),
            "versions": versions("scipy", "control"),
            "seconds": self.seconds,
        }

    @property
    def _gain(self) -> tuple[str, str, float]:
        """Unit of a gain as shown, as a key, and shown per SI."""
        given, output = self.given, self.output
        unit = output.unit if given.unit == "1" else f"{output.unit}/{given.unit}"
        key = output.key if given.unit == "1" else f"{output.key}_per_{given.key}"
        return unit, key, given.factor / output.factor

    def _signal(self, signal: Signal, hold: str | None) -> dict[str, Any]:
        shown = {"expression": signal.text, "unit": signal.unit}
        return shown if hold is None else {**shown, "hold": hold}

    def _trial(self, pair: tuple[SignalTable, SignalRecord], role: str) -> dict[str, Any]:
        table, record = pair
        return {
            "name": table.name,
            "protocol": table.protocol,
            "role": role,
            "load_kg": table.load,
            "samples": int(record.output.size),
            "sample_s": record.sample_time,
            "duration_s": record.duration,
        }

    def _model(self, candidate: Candidate) -> dict[str, Any]:
        fit, name = candidate.fit, candidate.name
        independence = candidate.independence
        shared: dict[str, Any] = {
            "name": name,
            "kind": fit.structure.kind,
            "status": fit.status.value,
            "sentence": fit.sentence,
            "parameters": self.parameters(fit.estimates),
            "fit_percent": safe(fit.fit_percent),
            "independence": to_dict(independence),
            "trials": [self._score(trial) for trial in fit.trials],
            "noise": {
                "ar_order": fit.noise.order,
                f"standard_deviation_{self.output.key}": safe(
                    fit.noise.standard_deviation / self.output.factor
                ),
                "correlation_s": safe(fit.noise.correlation_time(self._interval)),
            },
        }
        if fit.structure.kind == "continuous":
            return {
                **shared,
                "model": fit.structure.sentence,
                "fit_percent_held_out": safe(fit.fit_percent_held_out),
                "held_out": [self._score(trial) for trial in fit.held_out],
                "aicc_above_best": safe(self.recommendation.aicc[name]),
                "poles_rad_per_s": to_dict(fit.poles),
                "zeros_rad_per_s": to_dict(fit.zeros),
            }
        return {**shared, **self._discrete(fit)}

    def _discrete(self, fit: IdentifiedModel) -> dict[str, Any]:
        poles = fit.continuous_poles
        return {
            "fit_percent_one_step": safe(fit.fit_percent_one_step),
            "delay_samples": fit.structure.nk,
            "sample_s": fit.structure.sample_time,
            "discrete_poles": to_dict(fit.poles),
            "poles_rad_per_s": [None if s is None else [s.real, s.imag] for s in poles],
        }

    def parameters(self, estimates: Sequence[Estimate]) -> dict[str, Any]:
        """Estimates under keys with their unit; gains in the units of the columns."""
        unit, key, scale = self._gain
        found: dict[str, Any] = {}
        for item in estimates:
            # Of a continuous model only K is a gain, of a discrete one the b as well.
            gain = item.unit == self._si_gain
            factor = scale if gain else 1.0
            sides = item.interval95
            found[f"{item.name}_{key}" if gain else item.key] = {
                "name": item.name,
                "unit": unit if gain else item.unit,
                "value": safe(item.value * factor),
                "interval95": None if sides is None else [safe(end * factor) for end in sides],
            }
        return found

    @property
    def _si_gain(self) -> str:
        return f"{self.output.si_unit}/{self.given.si_unit}"

    @property
    def _interval(self) -> float:
        return self.used[0][1].sample_time

    def _score(self, trial: TrialScore) -> dict[str, Any]:
        key, factor = self.output.key, self.output.factor
        return {
            "name": trial.name,
            f"offset_{key}": safe(trial.offset / factor),
            "fit_percent": safe(trial.fit_percent),
            f"rms_{key}": safe(trial.rms / factor),
        }

    def _local(self, found: LocalModelMap) -> dict[str, Any]:
        return {
            "models": [
                {
                    "pressure_kpa": model.point.pressure / PA_PER_KPA,
                    "load_kg": model.point.load,
                    "direction": model.point.direction,
                    f"amplitude_{self.given.key}": model.point.amplitude / self.given.factor,
                    "trials": [trial.name for trial in model.fit.trials],
                    "status": model.fit.status.value,
                    "sentence": model.fit.sentence,
                    "fit_percent": safe(model.fit.fit_percent),
                    "parameters": self.parameters(model.fit.estimates),
                }
                for model in found.models
            ],
            "dependences": [self._dependence(item) for item in found.dependences],
        }

    def _dependence(self, item: Dependence) -> dict[str, Any]:
        """A dependence with its slopes per kPa, kg, direction and shown unit of the input."""
        scale = self._gain[2] if item.parameter == "K" else 1.0
        regressors: Mapping[str, tuple[str, float]] = {
            "pressure": ("per_kpa", PA_PER_KPA),
            "load": ("per_kg", 1.0),
            "direction": ("per_direction", 1.0),
            "amplitude": (f"per_{self.given.key}", self.given.factor),
        }
        slopes: dict[str, Any] = {}
        for name, slope in item.slopes.items():
            key, per = regressors[name]
            factor = per if item.logarithmic else per * scale
            slopes[f"{name}_{key}"] = {
                "slope": safe(slope.value * factor),
                "interval95": [safe(end * factor) for end in slope.interval95],
                "p_value": safe(slope.p_value),
                "span": safe(slope.span / per),
            }
        return {
            "parameter": item.parameter,
            "logarithmic": item.logarithmic,
            "mean": safe(item.mean * scale),
            "points": item.points,
            "heterogeneity_p_value": safe(item.heterogeneity_p),
            "slopes": slopes,
            "sentence": item.sentence,
        }
