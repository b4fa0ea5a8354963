"""Identify a linear model from a measured frequency response: orders side by side, one chosen."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.computation import Progress, one_blas_thread, versions
from pamsim.core.encoding import to_dict, write_json
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.identification.frequency_table import frequency_response_of
from pamsim.identification.models import ModelSet
from pamsim.identification.summary import summary_lines
from pamsim.inference.criteria import aicc_above_best
from pamsim.linear.continuous_structure import HIGHEST_ORDER
from pamsim.linear.frequency_fit import fit_frequency_response
from pamsim.linear.identified_model import FitStatus, IdentifiedModel
from pamsim.recordings.columns import Columns

SCHEMA = "pamsim-identify-frequency/2"
_BETTER = 2.0  # in AICc, from which a richer model is preferred


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyIdentification:
    """Continuous models of one frequency response.

    Attributes:
        source: path of the table.
        frequency: shape ``(n,)`` [rad/s].
        response: complex, shape ``(n,)`` [output per input].
        models: name -> the best model of each order.
        aicc: name -> AICc above the smallest.
        skipped: name -> why that model could not be fitted.
        recommended: name; empty if none can be trusted.
        reason: of the recommendation.
        notes: what a reader should know.
        seconds: wall time [s].
    """

    source: str
    frequency: FloatArray
    response: NDArray[np.complex128]
    models: Mapping[str, IdentifiedModel]
    aicc: Mapping[str, float]
    skipped: Mapping[str, str]
    recommended: str
    reason: str
    notes: tuple[str, ...]
    seconds: float

    @property
    def best(self) -> str:
        """Name of the model to use; empty if none can be trusted."""
        return self.recommended

    @property
    def shown(self) -> IdentifiedModel:
        """The recommended model; if there is none, the one with the smallest AICc."""
        return self.models[self.recommended or min(self.models, key=lambda name: self.aicc[name])]

    def transfer_function(self, *, pade_order: int | None = None) -> Any:
        """Return the shown model as a continuous ``control.TransferFunction``.

        Args:
            pade_order: as in `pamsim.linear.transfer_function.continuous`.

        Raises:
            InputError: a dead time comes without ``pade_order``.
        """
        from pamsim.linear.transfer_function import continuous  # takes a second

        return continuous(self.shown, pade_order=pade_order)

    def summary(self) -> str:
        """Every model with its numbers, and which to use: some lines of text."""
        return "\n".join(summary_lines(self.to_dict()))

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``identify.json``, and ``curves.csv``: measured and shown response.

        Args:
            folder: created if need be; files of the same names are replaced.

        Returns:
            The files written.

        Raises:
            InputError: if the place cannot be written.
        """
        result, curves = Path(folder) / "identify.json", Path(folder) / "curves.csv"
        write_json(result, self.to_dict())
        fit = self.shown
        run = fit.structure.frequency_response(fit.coordinates, self.frequency)
        with complete_file(curves) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            names = ("magnitude", "phase_deg", "model_magnitude", "model_phase_deg")
            writer.writerow(["omega_rad_s", *names])
            columns = [self.frequency]
            for response in (self.response, run):
                columns += [np.abs(response), np.angle(response) * DEG_PER_RAD]
            for row in np.column_stack(columns).tolist():
                writer.writerow([f"{value:.9g}" for value in row])
        return [result, curves]

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, JSON-safe."""
        return to_dict(
            {
                "schema": SCHEMA,
                "data": self.source,
                "inputs": [{"expression": f"{self.frequency.size} frequencies", "unit": "rad/s"}],
                "output": {"expression": "response", "unit": "1"},
                "trials": [{"name": Path(self.source).stem, "role": "fitted"}],
                "models": [self._model(name, fit) for name, fit in self.models.items()],
                "skipped": self.skipped,
                "recommended": self.recommended or None,
                "reason": self.reason,
                "local": None,
                "notes": self.notes,
                "versions": versions("scipy", "control"),
                "seconds": self.seconds,
            }
        )

    def _model(self, name: str, fit: IdentifiedModel) -> dict[str, Any]:
        return {
            "name": name,
            "kind": fit.structure.kind,
            "model": fit.structure.sentence,
            "status": fit.status,
            "sentence": fit.sentence,
            "parameters": {
                one.name: {"value": one.value, "unit": one.unit, "interval95": one.interval95}
                for one in fit.estimates
            },
            "fit_percent": fit.fit_percent,
            "fit_percent_held_out": None,
            "fit_percent_one_step": None,
            "aicc_above_best": self.aicc[name],
            "poles_rad_per_s": fit.continuous_poles,
            "zeros_rad_per_s": [fit.zeros],
            "independence": None,
        }


@one_blas_thread()
def identify_frequency_response(
    table: Columns,
    *,
    order: int | None = None,
    zeros: int = 0,
    poles: str = "auto",
    dead_time: str = "auto",
    progress: Progress | None = None,
) -> FrequencyIdentification:
    """Fit continuous models to a measured frequency response and choose one by AICc.

    Models of rising order, with every number of zeros below it, with and without dead time, are
    fitted by their relative error, until two orders in a row are no better. Poles are shown as time
    constants where all are real.

    Args:
        table: see `pamsim.identification.frequency_table.frequency_response_of`.
        order: of the model; all if left out.
        zeros: of the model of that order.
        poles: ``real`` lags, or ``any`` stable poles, as ``auto``.
        dead_time: ``none``, ``free`` (estimated), or ``auto`` for both.
        progress: called with ``(done, total, what)``.

    Returns:
        The best model of each order, the recommended one named with the reason.

    Raises:
        InputError: for data that cannot be read or fitted, or an unknown word.
    """
    began = time.perf_counter()
    chosen = ModelSet(order=order, zeros=zeros, poles=poles, dead_time=dead_time)
    frequency, response, notes = frequency_response_of(table)
    fits: dict[str, IdentifiedModel] = {}
    skipped: dict[str, str] = {}
    refusals: list[InputError] = []
    orders = range(1, HIGHEST_ORDER + 1) if order is None else (order,)
    for done, n in enumerate(orders):
        if progress is not None:
            progress(done, len(orders), f"order {n}")
        for m, late in _variants(chosen, n):
            name = _name(n, m, late)
            try:
                fits[name] = _fitted(frequency, response, n, m, late, poles)
            except InputError as error:
                refusals.append(error)
                skipped[name] = str(error)
        if _no_longer_better(fits, frequency.size, n):
            break
    if not fits:
        raise refusals[0]
    scores = _aicc(fits, frequency.size)
    # A model that cannot be trusted stands for its order only where there is no other.
    ranked = sorted(fits, key=lambda name: (not _trusted(fits[name]), scores[name]))
    best = {fits[name].structure.order: name for name in reversed(ranked)}
    shown = {best[n]: fits[best[n]] for n in sorted(best)}
    smallest = min(scores[name] for name in shown)
    recommended, reason = _recommended(fits, scores, shown)
    return FrequencyIdentification(
        source=str(table.path),
        frequency=frequency,
        response=response,
        models=shown,
        aicc={name: scores[name] - smallest for name in shown},
        skipped=skipped,
        recommended=recommended,
        reason=reason,
        notes=notes,
        seconds=time.perf_counter() - began,
    )


def _variants(chosen: ModelSet, order: int) -> Iterable[tuple[int, bool]]:
    """Zeros and dead time of the models of an order."""
    zeros = range(order) if chosen.order is None else (chosen.zeros,)
    return [(m, late) for m in zeros for late in chosen.delays]


def _no_longer_better(fits: Mapping[str, IdentifiedModel], frequencies: int, order: int) -> bool:
    """Whether neither this order nor the one before has the smallest AICc."""
    if not fits:
        return False
    scores = _aicc(fits, frequencies)
    return fits[min(scores, key=lambda name: scores[name])].structure.order < order - 1


def _name(order: int, zeros: int, late: bool) -> str:
    name = f"order_{order}" + (f"_zeros_{zeros}" if zeros else "")
    return name + ("_dead_time" if late else "")


def _fitted(
    frequency: FloatArray,
    response: NDArray[np.complex128],
    order: int,
    zeros: int,
    late: bool,
    poles: str,
) -> IdentifiedModel:
    """One fit; by time constants where all poles are real."""

    def fit(real: bool) -> IdentifiedModel:
        return fit_frequency_response(
            frequency, response, order=order, zeros=zeros, dead_time=late, real_lags=real
        )

    if poles == "real" or order == 1:
        return fit(True)
    free = fit(False)
    if poles == "any" or any(pole.imag for pole in free.poles):
        return free
    real = fit(True)
    equal = real.fit_percent > free.fit_percent - 1e-4 * (100.0 - free.fit_percent)
    return real if equal and real.status is FitStatus.CONVERGED else free


def _trusted(fit: IdentifiedModel) -> bool:
    return fit.status is FitStatus.CONVERGED


def _aicc(fits: Mapping[str, IdentifiedModel], frequencies: int) -> dict[str, float]:
    """AICc of the relative error, by the number of errors that are independent at best."""
    best = max(fits.values(), key=lambda fit: fit.fit_percent)
    samples = best.noise.independent([frequencies, frequencies])
    errors = [max(1.0 - fit.fit_percent / 100.0, 1e-12) for fit in fits.values()]
    unknowns = [fit.coordinates.size + 1.0 for fit in fits.values()]
    scores = aicc_above_best([error**2 for error in errors], unknowns, samples)
    return dict(zip(fits, scores, strict=True))


def _recommended(
    fits: Mapping[str, IdentifiedModel], scores: Mapping[str, float], shown: Iterable[str]
) -> tuple[str, str]:
    """The simplest trusted model that no richer one beats by more than 2 in AICc, and why."""
    trusted = [name for name in shown if _trusted(fits[name])]
    if not trusted:
        why = "; ".join(f"{name}: {fits[name].sentence}" for name in shown)
        return "", f"no model can be trusted ({why})"
    smallest = min(scores[name] for name in trusted)
    near = [name for name in trusted if scores[name] <= smallest + _BETTER]
    name = min(near, key=lambda name: fits[name].coordinates.size)
    if len(trusted) == 1:
        return name, "the only model whose parameters the response determines"
    return name, "smallest AICc, or the simpler model within 2 of it"
