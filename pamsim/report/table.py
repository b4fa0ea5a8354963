"""A result as the columns of a table, for whoever goes on in pandas, polars or a spreadsheet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from pamsim.calibration.result import Calibration
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.result import LinkReport
from pamsim.fitting.result import FitResult
from pamsim.identification.frequency import FrequencyIdentification
from pamsim.identification.result import Identification
from pamsim.inference.estimate import Estimate
from pamsim.recordings.recording import Recording
from pamsim.recordings.trial import Trial
from pamsim.sweeps.result import SweepResult

_ESTIMATE = ("parameter", "unit", "value", "low", "high", "flags")
_EFFECT = ("effect", "level", "family", "place", "share", *_ESTIMATE[:-1])


def table(result: Any) -> dict[str, Any]:
    """Columns of a result, as ``pandas.DataFrame`` and ``polars.DataFrame`` take them.

    Args:
        result: a simulated recording or a measured trial, or what `pamsim.identify`, `fit`,
            `calibrate`, `diagnose` or `sweep` returns.

    Returns:
        Name -> column, all of one length. A recording or trial: ``time`` [s] and every signal, in
        SI, as `Recording.signals` names them. A calibration, fit or identification: a row per
        parameter, of an identification of each model, with ``value`` and the ends of its 95 %
        interval, ``low`` and ``high``, NaN where there is none, in ``unit`` [SI], and its
        ``flags``. A diagnosis: a row per parameter of each effect found, none without effects. A
        sweep: a row per run, in the units of its `factors` and `outputs`.

    Raises:
        InputError: if there is no table of such a result.
    """
    match result:
        case Recording():
            return {"time": result.time, **result.signals()}
        case Trial():
            return {"time": result.time, **result.measured}
        case SweepResult():
            return dict(result.columns())
        case Calibration():
            before = {"before": [freed.before.value for freed in result.freed]}
            return {**_columns(_ESTIMATE, map(_estimate, result.parameters)), **before}
        case FitResult():
            fits = [
                (f"{one.model} {one.part}".strip(), one.fit.coefficients) for one in result.fits
            ]
            return _by_model(fits)
        case Identification():
            return _by_model([(one.name, one.fit.estimates) for one in result.candidates])
        case FrequencyIdentification():
            return _by_model([(name, one.estimates) for name, one in result.models.items()])
        case LinkReport():
            return _columns(_EFFECT, _effects(result))
        case _:
            raise InputError(
                f"no table of a {type(result).__name__}; help(pamsim.table) lists what has one"
            )


def _columns(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> dict[str, Any]:
    listed = list(rows)
    return {name: [row[at] for row in listed] for at, name in enumerate(names)}


def _estimate(one: Estimate) -> tuple[Any, ...]:
    low, high = one.interval95 or (math.nan, math.nan)
    return one.name, one.unit, one.value, low, high, ", ".join(one.flags)


def _by_model(models: Iterable[tuple[str, Iterable[Estimate]]]) -> dict[str, Any]:
    rows = [(name, *_estimate(one)) for name, estimates in models for one in estimates]
    return _columns(("model", *_ESTIMATE), rows)


def _effects(result: LinkReport) -> Iterable[tuple[Any, ...]]:
    for one in result.effects:
        about = one.effect, one.level, one.family, one.place, one.share
        for name, size in one.sizes.items():
            yield *about, name, size.unit_si, size.value_si, *size.interval95_si
