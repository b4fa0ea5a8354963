"""Fit force laws to a measured force map, and rank them by points they have not seen."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.muscles.braid import Braid
from pamsim.muscles.catalog import FORCE_LAWS
from pamsim.muscles.force_law import ForceLaw
from pamsim.store.measured_table import ForceMap
from pamsim.sysid.coefficient import Coefficient
from pamsim.sysid.curve_fit import fit_curve, search_curve
from pamsim.sysid.held_out import HeldOut, Rows, grouped, leave_one_group_out
from pamsim.sysid.scores import shared_by_group
from pamsim.workflows.fit_report import FittedCurve, coefficient_entries

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

_NO_TENSION = {
    "elastic_energy": "counts from a working point: it is no tension that a force map could show"
}
_TINY = 1e-9  # an open lower bound, as a share of the range


def fit_force_law(
    table: ForceMap,
    model: str,
    braid: Braid,
    *,
    held: Mapping[str, float],
    hold_out: str,
) -> FittedCurve:
    """Fit one force law to a force map.

    Args:
        table: the map.
        model: name of the law.
        braid: geometry, for laws that look at it.
        held: coefficients to hold [SI].
        hold_out: ``pressure``, ``length`` or ``none``: what the held-out error leaves out in turn.

    Returns:
        The fit.

    Raises:
        InputError: for an unknown law or coefficient, a value out of range, too few points, or a
            law that does not suit the map.
    """
    law = named_law(model)
    unsuited = unsuitable(law, table)
    if unsuited:
        raise InputError(f"model {model!r}: {unsuited}")
    coefficients = law_coefficients(law, table, braid, held)
    every = np.arange(table.force.size)
    fit = fit_curve(_curve(law, table, braid, every), table.force, coefficients)

    def fit_and_predict(train: Rows, test: Rows) -> FloatArray:
        found = search_curve(_curve(law, table, braid, train), table.force[train], coefficients)
        return _curve(law, table, braid, test)(found.values)

    held_out: HeldOut | None = None
    lengths = grouped(table.contraction)
    if hold_out != "none":
        groups = grouped(table.pressure) if hold_out == "pressure" else lengths
        held_out = leave_one_group_out(table.force, groups, fit_and_predict, by=hold_out)
    geometry = {name: spec for name, spec in specs(Braid) if name in law.braid_fields}
    return FittedCurve(
        model=model,
        part="",
        equation=law.equation,
        source=law.source,
        unit="N",
        points={
            "pressure": table.pressure,
            "contraction": table.contraction,
            "measured": table.force,
            "predicted": fit.predicted,
        },
        fit=fit,
        held_out=held_out,
        notes=tuple(_notes(law, table, braid, fit.values, fit.residual, lengths)),
        given={name: (getattr(braid, name), spec.unit) for name, spec in geometry.items()},
    )


def compare_force_laws(
    table: ForceMap,
    braid: Braid,
    *,
    held: Mapping[str, float],
    hold_out: str,
    progress: Progress | None = None,
) -> tuple[list[FittedCurve], dict[str, str]]:
    """Fit every force law that suits a map, best first.

    Args:
        table: the map.
        braid: geometry.
        held: coefficients to hold [SI], in the laws that have them.
        hold_out: as `fit_force_law`; what is ranked by. With ``none`` AICc ranks instead.
        progress: is told how far it is.

    Returns:
        The fits and, for each law that was left out, why.

    Raises:
        InputError: if no law can be fitted.
    """
    fits: list[FittedCurve] = []
    skipped: dict[str, str] = {}
    for i, (name, law) in enumerate(FORCE_LAWS.items()):
        if progress is not None:
            progress(i, len(FORCE_LAWS), name)
        own = {key: value for key, value in held.items() if key in dict(specs(law.group))}
        try:
            fits.append(fit_force_law(table, name, braid, held=own, hold_out=hold_out))
        except InputError as error:
            skipped[name] = str(error).removeprefix(f"model {name!r}: ")
    if not fits:
        raise InputError(f"no force law can be fitted: {next(iter(skipped.values()))}")
    return sorted(fits, key=_rank), skipped


def named_law(model: str) -> ForceLaw:
    """The force law of a name.

    Raises:
        InputError: if there is none, with the nearest name.
    """
    if model not in FORCE_LAWS:
        raise InputError(f"no force law {model!r}; {nearest(model, FORCE_LAWS)}")
    return FORCE_LAWS[model]


def unsuitable(law: ForceLaw, table: ForceMap) -> str:
    """Why a law cannot describe a map; empty if it can."""
    if law.name in _NO_TENSION:
        return _NO_TENSION[law.name]
    if law.pressure_range is None and np.ptp(table.pressure) > 0.01 * np.max(table.pressure):
        return "holds at one pressure, the map has several"
    return ""


def law_coefficients(
    law: ForceLaw, table: ForceMap, braid: Braid, held: Mapping[str, float]
) -> tuple[Coefficient, ...]:
    """What a fit may do with the coefficients of a law.

    The scale is held at 1 where the others can do the same: a law has one factor too many then.

    Raises:
        InputError: for a held name that the law lacks or a held value out of range.
    """
    fields = dict(specs(law.group))
    for name in held:
        if name not in fields:
            raise InputError(f"{law.name} has no coefficient {name!r}; {nearest(name, fields)}")
    defaults = {
        f.name: f.default
        for f in dataclasses.fields(law.group)
        if f.default is not dataclasses.MISSING
    }
    result: list[Coefficient] = []
    for name, spec in fields.items():
        low = spec.low + _TINY * (spec.high - spec.low) if spec.low_open else spec.low
        value = held.get(name)
        if value is not None and not low <= value <= spec.high:
            raise InputError(f"--hold {name}={value:g} is outside {spec.range_text()}")
        result.append(
            Coefficient(
                name=name,
                unit=spec.unit,
                low=low,
                high=spec.high,
                default=defaults.get(name),
                held=value,
            )
        )
    if "scale" not in held and _scale_is_redundant(law, table, braid, result):
        result[0] = dataclasses.replace(result[0], held=1.0)
    return tuple(result)


def section_of(fitted: FittedCurve, braid: Braid, braid_source: str) -> dict[str, dict[str, Any]]:
    """The fitted law as sections of a rig's ``params.toml``."""
    sections: dict[str, dict[str, Any]] = {}
    if fitted.given:
        sections["muscle.braid"] = {
            name: {"value": getattr(braid, name), "unit": spec.unit, "source": braid_source}
            for name, spec in specs(Braid)
        }
    sections["muscle.force"] = {"law": fitted.model, **coefficient_entries(fitted)}
    return sections


