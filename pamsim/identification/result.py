"""The results of ``identify``, in the units of screens and files: kPa, deg, s."""

from __future__ import annotations

import csv
import io
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.core.computation import versions
from pamsim.core.encoding import fields_to_dict, to_dict, write_json
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file
from pamsim.core.units import PA_PER_KPA, FloatArray
from pamsim.identification.choose import AICC, LIKELIHOOD, Choice
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.curves import (
    Curves,
    TrialCurve,
    frequency_response,
    step_response_band,
)
from pamsim.identification.data import IdentifyData, Source, read_data, trials_of
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.local_models import Dependence, LocalModelMap
from pamsim.identification.model import IdentifiedModel, TrialScore, gain_unit
from pamsim.identification.recommendation import Candidate, Recommendation
from pamsim.identification.records import SignalRecord
from pamsim.identification.signals import Signal, UsedTrial, signal, used_trial
from pamsim.identification.structure_scan import RoughFit
from pamsim.identification.summary import summary_lines
from pamsim.inference.estimate import Estimate
from pamsim.recordings.trial import TrialSet

SCHEMA = "pamsim-identify/4"
_POINTS = 300  # of a curve: as many as a figure shows
_STEP_LENGTH = 6.0  # slowest time constants that a step response is drawn for
_BELOW, _ABOVE = 0.03, 30.0  # corner frequencies, between which a Bode plot is drawn


