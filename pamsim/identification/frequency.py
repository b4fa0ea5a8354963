"""Identify a linear model from a measured frequency response: orders side by side, one chosen."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.computation import Progress, one_blas_thread, versions
from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError
from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.identification.choose import AICC, Choice, pick_trusted
from pamsim.identification.continuous import HIGHEST_ORDER, ContinuousStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.frequency_table import frequency_response_of
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.models import ModelSet
from pamsim.identification.records import FrequencyRecord
from pamsim.identification.result import (
    IdentificationResult,
    model_entry,
    parameter_entry,
    write_curves,
)
from pamsim.inference.criteria import aicc_above_best
from pamsim.recordings.columns import Columns

SCHEMA = "pamsim-identify-frequency/2"


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyIdentification(IdentificationResult):
    """Continuous models of one frequency response.

    Attributes:
        source: path of the table.
        frequency: shape ``(n,)`` [rad/s].
        response: complex, shape ``(n,)`` [output per input].
        models: name -> the best model of each order.
        aicc: name -> AICc above the smallest.
        skipped: name -> why that model could not be fitted.
        best: name of the model to use; empty if none can be trusted.
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
    best: str
    reason: str
    notes: tuple[str, ...]
    seconds: float

    @property
    def shown(self) -> IdentifiedModel:
        """The recommended model; if there is none, the one with the smallest AICc."""
        return self.models[self.best or min(self.models, key=lambda name: self.aicc[name])]

    def transfer_function(self, *, pade_order: int | None = None) -> Any:
        """Return the shown model as a continuous ``control.TransferFunction``.

        Args:
            pade_order: as in `pamsim.identification.transfer_function.continuous`.

        Raises:
            InputError: a dead time comes without ``pade_order``.
        """
        from pamsim.identification.transfer_function import continuous  # takes a second

        return continuous(self.shown, pade_order=pade_order)

    def save_curves(self, folder: str | Path) -> Path:
        """Write ``curves.csv`` into a folder: measured and shown response.

        Raises:
            InputError: if the place cannot be written.
        """
        fit = self.shown
        run = fit.structure.frequency_response(fit.coordinates, self.frequency)
        names = ["omega_rad_s", "magnitude", "phase_deg", "model_magnitude", "model_phase_deg"]
        columns = [self.frequency]
        for response in (self.response, run):
            columns += [np.abs(response), np.angle(response) * DEG_PER_RAD]
        return write_curves(folder, names, [((), np.column_stack(columns))])

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
                "recommended": self.best or None,
                "reason": self.reason,
                "local": None,
                "notes": self.notes,
                "versions": versions("scipy", "control"),
                "seconds": self.seconds,
            }
        )

    def _model(self, name: str, fit: IdentifiedModel) -> dict[str, Any]:
        return {
            **model_entry(name, fit, self.aicc[name]),
            "parameters": {one.name: parameter_entry(one, 1.0, one.unit) for one in fit.estimates},
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

    A gain and models of rising order, with every number of zeros below it, with and without dead
    time, are fitted by their relative error, until two orders in a row are no better. Poles are
    shown as time constants where all are real.

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
    data = FrequencyRecord(frequency, response)
    fits: dict[str, IdentifiedModel] = {}
    skipped: dict[str, str] = {}
    scores: dict[str, float] = {}
    orders = range(HIGHEST_ORDER + 1) if order is None else (order,)
    for done, n in enumerate(orders):
        if progress is not None:
            progress(done, len(orders), f"order {n}")
        # Every number of zeros, where no order is given; without and with dead time.
        each = range(max(n, 1)) if order is None else (zeros,)
        for m, late in product(each, chosen.delays):
            name = f"order_{n}" + (f"_zeros_{m}" if m else "") + ("_dead_time" if late else "")
            try:
                structure = ContinuousStructure(n, m, late, real_lags=False)
                fits[name] = _fitted(data, poles, structure)
            except InputError as error:
                skipped[name] = str(error)
        scores = _aicc(fits, frequency.size)
        if fits and fits[min(fits, key=scores.__getitem__)].structure.order < n - 1:
            break  # neither this order nor the one before is the best
    if not fits:
        raise InputError(next(iter(skipped.values())))
    trusted = {name for name, fit in fits.items() if fit.status is FitStatus.CONVERGED}
    # A model that cannot be trusted stands for its order only where there is no other.
    ranked = sorted(fits, key=lambda name: (name not in trusted, scores[name]))
    by_order = {fits[name].structure.order: name for name in reversed(ranked)}
    shown = {by_order[n]: fits[by_order[n]] for n in sorted(by_order)}
    smallest = min(scores[name] for name in shown)
    names = list(shown)
    choice = Choice(
        fits=tuple(shown.values()),
        fit_percent=tuple(fit.fit_percent for fit in shown.values()),
        judged_by=AICC,
        scores=tuple(scores[name] for name in names),
        basis="of the relative error",
    )
    place, reason = pick_trusted(choice, names)
    return FrequencyIdentification(
        source=str(table.path),
        frequency=frequency,
        response=response,
        models=shown,
        aicc={name: scores[name] - smallest for name in shown},
        skipped=skipped,
        best="" if place is None else names[place],
        reason=reason,
        notes=notes,
        seconds=time.perf_counter() - began,
    )


def _fitted(data: FrequencyRecord, poles: str, structure: ContinuousStructure) -> IdentifiedModel:
    """One fit; by time constants where all poles are real."""
    lags = replace(structure, real_lags=True)
    if poles == "real" or structure.order < 2:
        return fit_model(data, lags)
    free = fit_model(data, structure)
    if poles == "any" or any(pole.imag for pole in free.poles):
        return free
    real = fit_model(data, lags)
    equal = real.fit_percent > free.fit_percent - 1e-4 * (100.0 - free.fit_percent)
    return real if equal and real.status is FitStatus.CONVERGED else free


def _aicc(fits: Mapping[str, IdentifiedModel], frequencies: int) -> dict[str, float]:
    """AICc of the relative error, by the number of errors that are independent at best."""
    if not fits:
        return {}
    best = max(fits.values(), key=lambda fit: fit.fit_percent)
    samples = best.noise.independent([frequencies, frequencies])
    errors = [max(1.0 - fit.fit_percent / 100.0, 1e-12) for fit in fits.values()]
    unknowns = [fit.coordinates.size + 1.0 for fit in fits.values()]
    scores = aicc_above_best([error**2 for error in errors], unknowns, samples)
    return dict(zip(fits, scores, strict=True))