def _curve(
    law: ForceLaw, table: ForceMap, braid: Braid, rows: Rows
) -> Callable[[FloatArray], FloatArray]:
    points = list(zip(table.pressure[rows].tolist(), table.contraction[rows].tolist(), strict=True))
    geometry = [float(getattr(braid, name)) for name in law.braid_fields]

    def force(pressure: float, contraction: float, numbers: list[float]) -> float:
        # As ForceLaw.force, which would look the braid up again at each of a million points.
        try:
            return numbers[0] * law.force_function(pressure, contraction, *numbers[1:])
        except (OverflowError, ZeroDivisionError, ValueError):
            return math.nan  # scalar laws raise where arrays would give inf or NaN

    def curve(values: FloatArray) -> FloatArray:
        numbers = [*values.tolist(), *geometry]
        return np.array([force(p, k, numbers) for p, k in points])

    return curve


def _scale_is_redundant(
    law: ForceLaw, table: ForceMap, braid: Braid, coefficients: list[Coefficient]
) -> bool:
    """Whether the others can do what the scale does: its slope lies in the span of theirs."""
    if coefficients[0].name != "scale" or len(coefficients) == 1:
        return False
    curve = _curve(law, table, braid, np.arange(table.force.size))
    rng = np.random.default_rng(3)
    for _ in range(5):
        place = np.array([c.low + rng.uniform(0.3, 0.7) * (c.high - c.low) for c in coefficients])
        place[0] = 1.0
        columns: list[FloatArray] = []
        for i, c in enumerate(coefficients):
            step = np.zeros(place.size)
            step[i] = 1e-5 * (c.high - c.low)
            columns.append((curve(place + step) - curve(place - step)) / step[i])
        matrix = np.stack(columns, axis=1)
        if not np.all(np.isfinite(matrix)):
            continue
        norms = np.linalg.norm(matrix, axis=0)
        if norms[0] == 0.0:
            continue
        others = matrix[:, 1:] / np.where(norms[1:] > 0.0, norms[1:], 1.0)
        target = matrix[:, 0] / norms[0]
        rest = target - others @ np.linalg.lstsq(others, target, rcond=1e-10)[0]
        return float(np.linalg.norm(rest)) < 1e-5
    return False


def _notes(
    law: ForceLaw,
    table: ForceMap,
    braid: Braid,
    values: FloatArray,
    residual: FloatArray,
    lengths: FloatArray,
) -> list[str]:
    notes: list[str] = []
    low, high = law.contraction_range(values.tolist(), braid)
    outside = int(np.sum((table.contraction < low) | (table.contraction > high)))
    if outside:
        notes.append(
            f"{outside} of {table.force.size} points lie outside the contractions its source"
            f" vouches for, {low:.0%} to {high:.0%}"
        )
    if shared_by_group(residual, lengths) < 0.01:
        notes.append(
            "residuals agree within each length: shape or length readings err in common, and the"
            " intervals, which take points as independent, are too narrow"
        )
    return notes


def _rank(fitted: FittedCurve) -> tuple[bool, float]:
    if fitted.held_out is not None:
        value = fitted.held_out.pooled
    else:
        aicc = fitted.fit.scores.aicc
        value = -math.inf if aicc is None else aicc
    return math.isnan(value), value