class IdentificationResult:
    """What the results from trials and from a frequency response have in common."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return everything but the curves, JSON-safe."""

    @abstractmethod
    def save_curves(self, folder: str | Path) -> Path:
        """Write ``curves.csv`` into a folder."""

    def summary(self) -> str:
        """Every model with its numbers, and which to use: some lines of text."""
        return "\n".join(summary_lines(self.to_dict()))

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``identify.json`` and ``curves.csv``: what was measured, with the shown model.

        Args:
            folder: created if need be; files of the same names are replaced.

        Returns:
            The files written.

        Raises:
            InputError: if the place cannot be written.
        """
        result = Path(folder) / "identify.json"
        write_json(result, self.to_dict())
        return [result, self.save_curves(folder)]


@dataclass(frozen=True, kw_only=True)
class Identification(IdentificationResult):
    """Linear models of inputs and one output.

    Attributes:
        data: where the trials came from.
        inputs: the inputs.
        output: the output.
        used: trials that were fitted, with their records.
        held_out: trials that were not.
        candidates: the models, in the order they were fitted; numbers in SI.
        skipped: name -> why that model could not be fitted.
        choice: of a structure by a scan; None if the order was given.
        recommendation: which to use, and why.
        local: models at the operating points, or None.
        notes: what a reader should know.
        seconds: wall time [s].
    """

    data: IdentifyData
    inputs: tuple[Signal, ...]
    output: Signal
    used: tuple[UsedTrial, ...]
    held_out: tuple[UsedTrial, ...]
    candidates: tuple[Candidate, ...]
    skipped: Mapping[str, str]
    choice: Choice[RoughFit] | None
    recommendation: Recommendation
    local: LocalModelMap | None
    notes: tuple[str, ...]
    seconds: float

    @property
    def best(self) -> str:
        """Name of the model to use; empty if none can be trusted."""
        return self.recommendation.best

    @property
    def shown(self) -> Candidate:
        """The best model, recommended or not; else the continuous one that simulates best."""
        continuous = [candidate for candidate in self.candidates if candidate.continuous]
        for candidate in continuous:
            if candidate.name == self.recommendation.best:
                return candidate
        return max(continuous, key=lambda candidate: candidate.fit.fit_percent)

    def transfer_function(self, *, si: bool = False, pade_order: int | None = None) -> Any:
        """Return the shown model as a continuous ``control.TransferFunction``, a column per input.

        Args:
            si: whether between signals in SI units, as controllers of pamsim compute; otherwise
                between the columns as they are written, as everywhere else in this result.
            pade_order: as in `pamsim.identification.transfer_function.continuous`.

        Raises:
            InputError: a dead time comes without ``pade_order``.
        """
        from pamsim.identification.transfer_function import continuous  # takes a second

        system = continuous(self.shown.fit, pade_order=pade_order)
        return system if si else system * np.diag([self._gain(into) for into in self.inputs])

    def curves(self) -> Curves:
        """Signals, residuals and responses of the shown model, for figures."""
        fit, both = self.shown.fit, (*self.used, *self.held_out)
        rates = np.abs(np.array([pole for pole in fit.poles if pole != 0.0]))
        latest = max(channel.dead_time for channel in fit.channels)
        if rates.size == 0:  # a gain, or integrators alone
            rates = np.array([1.0 / (latest or max(one.record.duration for one in self.used))])
        slow, fast = float(np.min(rates)), float(np.max(rates))
        nyquist = float(np.pi / min(trial.record.sample_time for trial in self.used))
        times = np.linspace(0.0, _STEP_LENGTH / slow + latest, _POINTS)
        high = max(min(_ABOVE * fast, nyquist), 10.0 * slow)
        frequencies = np.geomspace(_BELOW * slow, high, _POINTS)
        channels = list(zip(fit.channels, map(self._gain, self.inputs), strict=True))
        return Curves(
            trials=tuple(
                self._curve(one.record, fit.simulate(one.record), one in self.held_out)
                for one in both
            ),
            steps=tuple(step_response_band(one, times, gain) for one, gain in channels),
            bodes=tuple(frequency_response(one, frequencies, gain) for one, gain in channels),
            nyquist=nyquist,
        )

    def _curve(self, record: SignalRecord, run: FloatArray, held_out: bool) -> TrialCurve:
        """A record with a run of a model, both in SI, in the columns' units."""
        return TrialCurve(
            name=record.name,
            held_out=held_out,
            time=record.time,
            inputs=record.inputs / [into.factor for into in self.inputs],
            output=record.output / self.output.factor,
            model=run / self.output.factor,
        )

    def predict(
        self,
        data: Source | TrialSet | Sequence[Source],
        *,
        time: str | None = None,
        dt: float | None = None,
        hold: str | None = None,
    ) -> tuple[TrialCurve, ...]:
        """Predict other recordings, such as another day's, with the shown model.

        Nothing is fitted to their output, neither an offset nor a state at the start: each trial
        rests at first, where the fitted trials would rest under its first inputs, on average.

        Args:
            data: as for `identify`, with the same columns.
            time: as for `identify`.
            dt: as for `identify` [s].
            hold: as for `identify`.

        Returns:
            Of each trial ``time``, ``inputs``, measured ``output`` and predicted ``model``, in the
            columns' units.

        Raises:
            InputError: for data that cannot be read, without these columns or in units of another
                quantity, or a model that integrates or drifts, so that it has no output at rest.
        """
        tables = trials_of(read_data(data), time=time, dt=dt, hold=hold).tables
        for one in (*self.inputs, self.output):
            found = signal(one.text, tables)
            if found.si_unit != one.si_unit:  # kPa for bar is converted
                raise InputError(
                    f"{one.text!r} is in {found.unit}, in the fitted trials in {one.unit}"
                    " (1: no unit is stated); state the same quantity in both"
                )
        records = [
            used_trial(table, self.inputs, self.output, held_out=True)[0].record for table in tables
        ]
        fit = self.shown.fit
        return tuple(self._curve(one, fit.predict(one), held_out=True) for one in records)

    def save_curves(self, folder: str | Path) -> Path:
        """Write ``curves.csv`` into a folder: every trial with the shown model's run.

        Raises:
            InputError: if the place cannot be written.
        """
        *given, out = (
            "" if side.unit == "1" else f"_{side.unit.lower()}"
            for side in (*self.inputs, self.output)
        )
        numbers = map(str, range(1, len(given) + 1)) if len(given) > 1 else [""]
        names = [f"input{number}{unit}" for number, unit in zip(numbers, given, strict=True)]
        names = ["trial", "time_s", *names, f"output{out}", f"model{out}"]
        return write_curves(
            folder,
            names,
            (
                ([one.name], np.column_stack([one.time, one.inputs, one.output, one.model]))
                for one in self.curves().trials
            ),
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, JSON-safe.

        Gains, offsets, errors and amplitudes are in the units of ``inputs`` and ``output``.
        """
        return to_dict(
            {
                "schema": SCHEMA,
                "data": self.data.source,
                "rig": self.data.rig,
                "inputs": [
                    {"expression": into.text, "unit": into.unit, "hold": hold}
                    for into, hold in zip(self.inputs, self.used[0].record.holds, strict=True)
                ],
                "output": {"expression": self.output.text, "unit": self.output.unit},
                "trials": [
                    *(_trial(trial, "fitted") for trial in self.used),
                    *(_trial(trial, "held_out") for trial in self.held_out),
                ],
                "models": [self._model(candidate) for candidate in self.candidates],
                "skipped": self.skipped,
                "scan": None if self.choice is None else self._scan(self.choice),
                "recommended": self.recommendation.name or None,
                "best": self.recommendation.best or None,
                "shown": self.shown.name,
                "reason": self.recommendation.reason,
                "missing": self.recommendation.missing or None,
                "effective_samples": self.recommendation.effective_samples,
                "local": None if self.local is None else self._local(self.local),
                "notes": self.notes,
                "versions": versions("scipy", "control"),
                "seconds": self.seconds,
            }
        )

    def _scan(self, choice: Choice[RoughFit]) -> dict[str, Any]:
        shown = self.shown.fit.structure
        if isinstance(shown, ContinuousStructure):  # as a scan has it
            shown = replace(shown, real_lags=False)
        rows = [
            {
                "model": fit.structure.sentence,
                "poles": fit.structure.order,
                "zeros": sum(fit.structure.numerator_zeros),
                "integrators": fit.structure.integrators,
                "dead_time": fit.structure.dead_time,
                "drift": fit.structure.drift,
                "coefficients": _coefficients(fit.structure),
                "shown": fit.structure == shown,
                "fit_percent": choice.fit_percent[i],
                "fit_percent_held_out": choice.held_out[i] if choice.held_out else None,
                "aicc_above_best": choice.scores[i] if choice.judged_by == AICC else None,
                "hannan_quinn_above_best": (
                    choice.scores[i] if choice.judged_by == LIKELIHOOD else None
                ),
            }
            for i, fit in enumerate(choice.fits)
        ]
        return {"judged_by": choice.judged_by, "structures": rows}

    def _model(self, candidate: Candidate) -> dict[str, Any]:
        fit, structure = candidate.fit, candidate.fit.structure
        discrete = not candidate.continuous
        # Of the sample time of the first trial.
        interval, noise = self.used[0].record.sample_time, fit.noise.models[0]
        return {
            **model_entry(candidate.name, fit, self.recommendation.aicc.get(candidate.name)),
            "parameters": self._parameters(fit.estimates),
            "discrete_poles": fit.poles if discrete else None,
            "delay_samples": structure.nk if isinstance(structure, DiscreteStructure) else None,
            "zeros_rad_per_s": None if discrete else [channel.zeros for channel in fit.channels],
            "independence": candidate.independence,
            "trials": self._scores(fit.trials),
            "held_out": self._scores(fit.held_out),
            "noise": {
                "ar_order": noise.order,
                "memory": noise.memory,
                "standard_deviation": noise.standard_deviation / self.output.factor,
                "correlation_s": noise.correlation_time(interval),
            },
        }

    def _gain(self, into: Signal) -> float:
        """Gain from an input in the columns' units per gain in SI."""
        return into.factor / self.output.factor

    def _parameters(self, estimates: Sequence[Estimate]) -> dict[str, Any]:
        """Name -> value, unit and interval, in the units of the columns."""
        return {one.name: self._parameter(one) for one in estimates}

    def _parameter(self, one: Estimate) -> dict[str, Any]:
        number, out = one.name.partition("[")[2].rstrip("]"), self.output
        into = self.inputs[int(number or 1) - 1]
        # By its name: rad/s is the unit of wn, whatever the input is in.
        if one.name == "u0":
            return parameter_entry(one, 1.0 / into.factor, into.unit)
        if one.name == "r0":
            rate = one.unit.removeprefix(out.si_unit)
            return parameter_entry(one, 1.0 / out.factor, out.unit + rate)
        if one.name[0] in "Kb":
            unit = out.unit if into.unit == "1" else gain_unit(out.unit, into.unit)
            rate = one.unit.removeprefix(gain_unit(out.si_unit, into.si_unit))  # if it integrates
            return parameter_entry(one, self._gain(into), unit + rate)
        return parameter_entry(one, 1.0, one.unit)

    def _scores(self, scores: Sequence[TrialScore]) -> list[TrialScore]:
        factor = self.output.factor
        return [
            replace(
                s,
                offset=s.offset / factor,
                rms=s.rms / factor,
                drift=None if s.drift is None else s.drift / factor,
            )
            for s in scores
        ]

    def _local(self, local: LocalModelMap) -> dict[str, Any]:
        (into,) = self.inputs
        return {
            "models": [
                {
                    "pressure_kpa": model.point.pressure / PA_PER_KPA,
                    "load_kg": model.point.load,
                    "direction": model.point.direction,
                    "amplitude": model.point.amplitude / into.factor,
                    "trials": [trial.name for trial in model.fit.trials],
                    "status": model.fit.status,
                    "sentence": model.fit.sentence,
                    "fit_percent": model.fit.fit_percent,
                    "parameters": self._parameters(model.fit.estimates),
                }
                for model in local.models
            ],
            "dependences": [self._dependence(item) for item in local.dependences],
        }

    def _dependence(self, item: Dependence) -> dict[str, Any]:
        """A dependence with its trends per kPa, kg, direction and unit of the input."""
        (into,) = self.inputs
        scale = self._gain(into) if item.parameter == "K" else 1.0
        regressors = {
            "pressure": ("kPa", PA_PER_KPA),
            "load": ("kg", 1.0),
            "direction": ("1", 1.0),
            "amplitude": (into.unit, into.factor),
        }
        trends: dict[str, Any] = {}
        for name, trend in item.trends.items():
            unit, per = regressors[name]
            factor = per if item.logarithmic else per * scale
            trends[name] = {
                **vars(trend),
                "slope": trend.slope * factor,
                "interval95": [end * factor for end in trend.interval95],
                "per": unit,
                "span": trend.span / per,
            }
        return fields_to_dict(replace(item, mean=item.mean * scale, trends=trends))


def write_curves(
    folder: str | Path, names: Sequence[str], tables: Iterable[tuple[Sequence[str], FloatArray]]
) -> Path:
    """Write ``curves.csv`` into a folder: of each table its words and numbers, row by row."""
    path = Path(folder) / "curves.csv"
    with complete_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerow(names)
        for words, numbers in tables:
            # One template for all rows: a writer that looks at every cell takes five times as long.
            row = io.StringIO()
            plain = [word.replace("%", "%%") for word in words]
            csv.writer(row).writerow([*plain, *["%.9g"] * numbers.shape[1]])
            template = row.getvalue()
            columns = (column.tolist() for column in numbers.T)
            file.writelines(template % cells for cells in zip(*columns, strict=True))
    return path


def model_entry(name: str, fit: IdentifiedModel, aicc_above_best: float | None) -> dict[str, Any]:
    """What is written of a model of any kind."""
    return {
        "name": name,
        "kind": fit.structure.kind,
        "model": fit.structure.sentence,
        "status": fit.status,
        "sentence": fit.sentence,
        "fit_percent": fit.fit_percent,
        "fit_percent_held_out": fit.fit_percent_held_out,
        "fit_percent_one_step": fit.fit_percent_one_step,
        "aicc_above_best": aicc_above_best,
        "poles_rad_per_s": fit.continuous_poles,
    }


def parameter_entry(estimate: Estimate, factor: float, unit: str) -> dict[str, Any]:
    """Value and interval, times a factor from SI, and the unit they have then."""
    sides = estimate.interval95
    return {
        "value": estimate.value * factor,
        "unit": unit,
        "interval95": None if sides is None else [end * factor for end in sides],
    }


def _coefficients(structure: ContinuousStructure) -> int:
    """Poles, zeros, gains, dead times and drift."""
    poles = structure.order + structure.integrators
    numerators = sum(structure.numerator_zeros) + structure.inputs
    return poles + numerators + len(structure.delayed) + int(structure.drift)


def _trial(trial: UsedTrial, role: str) -> dict[str, Any]:
    return {
        "name": trial.table.name,
        "protocol": trial.table.protocol,
        "role": role,
        "load_kg": trial.table.load,
        "samples": trial.record.output.size,
        "sample_s": trial.record.sample_time,
        "duration_s": trial.record.duration,
    }
